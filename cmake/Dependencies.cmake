# SPDX-License-Identifier: BSD-3-Clause
# Everything comes from Debian's packages; scripts/install-deps lists them.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc imgcodecs features2d calib3d flann ximgproc line_descriptor video)
find_package(Ceres 2.1 REQUIRED)
find_package(TBB REQUIRED)
find_package(yaml-cpp 0.7 REQUIRED)
find_package(CLI11 2.1 REQUIRED)
find_package(spdlog 1.10 REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(embree 3 REQUIRED)
find_package(tsl-robin-map REQUIRED)

# PCL's own package file drags VTK into every target that links pcl_io; link the libraries by name instead,
# so that only viz/ sees VTK.
find_package(PkgConfig REQUIRED)
find_path(PCL_INCLUDE pcl/point_types.h PATH_SUFFIXES pcl-1.15 pcl-1.14 pcl-1.13 pcl-1.12 REQUIRED)
find_package(Boost REQUIRED)
# Libraries that `plumbline --version` tells; the modules that find others add them.
file(STRINGS ${PCL_INCLUDE}/pcl/pcl_config.h pcl_version REGEX "define PCL_VERSION_PRETTY")
string(REGEX MATCH "[0-9.]+[0-9]" pcl_version "${pcl_version}")
set_property(GLOBAL PROPERTY plumbline_libraries "PCL ${pcl_version}" "Ceres ${Ceres_VERSION}" "OpenCV ${OpenCV_VERSION}")
add_library(plumbline_pcl INTERFACE)
target_include_directories(plumbline_pcl SYSTEM INTERFACE ${PCL_INCLUDE})
# Those that need others come first: a linker that leaves out what is not needed would keep too many otherwise.
foreach(component registration surface segmentation io features filters sample_consensus search kdtree octree common)
  find_library(PCL_${component}_LIBRARY pcl_${component} REQUIRED)
  target_link_libraries(plumbline_pcl INTERFACE ${PCL_${component}_LIBRARY})
endforeach()
target_link_libraries(plumbline_pcl INTERFACE Eigen3::Eigen Boost::headers)
