// SPDX-License-Identifier: BSD-3-Clause
// ScanNet's exported frames: color/0.jpg, depth/0.png, pose/0.txt, intrinsic/intrinsic_color.txt and
// intrinsic_depth.txt. Colour and depth differ in size and calibration; numbers have no zeros in
// front.
#include <fmt/format.h>

#include "layout.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

bool looks_like_scannet(const fs::path& folder) {
  return is_folder(folder / "color") && is_folder(folder / "depth") && is_folder(folder / "pose") &&
         is_file(folder / "intrinsic" / "intrinsic_color.txt");
}

geometry::Trajectory scannet_truth(const fs::path& folder, const Layout& layout, core::Log& log) {
  geometry::Trajectory truth;
  std::size_t left_out = 0;

  // Each colour image has a file with its pose
  for (const PairInfo& pair : layout.pairs) {
    const fs::path file = folder / "pose" / (layout.images->file(pair.color).stem().string() + ".txt");
    if (!is_file(file)) continue;
    if (const auto pose = read_pose_file(file.string())) {
      truth.push_back({pair.stamp, *pose});
    } else {
      ++left_out;
    }
  }

  // ScanNet marks lost poses as infinite
  if (left_out > 0) {
    log.warning(
        fmt::format("{}: {} of {} poses are not finite or no rigid motion, and are left out of the truth",
                    (folder / "pose").string(), left_out, left_out + truth.size()));
  }

  return truth;
}

core::Result<Layout> read_scannet(const fs::path& folder, const LayoutOptions& options, core::Log& log) {
  const auto color = numbered_images(folder / "color");
  const auto depth = numbered_images(folder / "depth");
  Layout layout = numbered_layout("scannet", color, depth, options.fps);
  if (layout.pairs.empty()) {
    return core::input_error(fmt::format("{}: no number is in both color/ ({} images) and depth/ ({})",
                                         folder.string(), color.size(), depth.size()));
  }

  // Images without a partner are reported
  const std::size_t unmatched = color.size() + depth.size() - 2 * layout.pairs.size();
  if (unmatched > 0)
    log.warning(fmt::format("{}: {} images have no partner and are skipped", folder.string(), unmatched));
  geometry::Trajectory truth = scannet_truth(folder, layout, log);
  if (!truth.empty()) layout.truth = std::move(truth);
  return layout;
}

}  // namespace

const LayoutFormat& scannet_layout() {
  static const LayoutFormat format = {"scannet",
                                      "ScanNet",
                                      "color/, depth/, pose/ and intrinsic/intrinsic_color.txt",
                                      {"color/", "depth/", "pose/", "intrinsic/intrinsic_color.txt"},
                                      &looks_like_scannet,
                                      &read_scannet};
  return format;
}

}  // namespace plumbline::dataset
