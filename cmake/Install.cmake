# SPDX-License-Identifier: BSD-3-Clause
# What find_package(plumbline) finds: headers, plumbline::<module> for every module, and what they need.
# Module.cmake installs the libraries, src/cli the program and the pipelines.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/plumbline)

install(DIRECTORY include/plumbline DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev
        FILES_MATCHING PATTERN "*.hpp")
# Targets that are no modules but that modules bring along.
set_target_properties(plumbline_pcl PROPERTIES EXPORT_NAME pcl)
set_target_properties(plumbline_offscreen PROPERTIES EXPORT_NAME offscreen)
install(TARGETS plumbline_pcl plumbline_offscreen EXPORT plumbline COMPONENT dev)
install(EXPORT plumbline NAMESPACE plumbline:: DESTINATION ${package_folder} FILE plumblineTargets.cmake
        COMPONENT dev)

set(program ${CMAKE_INSTALL_BINDIR}/plumbline)
set(pipelines ${CMAKE_INSTALL_DATADIR}/plumbline/pipelines)
configure_package_config_file(cmake/plumblineConfig.cmake.in ${PROJECT_BINARY_DIR}/plumblineConfig.cmake
                              INSTALL_DESTINATION ${package_folder} PATH_VARS program pipelines NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/plumblineConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/plumblineConfig.cmake ${PROJECT_BINARY_DIR}/plumblineConfigVersion.cmake
        DESTINATION ${package_folder} COMPONENT dev)
