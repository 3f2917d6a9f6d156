// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viz/turntable.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "plumbline/core/numbers.hpp"
#include "plumbline/core/output_file.hpp"
#include "scene/view_frame.hpp"

namespace plumbline::viz {
namespace {

constexpr double kPitch = 35.0 * M_PI / 180.0;
constexpr double kFieldOfView_deg = 28.0;

/// Centre and radius of the visible scene, a few outliers left out.
struct SceneExtent {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius_m = 1.0;
};

SceneExtent extent_of(const Scene& scene) {
  constexpr std::size_t kSample = 100000;
  std::vector<Eigen::Vector3d> points;

  // A sample suffices for the extent.
  if (scene.cloud != nullptr) {
    const std::size_t step = std::max<std::size_t>(1, scene.cloud->size() / kSample);
    for (std::size_t i = 0; i < scene.cloud->size(); i += step) {
      const Eigen::Vector3d p = (*scene.cloud)[i].getVector3fMap().cast<double>();
      if (p.allFinite()) points.push_back(p);
    }
    points = evened(points);
  }

  // The whole path must be visible.
  for (const CameraPath& path : scene.paths) {
    for (const auto& pose : path.trajectory) points.push_back(pose.world_from_camera.translation);
  }

  SceneExtent extent;
  if (points.empty()) return extent;

  // Quantiles, for outliers must not shift the centre.
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(points.size());
    for (const auto& p : points) values.push_back(p[axis]);
    extent.centre[axis] = 0.5 * (core::quantile(values, 0.01, 0.0) + core::quantile(values, 0.99, 0.0));
  }

  // Radius that holds nearly all points.
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const auto& p : points) distances.push_back((p - extent.centre).norm());
  extent.radius_m = std::max(0.1, core::quantile(distances, 0.97, 0.0));
  return extent;
}

}  // namespace

core::Result<void> render_turntable(const Scene& scene, const SnapshotOptions& options, int pictures,
                                    const std::filesystem::path& folder,
                                    const std::function<void(std::size_t, std::size_t)>& progress) {
  if (pictures < 2) return core::usage_error("turntable: at least 2 pictures are needed");
  if (auto made = core::make_folder(folder); !made) return made;

  // The camera circles the centre.
  SnapshotOptions view = options;
  const SceneAxes axes = scene_axes(scene, options);
  const SceneExtent extent = extent_of(scene);
  view.view = View::kExplicit;
  view.up = axes.up;
  view.viewpoint.up = axes.up;
  view.viewpoint.target = extent.centre;
  view.viewpoint.field_of_view_deg = kFieldOfView_deg;

  // Far enough to see the whole extent.
  const double distance = 1.02 * extent.radius_m / std::sin(0.5 * kFieldOfView_deg * M_PI / 180.0);
  for (int k = 0; k < pictures; ++k) {
    const double turn = 2.0 * M_PI * k / pictures;
    const Eigen::Vector3d away = -std::cos(turn) * axes.forward + std::sin(turn) * axes.right;
    view.viewpoint.eye = extent.centre + distance * (std::cos(kPitch) * away + std::sin(kPitch) * axes.up);
    if (auto drawn = render_snapshot(scene, view, folder / fmt::format("{:04}.png", k)); !drawn) return drawn;
    if (progress) progress(static_cast<std::size_t>(k) + 1, static_cast<std::size_t>(pictures));
  }

  return {};
}

}  // namespace plumbline::viz
