# SPDX-License-Identifier: BSD-3-Clause
# cmake --build DIR --target site: all pages as a site with search, in DIR/site; a link that leads nowhere is an error.
find_program(MKDOCS mkdocs)
find_package(Python3 3.9 QUIET COMPONENTS Interpreter)
if(MKDOCS AND Python3_FOUND)
  add_custom_target(site
    COMMAND Python3::Interpreter -B ${PROJECT_SOURCE_DIR}/cmake/site_pages.py ${PROJECT_SOURCE_DIR} ${CMAKE_BINARY_DIR}/site_pages ${PROJECT_VERSION}
    COMMAND ${CMAKE_COMMAND} -E env NO_COLOR=1 ${MKDOCS} build --strict --quiet --config-file ${CMAKE_BINARY_DIR}/site_pages/mkdocs.yml
    COMMENT "Site of the pages" VERBATIM)
else()
  add_custom_target(site COMMAND ${CMAKE_COMMAND} -E echo "mkdocs is missing; scripts/install-deps --judges installs it"
                         COMMAND ${CMAKE_COMMAND} -E false)
endif()

# cmake --build DIR --target docs: the reference of the installed headers, in DIR/docs/html. A warning is an error.
find_package(Doxygen QUIET)
if(NOT DOXYGEN_FOUND)
  add_custom_target(docs COMMAND ${CMAKE_COMMAND} -E echo "Doxygen is missing; scripts/install-deps installs it"
                         COMMAND ${CMAKE_COMMAND} -E false)
  return()
endif()
set(DOXYGEN_PROJECT_BRIEF "${PROJECT_DESCRIPTION}")
set(DOXYGEN_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/docs)
set(DOXYGEN_STRIP_FROM_PATH ${PROJECT_SOURCE_DIR}/include)
set(DOXYGEN_STRIP_FROM_INC_PATH ${PROJECT_SOURCE_DIR}/include)
set(DOXYGEN_USE_MDFILE_AS_MAINPAGE ${PROJECT_SOURCE_DIR}/cmake/library.md)
set(DOXYGEN_EXTRACT_ALL YES)
set(DOXYGEN_JAVADOC_AUTOBRIEF YES)
set(DOXYGEN_AUTOLINK_SUPPORT NO) # words such as "Map" are not meant as links
set(DOXYGEN_HAVE_DOT NO)
set(DOXYGEN_QUIET YES)
set(DOXYGEN_WARN_AS_ERROR FAIL_ON_WARNINGS)
list(TRANSFORM public_headers PREPEND ${PROJECT_SOURCE_DIR}/include/plumbline/ OUTPUT_VARIABLE documented)
doxygen_add_docs(docs ${documented} ${PROJECT_SOURCE_DIR}/cmake/library.md
                 COMMENT "Reference of the public headers")
