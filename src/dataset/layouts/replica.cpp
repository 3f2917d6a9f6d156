// SPDX-License-Identifier: BSD-3-Clause
// Replica as NICE-SLAM renders it: results/frame000000.jpg and results/depth000000.png, traj.txt with 16
// numbers per frame; cam_params.json there or one level up is found by the camera's search.
#include <fmt/format.h>

#include "layout.hpp"
#include "plumbline/dataset/trajectory_io.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

bool looks_like_replica(const fs::path& folder) {
  return is_folder(folder / "results") && !numbered_images(folder / "results", "frame").empty();
}

/// Row n of traj.txt is the pose of frame n.
std::optional<geometry::Trajectory> replica_truth(const fs::path& file, double fps, core::Log& log) {
  if (!is_file(file)) return std::nullopt;
  auto reading = read_trajectory_file(file);
  if (!reading) {
    log.warning(reading.error().message + "; the recording is used without truth");
    return std::nullopt;
  }
  for (const std::string& note : reading->notes) log.warning(fmt::format("{}: {}", file.string(), note));
  if (!reading->stamped) {
    for (geometry::StampedPose& pose : reading->poses) pose.stamp /= fps;
  }
  return std::move(reading->poses);
}

core::Result<Layout> read_replica(const fs::path& folder, const LayoutOptions& options, core::Log& log) {
  const auto color = numbered_images(folder / "results", "frame");
  const auto depth = numbered_images(folder / "results", "depth");
  Layout layout = numbered_layout("replica", color, depth, options.fps);
  if (layout.pairs.empty()) {
    return core::input_error(
        fmt::format("{}: no number is in both names, frame000000.jpg ({} of these) and depth000000.png ({})",
                    (folder / "results").string(), color.size(), depth.size()));
  }

  // Rows of the truth are numbered like images
  layout.truth = replica_truth(folder / "traj.txt", options.fps, log);
  return layout;
}

}  // namespace

const LayoutFormat& replica_layout() {
  static const LayoutFormat format = {"replica",
                                      "Replica, NICE-SLAM",
                                      "results/frame000000.jpg and results/depth000000.png",
                                      {"results/", "traj.txt"},
                                      &looks_like_replica,
                                      &read_replica};
  return format;
}

}  // namespace plumbline::dataset
