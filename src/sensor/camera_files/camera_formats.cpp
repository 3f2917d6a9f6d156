// SPDX-License-Identifier: BSD-3-Clause
// Helpers shared by the readers of other programs' camera files.
#include "camera_files/camera_formats.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plumbline/core/numbers.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::sensor {
namespace {

using core::ConfigNode;

/// Numbers of nested lists and of OpenCV's matrices, in order.
bool add_numbers(const ConfigNode& node, std::vector<double>& numbers) {
  if (node.kind == ConfigNode::Kind::kNull) return true;
  if (node.kind == ConfigNode::Kind::kSequence) {
    return std::all_of(node.items.begin(), node.items.end(),
                       [&](const ConfigNode& item) { return add_numbers(item, numbers); });
  }
  if (node.kind == ConfigNode::Kind::kMap) {
    const ConfigNode* data = find_any(node, {"data"});
    return data != nullptr && add_numbers(*data, numbers);
  }
  const auto number = finite_number(node);
  if (number) numbers.push_back(*number);
  return number.has_value();
}

}  // namespace

const std::vector<const CameraFormat*>& camera_formats() {
  static const std::vector<const CameraFormat*> formats = {
      &kOrbSlamCamera, &kRosCamera,     &kKalibrCamera, &kOpen3dCamera, &kRealSenseCamera,
      &kReplicaCamera, &kScanNetCamera, &kColmapCamera, &kPlainCamera,
  };
  return formats;
}

/// No size and no depth scale yet.
CameraReading blank_reading(const CameraText& text, const CameraFormat& format) {
  CameraReading reading;
  reading.program = format.program;
  reading.has_size = false;
  reading.has_depth_scale = false;
  reading.camera.name = std::filesystem::path(text.file).stem().string();
  return reading;
}

/// An error with the lines of a camera.yaml that are known.
tl::unexpected<core::Error> refuse_camera(const CameraText& text, const CameraFormat& format,
                                          const core::ConfigMark& mark, const std::string& what,
                                          const Camera& known) {
  const std::string place = mark.line > 0 ? fmt::format(":{}:{}", mark.line, mark.column) : "";
  const std::string problem =
      fmt::format("{}{}: camera file of {}: {}", text.file, place, format.program, what);
  return tl::unexpected<core::Error>({core::ErrorKind::kUsage,
                                      fmt::format("{}; write a camera.yaml with these lines:\n{}",
                                                  core::printable(problem), camera_lines(known)),
                                      true});
}

/// The first of these keys that the map has, in any case of letters.
const ConfigNode* find_any(const ConfigNode& map, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    for (const auto& [key, value] : map.entries) {
      if (core::lower(key) == name) return &value;
    }
  }
  return nullptr;
}

std::optional<double> finite_number(const ConfigNode& node) {
  if (node.kind != ConfigNode::Kind::kScalar) return std::nullopt;
  const auto value = core::to_number(node.scalar);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<double> number_at(const ConfigNode& map, const std::vector<std::string>& names) {
  const ConfigNode* node = find_any(map, names);
  return node == nullptr ? std::nullopt : finite_number(*node);
}

std::string word_at(const ConfigNode& map, const std::vector<std::string>& names) {
  const ConfigNode* node = find_any(map, names);
  return node == nullptr ? "" : core::lower(node->scalar);
}

std::optional<std::vector<double>> numbers_in(const ConfigNode& node) {
  std::vector<double> numbers;
  if (!add_numbers(node, numbers)) return std::nullopt;
  return numbers;
}

std::string take_matrix(const std::vector<double>& numbers, Camera& camera) {
  // Square, or with a column for the translation
  const std::size_t columns = numbers.size() == 9 ? 3 : 4;
  if (numbers.size() != 9 && numbers.size() != 12 && numbers.size() != 16) {
    return fmt::format("the matrix has {} numbers (allowed: 3x3, 3x4 or 4x4)", numbers.size());
  }

  // Some writers store columns, not rows
  const auto at = [&](std::size_t row, std::size_t column) { return numbers[row * columns + column]; };
  const bool square = numbers.size() != 12;
  const bool by_columns =
      square && at(0, 2) == 0.0 && at(1, 2) == 0.0 && (at(2, 0) != 0.0 || at(2, 1) != 0.0);
  const double skew = by_columns ? at(1, 0) : at(0, 1);
  const double other = by_columns ? at(0, 1) : at(1, 0);

  // Last row and lower triangle of a pinhole matrix
  camera.color.fx = at(0, 0);
  camera.color.fy = at(1, 1);
  camera.color.cx = by_columns ? at(2, 0) : at(0, 2);
  camera.color.cy = by_columns ? at(2, 1) : at(1, 2);
  if (at(2, 2) != 1.0 || other != 0.0)
    return "the matrix is not that of a camera (expected: fx 0 cx, 0 fy cy, 0 0 1)";

  // No camera here has skewed pixels
  if (std::abs(skew) > 1e-6 * std::abs(at(0, 0))) {
    return fmt::format("the matrix has a skew of {}, which no camera here has", skew);
  }
  return "";
}

std::string take_coefficients(const std::string& model, const std::vector<double>& numbers, Lens& lens) {
  // Models that OpenCV's two do not cover
  const auto names = [&](std::initializer_list<const char*> words) {
    return std::any_of(words.begin(), words.end(),
                       [&](const char* word) { return model.find(word) != std::string::npos; });
  };

  // Undistorted images work with any lens
  if (names({"ftheta", "fov", "omni", "eucm", "double_sphere", "thin_prism", "mei", "ds-"})) {
    return fmt::format(
        "the model '{}' is not supported (OpenCV's with k1 k2 p1 p2 k3 [k4 k5 k6] and the equidistant one of "
        "fisheye lenses are); undistort the images first",
        model);
  }

  // Further coefficients may only be zero
  const bool fisheye = names({"equidistant", "fisheye", "kannala", "kb4"});
  const std::size_t known = fisheye ? 4 : lens.k.size();

  const bool more =
      numbers.size() > known && std::any_of(numbers.begin() + static_cast<std::ptrdiff_t>(known),
                                            numbers.end(), [](double k) { return k != 0.0; });
  if (more) {
    return fmt::format(
        "the model{} has {} coefficients; {} are supported: calibrate with those, or undistort "
        "the images first",
        model.empty() ? "" : " '" + model + "'", numbers.size(),
        fisheye ? "k1 k2 k3 k4" : "k1 k2 p1 p2 k3 k4 k5 k6");
  }

  // Missing coefficients are zero
  lens.model = fisheye ? LensModel::kEquidistant : LensModel::kRadialTangential;
  std::copy_n(numbers.begin(), std::min(known, numbers.size()), lens.k.begin());
  return "";
}

std::string take_coefficients(const std::string& model, const std::vector<double>& numbers, Camera& camera) {
  Lens lens;
  std::string wrong = take_coefficients(model, numbers, lens);
  camera.model = lens.model;
  camera.distortion = lens.k;
  return wrong;
}

/// Focal lengths and principal point must exist, the size may.
std::string take_pinhole(const ConfigNode& map, Pinhole& pinhole) {
  const auto take = [&](const std::vector<std::string>& names, double& value) {
    const auto number = number_at(map, names);
    if (number) value = *number;
    return number.has_value();
  };
  std::string missing;
  if (!take({"fx"}, pinhole.fx)) missing += " fx";
  if (!take({"fy"}, pinhole.fy)) missing += " fy";
  if (!take({"cx", "ppx"}, pinhole.cx)) missing += " cx";
  if (!take({"cy", "ppy"}, pinhole.cy)) missing += " cy";
  double width = 0.0;
  double height = 0.0;
  take({"width", "w", "image_width"}, width);
  take({"height", "h", "image_height"}, height);
  pinhole.width = static_cast<int>(std::clamp(width, 0.0, 1e6));
  pinhole.height = static_cast<int>(std::clamp(height, 0.0, 1e6));
  return missing.empty() ? "" : "no number for" + missing;
}

double units_per_metre(double scale) {
  if (!(scale > 0.0) || scale >= 1.0) return scale;
  const double units = 1.0 / scale;
  const double whole = std::round(units);
  return std::abs(units - whole) < 1e-3 * whole ? whole : units;  // 0.0010000000474974513 is a float's 0.001
}

}  // namespace plumbline::sensor
