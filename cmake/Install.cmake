# SPDX-License-Identifier: BSD-3-Clause
# What find_package(plumbline) finds: plumbline::plumbline (src/session makes it) and the headers below, of which each needs
# only Eigen, OpenCV's core, PCL and tl-expected; the others are between modules. tests/consumer compiles each alone.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/plumbline)

set(public_headers plumbline.hpp
    session/map.hpp session/mapper.hpp session/options.hpp session/result.hpp pipeline/live_pose.hpp
    cloud/types.hpp cloud/io/cloud_io.hpp cloud/io/frame.hpp cloud/io/mesh.hpp cloud/io/ply.hpp
    cloud/filters/choosing_filter.hpp cloud/filters/filter.hpp cloud/filters/filter_plugin.hpp
    cloud/filters/flying_pixels.hpp cloud/filters/incidence_angle.hpp cloud/filters/normal_consistency.hpp
    core/config.hpp core/error.hpp core/executor.hpp core/ids.hpp core/log.hpp core/options.hpp core/stop.hpp core/version.hpp
    geometry/rigid3.hpp geometry/trajectory.hpp sensor/camera.hpp sensor/depth_noise.hpp sensor/lens.hpp)
foreach(header ${public_headers})
  cmake_path(GET header PARENT_PATH folder)
  install(FILES include/plumbline/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/plumbline/${folder} COMPONENT dev)
endforeach()
install(EXPORT plumbline NAMESPACE plumbline:: DESTINATION ${package_folder} FILE plumblineTargets.cmake COMPONENT dev)

set(program ${CMAKE_INSTALL_BINDIR}/plumbline)
set(pipelines ${CMAKE_INSTALL_DATADIR}/plumbline/pipelines)
configure_package_config_file(cmake/plumblineConfig.cmake.in ${PROJECT_BINARY_DIR}/plumblineConfig.cmake
                              INSTALL_DESTINATION ${package_folder} PATH_VARS program pipelines NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/plumblineConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/plumblineConfig.cmake ${PROJECT_BINARY_DIR}/plumblineConfigVersion.cmake
        DESTINATION ${package_folder} COMPONENT dev)
