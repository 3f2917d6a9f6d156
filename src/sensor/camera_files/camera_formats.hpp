// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Camera files of other programs: one source for each kind, and the table of all in camera_formats.cpp.
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/config.hpp"
#include "plumbline/sensor/camera_file.hpp"

namespace plumbline::sensor {

/// A camera file as text, as a tree if it is YAML or JSON, and as numbers if it holds nothing else.
struct CameraText {
  std::string file;  ///< for messages
  std::string text;
  core::ConfigNode tree;  ///< kNull when the file is neither YAML nor JSON
  core::ConfigProblems problems;

  [[nodiscard]] bool is_map() const { return tree.kind == core::ConfigNode::Kind::kMap; }
};

struct CameraFormat {
  const char* program;
  bool structured;  ///< recognised by its keys, so that it is found among other files
  bool (*recognises)(const CameraText& text);
  /// Reads the file. If it does not have them, the size is 0 and has_size, or has_depth_scale, is false.
  core::Result<CameraReading> (*read)(const CameraText& text);
};

extern const CameraFormat kOrbSlamCamera;
extern const CameraFormat kRosCamera;
extern const CameraFormat kKalibrCamera;
extern const CameraFormat kOpen3dCamera;
extern const CameraFormat kRealSenseCamera;
extern const CameraFormat kReplicaCamera;
extern const CameraFormat kScanNetCamera;
extern const CameraFormat kColmapCamera;
extern const CameraFormat kPlainCamera;

/// All formats, in the order in which they are tried.
const std::vector<const CameraFormat*>& camera_formats();

/// A reading that knows nothing yet.
CameraReading blank_reading(const CameraText& text, const CameraFormat& format);

/// Error (kUsage): position, program, what is wrong, and the lines to write, with all known values filled in.
tl::unexpected<core::Error> refuse_camera(const CameraText& text, const CameraFormat& format,
                                          const core::ConfigMark& mark, const std::string& what,
                                          const Camera& known = {});

/// The entry under any of these names, whatever their case; null when there is none.
const core::ConfigNode* find_any(const core::ConfigNode& map, const std::vector<std::string>& names);
/// The number there; none if there is no such entry, or it is not a finite number.
std::optional<double> number_at(const core::ConfigNode& map, const std::vector<std::string>& names);
std::optional<double> finite_number(const core::ConfigNode& node);
/// The text there, in lower case; "" when there is none.
std::string word_at(const core::ConfigNode& map, const std::vector<std::string>& names);
/// All numbers of nested lists or of a matrix's `data`, in order; none when something else is among them.
std::optional<std::vector<double>> numbers_in(const core::ConfigNode& node);

/// Puts fx fy cx cy of a 3x3, 3x4 or 4x4 matrix, row by row or column by column, into the camera. Returns ""
/// or what is wrong.
std::string take_matrix(const std::vector<double>& numbers, Camera& camera);
/// Puts OpenCV's coefficients, k1 k2 p1 p2 [k3 [k4 k5 k6]], or k1 k2 k3 k4 of a fisheye, into the lens of the
/// colour image. `model` is its name in the file, in lower case, or "". Returns "" or why images cannot be
/// rectified by that model.
std::string take_coefficients(const std::string& model, const std::vector<double>& numbers, Lens& lens);
std::string take_coefficients(const std::string& model, const std::vector<double>& numbers, Camera& camera);
/// Puts fx, fy, cx, cy, and a size if it is there, into the camera; the names are those of ConfigNode
/// entries. Returns "" or which is missing.
std::string take_pinhole(const core::ConfigNode& map, Pinhole& pinhole);
/// Raw units per metre from metres per unit, where the number is below 1.
double units_per_metre(double scale);

}  // namespace plumbline::sensor
