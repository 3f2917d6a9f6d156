// SPDX-License-Identifier: BSD-3-Clause
#include "io/cloud_table.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "finite.hpp"
#include "io/scalar.hpp"
#include "io/shift.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::cloud {
namespace {

// A point without position and normal; white if the file has no colours.
Point blank_point(bool color) {
  Point p;
  p.x = p.y = p.z = kNan;
  p.normal_x = p.normal_y = p.normal_z = kNan;
  p.r = p.g = p.b = color ? std::uint8_t{0} : std::uint8_t{255};
  p.a = 255;
  return p;
}

/// Axis (0 to 2) of a meaning; `x` is the meaning of the first axis (kX or kNormalX).
int axis_of(Meaning meaning, Meaning x) { return static_cast<int>(meaning) - static_cast<int>(x); }

bool holds(const std::vector<Meaning>& meanings, std::initializer_list<Meaning> wanted) {
  return std::all_of(wanted.begin(), wanted.end(), [&meanings](Meaning m) {
    return std::find(meanings.begin(), meanings.end(), m) != meanings.end();
  });
}

}  // namespace

Meaning meaning_of(const std::string& name) {
  static const std::array<std::pair<const char*, Meaning>, 30> kNames = {{
      {"x", Meaning::kX},
      {"y", Meaning::kY},
      {"z", Meaning::kZ},
      {"px", Meaning::kX},
      {"py", Meaning::kY},
      {"pz", Meaning::kZ},
      {"nx", Meaning::kNormalX},
      {"ny", Meaning::kNormalY},
      {"nz", Meaning::kNormalZ},
      {"normal_x", Meaning::kNormalX},
      {"normal_y", Meaning::kNormalY},
      {"normal_z", Meaning::kNormalZ},
      {"normalx", Meaning::kNormalX},
      {"normaly", Meaning::kNormalY},
      {"normalz", Meaning::kNormalZ},
      {"r", Meaning::kRed},
      {"g", Meaning::kGreen},
      {"b", Meaning::kBlue},
      {"red", Meaning::kRed},
      {"green", Meaning::kGreen},
      {"blue", Meaning::kBlue},
      {"diffuse_red", Meaning::kRed},
      {"diffuse_green", Meaning::kGreen},
      {"diffuse_blue", Meaning::kBlue},
      {"rgb", Meaning::kPackedColor},
      {"rgba", Meaning::kPackedColor},
      {"curvature", Meaning::kCurvature},
      {"confidence", Meaning::kConfidence},
      {"observations", Meaning::kObservations},
      {"robot", Meaning::kRobot},
  }};

  // Names regardless of case
  const std::string lower = core::lower(name);
  for (const auto& [known, meaning] : kNames) {
    if (lower == known) return meaning;
  }

  // Other columns keep names that can be written again
  const bool writable = !lower.empty() && lower.size() <= 64 && lower != "_" && lower != "alpha" &&
                        lower != "a" && std::all_of(lower.begin(), lower.end(), [](unsigned char c) {
                          return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
                        });
  return writable ? Meaning::kOther : Meaning::kNone;
}

CloudBuilder::CloudBuilder(const std::vector<Meaning>& meanings, const std::vector<std::string>& names,
                           std::size_t points)
    : others_(meanings.size(), nullptr) {
  // A vector counts only if all of its columns exist
  position_ = holds(meanings, {Meaning::kX, Meaning::kY, Meaning::kZ});
  file_.has_normals = holds(meanings, {Meaning::kNormalX, Meaning::kNormalY, Meaning::kNormalZ});
  file_.has_color = holds(meanings, {Meaning::kPackedColor}) ||
                    holds(meanings, {Meaning::kRed, Meaning::kGreen, Meaning::kBlue});
  file_.cloud = std::make_shared<Cloud>();
  if (!position_) return;

  // Columns with a meaning
  file_.cloud->points.assign(points, blank_point(file_.has_color));
  if (holds(meanings, {Meaning::kConfidence})) file_.columns.confidence.resize(points);
  if (holds(meanings, {Meaning::kObservations})) file_.columns.observations.resize(points);
  if (holds(meanings, {Meaning::kRobot})) file_.columns.robot.resize(points);

  // Further columns, each name once
  for (std::size_t c = 0; c < meanings.size(); ++c) {
    if (meanings[c] != Meaning::kOther) continue;
    auto& others = file_.columns.others;
    const bool twice =
        std::any_of(others.begin(), others.end(), [&](const auto& o) { return o.name == names[c]; });
    if (twice) continue;
    others.push_back({names[c], std::vector<float>(points)});
    others_[c] = others.back().values.data();  // moving the vector leaves its memory in place
  }

  shape(static_cast<std::uint32_t>(points), 1);
}

void CloudBuilder::set(std::size_t row, Meaning meaning, std::size_t column, double value) {
  Point& p = file_.cloud->points[row];
  const auto number = static_cast<float>(value);

  switch (meaning) {
    case Meaning::kX:
    case Meaning::kY:
    case Meaning::kZ:
      if (auto& wide = wide_[static_cast<std::size_t>(axis_of(meaning, Meaning::kX))]; !wide.empty()) {
        wide[row] = value;
      } else {
        p.data[axis_of(meaning, Meaning::kX)] = number;
      }
      break;

    case Meaning::kNormalX:
    case Meaning::kNormalY:
    case Meaning::kNormalZ:
      p.data_n[axis_of(meaning, Meaning::kNormalX)] = number;
      break;
    case Meaning::kRed:
    case Meaning::kGreen:
    case Meaning::kBlue:
      (meaning == Meaning::kRed ? p.r : meaning == Meaning::kGreen ? p.g : p.b) = to_byte(value);
      break;

    case Meaning::kCurvature:
      p.curvature = number;
      break;
    case Meaning::kConfidence:
      file_.columns.confidence[row] = number;
      break;
    case Meaning::kObservations:
      file_.columns.observations[row] =
          value > 0.0 ? static_cast<std::uint32_t>(std::min(value, 4294967295.0)) : 0U;
      break;

    case Meaning::kRobot:
      file_.columns.robot[row] = to_byte(value);
      break;
    case Meaning::kOther:
      if (others_[column] != nullptr) others_[column][row] = number;
      break;
    case Meaning::kPackedColor:
    case Meaning::kNone:
      break;
  }
}

void CloudBuilder::keep_digits(Meaning axis) {
  if (const auto k = axis_of_column(axis); k && position_)
    wide_[static_cast<std::size_t>(*k)].resize(file_.cloud->size(), static_cast<double>(kNan));
}

void CloudBuilder::take_shift() {
  for (int k = 0; k < 3; ++k) {
    const std::vector<double>& wide = wide_[static_cast<std::size_t>(k)];
    if (wide.empty()) continue;

    // The differences fit floats
    file_.shift[k] = axis_shift(wide);
    for (std::size_t i = 0; i < wide.size(); ++i)
      file_.cloud->points[i].data[k] = static_cast<float>(wide[i] - file_.shift[k]);
  }
}

void CloudBuilder::set_packed_color(std::size_t row, std::uint32_t bits) {
  Point& p = file_.cloud->points[row];
  p.r = static_cast<std::uint8_t>(bits >> 16 & 255U);
  p.g = static_cast<std::uint8_t>(bits >> 8 & 255U);
  p.b = static_cast<std::uint8_t>(bits & 255U);
}

void CloudBuilder::shape(std::uint32_t width, std::uint32_t height) {
  file_.cloud->width = width;
  file_.cloud->height = height;
}

CloudFile CloudBuilder::finish() {
  take_shift();
  for (Point& p : file_.cloud->points) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) ++file_.nan_points;
    if (!file_.has_normals) continue;

    // Normals without direction become NaN
    const float squared = p.normal_x * p.normal_x + p.normal_y * p.normal_y + p.normal_z * p.normal_z;
    if (std::isfinite(squared) && squared > 0.0F) continue;
    p.normal_x = p.normal_y = p.normal_z = kNan;
    ++file_.nan_normals;
  }
  file_.cloud->is_dense = file_.nan_points == 0;
  return std::move(file_);
}

}  // namespace plumbline::cloud
