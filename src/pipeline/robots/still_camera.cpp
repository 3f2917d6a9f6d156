// SPDX-License-Identifier: BSD-3-Clause
#include "robots/still_camera.hpp"

#include <algorithm>
#include <cmath>

#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::pipeline {
namespace {

constexpr double kMoved_m = 0.01;
constexpr double kTurned_rad = 0.005;
constexpr int kCell_px = 16;
constexpr int kChangedCells = 4;  ///< cells of the image whose depth differs where something has moved

/// The nearest depth of each cell of the image; 0: nothing was measured there.
std::vector<float> nearest_depths(const cv::Mat& depth) {
  const int columns = (depth.cols + kCell_px - 1) / kCell_px;
  const int rows = (depth.rows + kCell_px - 1) / kCell_px;
  std::vector<float> nearest(static_cast<std::size_t>(columns * rows), 0.0F);

  for (int v = 0; v < depth.rows; ++v) {
    const float* row = depth.ptr<float>(v);
    for (int u = 0; u < depth.cols; ++u) {
      float& cell = nearest[static_cast<std::size_t>(v / kCell_px * columns + u / kCell_px)];
      if (row[u] > 0.0F && (cell == 0.0F || row[u] < cell)) cell = row[u];
    }
  }
  return nearest;
}

/// True if more cells changed than noise explains. The nearest of 256 pixels scatters by some standard
/// deviations.
bool scene_changed(const std::vector<float>& before, const std::vector<float>& now) {
  if (before.size() != now.size()) return true;
  int changed = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i] == 0.0F || before[i] == 0.0F) continue;
    const double noise = sensor::depth_sigma(std::max(before[i], now[i]));
    if (std::abs(static_cast<double>(now[i] - before[i])) > 0.05 + 6.0 * noise) ++changed;
  }
  return changed >= kChangedCells;
}

}  // namespace

bool StillCamera::stands_still(const geometry::Rigid3& camera_from_world, const cv::Mat& depth) {
  std::vector<float> nearest = nearest_depths(depth);
  const geometry::Vector6d moved = geometry::log_se3(camera_from_world * camera_from_world_.inverse());
  const bool same = frames_ > 0 && moved.head<3>().norm() < kMoved_m &&
                    moved.tail<3>().norm() < kTurned_rad && !scene_changed(nearest_, nearest);
  if (same) return ++frames_ > kFrames;

  camera_from_world_ = camera_from_world;
  nearest_ = std::move(nearest);
  frames_ = 1;
  return false;
}

}  // namespace plumbline::pipeline
