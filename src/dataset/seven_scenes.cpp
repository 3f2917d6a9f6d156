// SPDX-License-Identifier: BSD-3-Clause
// Microsoft 7-Scenes layout: frame-000000.color.png (or .jpg), .depth.png, .pose.txt.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "layout.hpp"
#include "plumbline/core/numbers.hpp"
#include "text_lines.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

struct FrameFiles {
  std::string color;
  std::string depth;
  std::string pose;
};

/// Number of "frame-000123" or none.
std::optional<int> frame_number(const std::string& stem) {
  constexpr std::size_t prefix = 6;
  if (stem.compare(0, prefix, "frame-") != 0 || stem.size() == prefix || stem.size() > prefix + 9) {
    return std::nullopt;
  }
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  if (!std::all_of(stem.begin() + prefix, stem.end(), digit)) return std::nullopt;
  return std::stoi(stem.substr(prefix));
}

std::map<int, FrameFiles> list_frames(const fs::path& folder) {
  std::map<int, FrameFiles> frames;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    const std::size_t dot = name.find('.');
    const std::optional<int> number = frame_number(name.substr(0, dot));
    if (!number || dot == std::string::npos) continue;
    const std::string rest = name.substr(dot);
    const std::string file = entry.path().string();
    if (rest == ".color.png" || rest == ".color.jpg" || rest == ".color.jpeg") {
      std::string& color = frames[*number].color;
      if (color.empty() || file < color) color = file;  // the same choice whatever the order of the folder
    }
    if (rest == ".depth.png") frames[*number].depth = file;
    if (rest == ".pose.txt") frames[*number].pose = file;
  }
  return frames;
}

/// 4x4 world_from_camera; none where tracking was lost (7-Scenes writes NaN or infinity) or the file is
/// unusable.
std::optional<geometry::Rigid3> read_pose(const std::string& file) {
  const auto lines = read_lines(file);
  if (!lines || lines->size() != 4) return std::nullopt;
  Eigen::Matrix4d matrix;
  for (std::size_t r = 0; r < 4; ++r) {
    const std::vector<std::string>& words = (*lines)[r].words;
    if (words.size() != 4) return std::nullopt;
    for (std::size_t c = 0; c < 4; ++c) {
      const std::optional<double> value = core::to_number(words[c]);
      if (!value || !std::isfinite(*value)) return std::nullopt;
      matrix(static_cast<int>(r), static_cast<int>(c)) = *value;
    }
  }
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  if ((rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > 0.01) {
    return std::nullopt;
  }
  return geometry::Rigid3(Eigen::Quaterniond(rotation), matrix.topRightCorner<3, 1>());
}

}  // namespace

bool looks_like_seven_scenes(const fs::path& folder) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (frame_number(name.substr(0, name.find('.')))) return true;
  }
  return false;
}

core::Result<Layout> read_seven_scenes(const fs::path& folder, const LayoutOptions& options, core::Log& log) {
  Layout layout{"7scenes", {}, std::nullopt};
  geometry::Trajectory truth;
  std::size_t incomplete = 0;
  for (const auto& [number, files] : list_frames(folder)) {
    if (files.color.empty() || files.depth.empty()) {
      ++incomplete;
      continue;
    }
    const double stamp = number / options.fps;
    layout.pairs.push_back({stamp, stamp, files.color, files.depth});
    if (files.pose.empty()) continue;
    if (const auto pose = read_pose(files.pose)) truth.push_back({stamp, *pose});
  }
  if (layout.pairs.empty()) {
    return core::input_error(
        fmt::format("{}: no frame with both colour and depth (looked for frame-000000.color.png or .jpg and "
                    "frame-000000.depth.png)",
                    folder.string()));
  }
  if (incomplete > 0) {
    log.warning(
        fmt::format("{}: {} frames lack colour or depth and are skipped", folder.string(), incomplete));
  }
  if (!truth.empty()) layout.truth = std::move(truth);
  return layout;
}

}  // namespace plumbline::dataset
