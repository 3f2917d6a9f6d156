// SPDX-License-Identifier: BSD-3-Clause
// TartanAir: image_left/000000_left.png, depth_left/000000_left_depth.npy in float metres, pose_left.txt with
// tx ty tz qx qy qz qw a row, north-east-down. All of it was rendered by one camera.
#include <fmt/format.h>

#include <cmath>

#include "layout.hpp"
#include "plumbline/core/numbers.hpp"
#include "text_lines.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

bool looks_like_tartanair(const fs::path& folder) {
  return is_folder(folder / "image_left") && is_folder(folder / "depth_left");
}

std::optional<geometry::Rigid3> ned_pose(const TextLine& line) {
  constexpr std::size_t kNumbers = 7;
  std::array<double, kNumbers> n{};
  if (line.words.size() != kNumbers) return std::nullopt;
  for (std::size_t i = 0; i < kNumbers; ++i) {
    const auto value = core::to_number(line.words[i]);
    if (!value || !std::isfinite(*value)) return std::nullopt;
    n[i] = *value;
  }

  // A rotation is a unit quaternion up to rounding
  const Eigen::Quaterniond q(n[6], n[3], n[4], n[5]);
  if (std::abs(q.norm() - 1.0) > 0.01) return std::nullopt;
  return geometry::Rigid3(q, {n[0], n[1], n[2]});
}

/// The world's z, which points down, turned up; the camera's axes (forward, right, down) turned into right,
/// down, forward.
geometry::Rigid3 from_ned(const geometry::Rigid3& pose) {
  const Eigen::Matrix3d world = Eigen::Vector3d(1, -1, -1).asDiagonal();
  Eigen::Matrix3d camera;
  camera << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return geometry::Rigid3(world, Eigen::Vector3d::Zero()) * pose *
         geometry::Rigid3(camera, Eigen::Vector3d::Zero());
}

/// Row n is the pose of image n.
geometry::Trajectory tartanair_truth(const fs::path& file, double fps, core::Log& log) {
  geometry::Trajectory truth;
  const auto lines = read_lines(file);
  if (!lines) return truth;
  std::size_t left_out = 0;
  for (std::size_t i = 0; i < lines->size(); ++i) {
    if (const auto pose = ned_pose((*lines)[i])) {
      truth.push_back({static_cast<double>(i) / fps, from_ned(*pose)});
    } else {
      ++left_out;
    }
  }
  if (left_out > 0) {
    log.warning(
        fmt::format("{}: {} of {} rows are not poses (tx ty tz qx qy qz qw) and are left out of the truth",
                    file.string(), left_out, lines->size()));
  }
  return truth;
}

/// Camera as the data set's authors publish it.
sensor::CameraReading tartanair_camera() {
  sensor::CameraReading reading;
  reading.program = "TartanAir, the same for all of it";
  reading.has_size = false;
  reading.camera.name = "tartanair";
  reading.camera.color = {640, 480, 320.0, 320.0, 320.0, 240.0};
  reading.camera.readout_s = 0.0;
  return reading;
}

core::Result<Layout> read_tartanair(const fs::path& folder, const LayoutOptions& options, core::Log& log) {
  const auto color = numbered_images(folder / "image_left");
  const auto depth = numbered_images(folder / "depth_left");
  Layout layout = numbered_layout("tartanair", color, depth, options.fps);
  if (layout.pairs.empty()) {
    return core::input_error(
        fmt::format("{}: no number is in both image_left/ ({} images) and depth_left/ ({})", folder.string(),
                    color.size(), depth.size()));
  }

  // The simulated camera is the same in all scenes
  layout.camera = tartanair_camera();
  geometry::Trajectory truth = tartanair_truth(folder / "pose_left.txt", options.fps, log);
  if (!truth.empty()) layout.truth = std::move(truth);
  return layout;
}

}  // namespace

const LayoutFormat& tartanair_layout() {
  static const LayoutFormat format = {"tartanair",
                                      "TartanAir",
                                      "image_left/ and depth_left/",
                                      {"image_left/", "depth_left/", "pose_left.txt"},
                                      &looks_like_tartanair,
                                      &read_tartanair};
  return format;
}

}  // namespace plumbline::dataset
