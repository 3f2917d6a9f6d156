# SPDX-License-Identifier: BSD-3-Clause
# cmake --build DIR --target package: Debian packages of what was built, in DIR/packages. scripts/package makes and
# checks them on the distribution that it runs on.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_CONTACT "The Plumbline authors <maintainers@users.noreply.github.com>")
set(CPACK_PACKAGE_HOMEPAGE_URL "https://github.com/plumbline/plumbline")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "RGB-D recordings in, one dense metric point cloud out")
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_VERBATIM_VARIABLES ON)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program net ros1 dev doc)
if(TARGET plumbline_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(this_version "= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}")

# plumbline_package(COMPONENT NAME SECTION "one line" "paragraph" DEPENDS... ): names of variables are CPack's.
function(plumbline_package component name section summary description)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  # Lines of at most 78 characters.
  string(REPLACE " " ";" words "${description}")
  set(description "")
  set(line "")
  foreach(word ${words})
    string(LENGTH "${line} ${word}" length)
    if(length GREATER 78)
      string(APPEND description "${line}\n")
      set(line "")
    endif()
    string(APPEND line " ${word}")
    string(STRIP "${line}" line)
  endforeach()
  string(APPEND description "${line}")
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${summary}\n${description}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${summary}\n${description}" PARENT_SCOPE)
  # Each package has its own copyright and changelog, as Debian wants it.
  set(folder share/doc/${name})
  install(FILES ${PROJECT_BINARY_DIR}/package_files/copyright ${PROJECT_BINARY_DIR}/package_files/changelog.Debian.gz
          DESTINATION ${folder} COMPONENT ${component} EXCLUDE_FROM_ALL)
endfunction()

plumbline_package(program plumbline science "maps RGB-D recordings into one dense, metric point cloud"
  "Tracks points, lines, depth and grey values of RGB-D recordings (folders, films, generated worlds), closes loops, refines the whole map and writes a coloured cloud, the camera's path, pictures and a report: on a CPU, without a display, with the same result every time. Further commands filter, measure, draw, export and fuse maps.")
plumbline_package(net plumbline-net science "maps of robots over a network, for plumbline"
  "The part of plumbline that its commands hub and robot need: robots send their maps to a hub, which fuses them (CycloneDDS). Brings a systemd unit for the hub.")
plumbline_package(ros1 plumbline-ros1 science "ROS bags, for plumbline"
  "The part of plumbline that reads ROS bags (ROS 1 .bag, ROS 2 .mcap and .db3) and writes MCAP files.")
plumbline_package(dev libplumbline-dev libdevel "headers of plumbline's library"
  "Headers and the CMake package of plumbline: find_package(plumbline). The library comes with the program.")
plumbline_package(python python3-plumbline python "plumbline as a Python module"
  "Recordings, live mapping, results, filters, measures and pictures of plumbline, with numpy arrays.")
plumbline_package(doc plumbline-doc doc "documentation of plumbline"
  "The guide, the reference, the method with its formulas and the examples of plumbline.")

set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "plumbline-net (${this_version}), plumbline-ros1 (${this_version})")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "ffmpeg, plumbline-doc")
set(CPACK_DEBIAN_NET_PACKAGE_DEPENDS "plumbline (${this_version})")
set(CPACK_DEBIAN_ROS1_PACKAGE_DEPENDS "plumbline (${this_version})")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "plumbline (${this_version}), python3-numpy")
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DOC_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DOC_PACKAGE_ARCHITECTURE all)
# What the public headers include and cmake/plumblineConfig.cmake.in finds; tests/packaging compares.
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "plumbline (${this_version}), libpcl-dev, libopencv-dev, libeigen3-dev, libexpected-dev")
if(PLUMBLINE_PYTHON_VERSION MATCHES "^([0-9]+)\\.([0-9]+)") # the compiled part is for this one alone
  math(EXPR next_minor "${CMAKE_MATCH_2} + 1")
  string(APPEND CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS ", python3 (>= ${CMAKE_MATCH_1}.${CMAKE_MATCH_2}), python3 (<< ${CMAKE_MATCH_1}.${next_minor})")
endif()

set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/scripts/packaging/python/postinst
    ${PROJECT_SOURCE_DIR}/scripts/packaging/python/prerm)

# The hub as a service.
install(FILES ${PROJECT_SOURCE_DIR}/scripts/plumbline-hub.service DESTINATION lib/systemd/system COMPONENT net EXCLUDE_FROM_ALL)
set(CPACK_DEBIAN_NET_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/scripts/packaging/net/postinst
    ${PROJECT_SOURCE_DIR}/scripts/packaging/net/prerm ${PROJECT_SOURCE_DIR}/scripts/packaging/net/postrm)

# Pages with all that they link to, and examples. Docs.cmake has found Python.
install(CODE "execute_process(COMMAND \"${Python3_EXECUTABLE}\" -B \"${PROJECT_SOURCE_DIR}/cmake/site_pages.py\"
                \"${PROJECT_SOURCE_DIR}\" \"${PROJECT_BINARY_DIR}/package_files/doc\" COMMAND_ERROR_IS_FATAL ANY)"
        COMPONENT doc EXCLUDE_FROM_ALL)
install(DIRECTORY ${PROJECT_BINARY_DIR}/package_files/doc/pages/ DESTINATION share/doc/plumbline-doc COMPONENT doc EXCLUDE_FROM_ALL)
install(DIRECTORY examples DESTINATION share/doc/plumbline-doc COMPONENT doc EXCLUDE_FROM_ALL USE_SOURCE_PERMISSIONS)

# copyright and changelog.Debian.gz, once for all.
configure_file(cmake/copyright.in ${PROJECT_BINARY_DIR}/package_files/copyright @ONLY)
configure_file(cmake/changelog.in ${PROJECT_BINARY_DIR}/package_files/changelog.Debian @ONLY)
execute_process(COMMAND gzip -9 -n -f ${PROJECT_BINARY_DIR}/package_files/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)
include(CPack)
