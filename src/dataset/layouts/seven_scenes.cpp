// SPDX-License-Identifier: BSD-3-Clause
// Microsoft 7-Scenes layout: frame-000000.color.png (or .jpg), .depth.png, .pose.txt.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "layout.hpp"

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

    // Images and pose share the frame's number
    const std::string rest = name.substr(dot);
    const std::string file = entry.path().string();
    if (rest == ".color.png" || rest == ".color.jpg" || rest == ".color.jpeg") {
      std::string& color = frames[*number].color;
      if (color.empty() || file < color) color = file;  // the same choice whatever the order of the folder
    }

    // Depth and pose have one file each
    if (rest == ".depth.png") frames[*number].depth = file;
    if (rest == ".pose.txt") frames[*number].pose = file;
  }
  return frames;
}

/// One name with a frame's number is enough.
bool looks_like_seven_scenes(const fs::path& folder) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (frame_number(name.substr(0, name.find('.')))) return true;
  }
  return false;
}

core::Result<Layout> read_seven_scenes(const fs::path& folder, const LayoutOptions& options, core::Log& log) {
  Layout layout{"7scenes"};
  const auto images = std::make_shared<FileImages>();
  geometry::Trajectory truth;
  std::size_t incomplete = 0;

  for (const auto& [number, files] : list_frames(folder)) {
    if (files.color.empty() || files.depth.empty()) {
      ++incomplete;
      continue;
    }

    // Frames have numbers instead of stamps.
    const double stamp = number / options.fps;
    layout.pairs.push_back({stamp, stamp, images->add(ImageList::kColor, files.color),
                            images->add(ImageList::kDepth, files.depth)});
    if (files.pose.empty()) continue;
    if (const auto pose = read_pose_file(files.pose)) truth.push_back({stamp, *pose});
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

  layout.images = images;
  if (!truth.empty()) layout.truth = std::move(truth);
  return layout;
}

}  // namespace

const LayoutFormat& seven_scenes_layout() {
  static const LayoutFormat format = {
      "7scenes",
      "7-Scenes",
      "frame-000000.color.png",
      {"frame-000000.color.png|frame-000000.color.jpg", "frame-000000.depth.png"},
      &looks_like_seven_scenes,
      &read_seven_scenes};
  return format;
}

}  // namespace plumbline::dataset
