// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Camera files of any program: our own camera.yaml, ORB-SLAM, ROS, Open3D, COLMAP, Kalibr, RealSense,
// Replica, ScanNet, and plain numbers.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::sensor {

/// Content of a camera file.
struct CameraReading {
  Camera camera;
  std::string program;             ///< program that the format is from; "" is our own
  bool has_size = true;            ///< else color.width and color.height are 0: taken from the images
  bool has_depth_scale = true;     ///< else depth_scale is only a default: taken from the layout
  std::vector<std::string> notes;  ///< decisions and conversions while reading, one phrase each
};

/// Reads a camera file of any known program, recognised by its content. Pixel coordinates are ours: (0, 0) is
/// the centre of the top-left pixel. Errors (kUsage): a file of no known kind; a model beyond OpenCV's k1 k2
/// p1 p2 k3; numbers that are missing or make no camera. They name file, place, program and the lines to
/// write in a camera.yaml instead.
core::Result<CameraReading> read_camera_file(const std::filesystem::path& file);

/// `name_or_file`: a shipped calibration (a file of `cameras_folder` without .yaml) or a camera file of any
/// program.
core::Result<CameraReading> find_camera(const std::string& name_or_file,
                                        const std::filesystem::path& cameras_folder);

/// True if the file has the form of another program's camera file; a file of plain numbers, which could be
/// anything, only counts with `numbers_too`. False if it cannot be read.
bool is_foreign_camera_file(const std::filesystem::path& file, bool numbers_too);

/// Problem with the camera's numbers for images of its size; "" if there is none.
std::string camera_problem(const Camera& camera);

/// Lines of a camera.yaml with the known values of `camera`, and blanks to fill in where they are 0.
std::string camera_lines(const Camera& camera);

}  // namespace plumbline::sensor
