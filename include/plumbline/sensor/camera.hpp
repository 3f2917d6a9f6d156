// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Calibration of an RGB-D camera.
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/lens.hpp"

namespace plumbline::sensor {

/// Pinhole intrinsics, pixels. Pixel (0, 0) is the centre of the top-left pixel. x right, y down, z forward.
struct Pinhole {
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;

  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& p) const {
    return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy};
  }
  /// Point on the pixel's ray at depth z metres.
  [[nodiscard]] Eigen::Vector3d unproject(double u, double v, double z) const {
    return {(u - cx) / fx * z, (v - cy) / fy * z, z};
  }
  [[nodiscard]] bool contains(const Eigen::Vector2d& pixel, double border = 0.0) const {
    return pixel.x() >= border && pixel.y() >= border && pixel.x() <= width - 1 - border &&
           pixel.y() <= height - 1 - border;
  }
  /// Pinhole of the image resized to that many pixels; the middle of pixel (0, 0) is at (0, 0).
  [[nodiscard]] Pinhole resized(int to_width, int to_height) const {
    const double sx = static_cast<double>(to_width) / width;
    const double sy = static_cast<double>(to_height) / height;
    return {to_width, to_height, fx * sx, fy * sy, (cx + 0.5) * sx - 0.5, (cy + 0.5) * sy - 0.5};
  }
};

/// Standard deviations of a camera's numbers, as its file states them; 0: not stated.
struct CameraSigma {
  double fx = 0.0;             ///< px, of fx; fy's is in proportion
  double centre = 0.0;         ///< px, of cx and of cy
  double distortion = 0.0;     ///< of k1 and of k2
  double readout_s = 0.0;      ///< seconds
  double depth_slope = 0.0;    ///< 1/m
  double depth_delay_s = 0.0;  ///< seconds
};

struct Camera {
  std::string name;
  Pinhole color;
  LensModel model = LensModel::kRadialTangential;  ///< model of the colour image's lens
  Distortion distortion{};                         ///< coefficients of the colour image; all 0 = none
  double depth_scale = 5000.0;                     ///< raw units per metre
  double fps = 30.0;
  /// Rolling shutter: from the first row of a colour image to the last, seconds; 0: all rows at once.
  std::optional<double> readout_s;  ///< none: not known
  /// Pose of the depth camera, if depth is not registered to colour: the reader then registers it.
  std::optional<geometry::Rigid3> color_from_depth;
  std::optional<Pinhole> depth;  ///< intrinsics of the depth image when color_from_depth is present
  Lens depth_lens;               ///< lens of the depth image when color_from_depth is present
  /// Error of depth across the image, 1/m: 1 / z = 1 / z_measured + depth_slope . (x, y) along the ray (x, y,
  /// 1) of the undistorted colour camera. It describes a depth camera whose axis is not where its maker
  /// thinks.
  std::array<double, 2> depth_slope{};
  double depth_delay_s = 0.0;  ///< delay of depth images after their stamps
  CameraSigma sigma;
  bool guess = false;  ///< typical values, not read from a file

  [[nodiscard]] Lens lens() const { return {model, distortion}; }
  [[nodiscard]] bool distorted() const { return lens().distorts(); }
};

/// Reads our own camera file (camera.yaml: model width height fx fy cx cy distortion depth_scale fps readout
/// depth_slope depth_delay [color_from_depth, depth: {width height fx fy cx cy model distortion}] [sigma: {fx
/// centre distortion readout depth_slope depth_delay}]). All
/// problems are reported together with file:line:column (kUsage).
core::Result<Camera> read_camera(const std::filesystem::path& file);
/// The same of the file's text; `file_name` is for messages.
core::Result<Camera> parse_camera(const std::string& text, const std::string& file_name);

/// The same calibration as camera.yaml text; read_camera(write) gives the same camera.
std::string to_yaml(const Camera& camera);

}  // namespace plumbline::sensor
