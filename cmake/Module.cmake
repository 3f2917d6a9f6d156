# SPDX-License-Identifier: BSD-3-Clause
# plumbline_module(NAME [DEPENDS module...] [LINK library...] [PRIVATE_LINK library...] [EXCEPT source...]
#                  [PCH header... | PCH_FROM module])
# One folder = one static library = one layer. Sources are all *.cpp of the folder and its subfolders, except those of a
# part. A module
# may take the precompiled header of another whose macros are no more than its own.
function(plumbline_module name)
  cmake_parse_arguments(ARG "" "PCH_FROM" "DEPENDS;LINK;PRIVATE_LINK;EXCEPT;PCH" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp ${CMAKE_CURRENT_SOURCE_DIR}/*/*.cpp)
  list(TRANSFORM ARG_EXCEPT PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  list(REMOVE_ITEM sources ${ARG_EXCEPT})
  list(TRANSFORM ARG_DEPENDS PREPEND plumbline::)
  if(sources)
    add_library(plumbline_${name} STATIC ${sources})
    target_include_directories(plumbline_${name} PUBLIC ${PROJECT_SOURCE_DIR}/include PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
    target_compile_options(plumbline_${name} PRIVATE $<TARGET_PROPERTY:plumbline_warnings,INTERFACE_COMPILE_OPTIONS>)
    target_link_libraries(plumbline_${name} PUBLIC ${ARG_DEPENDS} ${ARG_LINK} PRIVATE ${ARG_PRIVATE_LINK})
    if(ARG_PCH)
      target_precompile_headers(plumbline_${name} PRIVATE ${ARG_PCH})
    elseif(ARG_PCH_FROM)
      target_precompile_headers(plumbline_${name} REUSE_FROM plumbline_${ARG_PCH_FROM})
    endif()
  else()
    add_library(plumbline_${name} INTERFACE)
    target_include_directories(plumbline_${name} INTERFACE ${PROJECT_SOURCE_DIR}/include)
    target_link_libraries(plumbline_${name} INTERFACE ${ARG_DEPENDS} ${ARG_LINK})
  endif()
  add_library(plumbline::${name} ALIAS plumbline_${name})
endfunction()

# plumbline_part(NAME MODULE module SOURCES source... [LINK library...] [PCH header...] [COMPONENT package])
# A shared object that is loaded by the first who needs it (core/part.hpp). It has all its code in itself: what
# sources a part shares with its module are compiled into both.
function(plumbline_part name)
  cmake_parse_arguments(ARG "" "MODULE;COMPONENT" "SOURCES;LINK;PCH" ${ARGN})
  if(NOT ARG_COMPONENT)
    set(ARG_COMPONENT program)
  endif()
  set(target plumbline_part_${name})
  add_library(${target} MODULE ${ARG_SOURCES})
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME plumbline_${name} CXX_VISIBILITY_PRESET hidden
                        VISIBILITY_INLINES_HIDDEN ON SKIP_BUILD_RPATH ON
                        LIBRARY_OUTPUT_DIRECTORY ${PLUMBLINE_PARTS})
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/include ${CMAKE_CURRENT_SOURCE_DIR})
  target_link_libraries(${target} PRIVATE ${ARG_LINK} plumbline_warnings)
  target_link_options(${target} PRIVATE LINKER:--exclude-libs,ALL) # its copies cannot meet the program's
  if(ARG_PCH)
    target_precompile_headers(${target} PRIVATE ${ARG_PCH})
  endif()
  add_dependencies(plumbline_${ARG_MODULE} ${target}) # so that whatever links the module has the part at hand
  install(TARGETS ${target} LIBRARY DESTINATION ${PLUMBLINE_INSTALLED_PARTS} COMPONENT ${ARG_COMPONENT})
endfunction()

# plumbline_test(NAME SOURCES... LINK library... [LABEL label]): a GoogleTest program, each of its tests seen by
# ctest under the label (default: unit). A test that GTEST_SKIPs, for want of recordings say, is told as skipped.
function(plumbline_test name)
  cmake_parse_arguments(ARG "" "LABEL" "SOURCES;LINK" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  add_executable(${name} ${ARG_SOURCES} ${PROJECT_SOURCE_DIR}/tests/scratch_folder.cpp)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests/unit)
  target_link_libraries(${name} PRIVATE ${ARG_LINK} GTest::gtest_main plumbline_warnings)
  if(name STREQUAL test_core) # the fewest macros
    target_precompile_headers(${name} PRIVATE ${PROJECT_SOURCE_DIR}/cmake/test_pch.hpp)
  else()
    target_precompile_headers(${name} REUSE_FROM test_core)
  endif()
  target_compile_definitions(${name} PRIVATE PLUMBLINE_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
                       PROPERTIES LABELS ${ARG_LABEL} TIMEOUT 300)
endfunction()
