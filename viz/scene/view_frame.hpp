// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Directions and projection of a picture.
#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "plumbline/viz/snapshot.hpp"

namespace plumbline::viz {

constexpr double kDegree = M_PI / 180.0;

/// Right-handed directions of a scene, unit length, in the scene's frame. `forward` is horizontal: the wall
/// direction (if walls meet at right angles) nearest to where the first camera looks.
struct SceneAxes {
  Eigen::Vector3d right, forward, up;
  Eigen::Vector3d
      heading;  ///< where the cameras look on average, horizontal; = forward when they turned round
};
SceneAxes scene_axes(const Scene& scene, const SnapshotOptions& options);

/// Pinhole or orthographic projection onto a picture, y upwards.
struct Projection {
  Eigen::Vector3d right, up, forward;  ///< camera axes in the scene, unit
  Eigen::Vector3d eye;                 ///< scene frame, metres
  bool orthographic = true;
  double focal_px = 1.0;  ///< perspective: pixels per unit of x/z; orthographic: pixels per metre
  double width_px = 0.0;
  double height_px = 0.0;
  double near_m = 0.0;  ///< depth range along `forward`
  double far_m = 1.0;

  /// (x, y) in pixels from the lower left corner, z = depth along `forward`, metres.
  [[nodiscard]] Eigen::Vector3d project(const Eigen::Vector3d& p) const;
  [[nodiscard]] double pixels_per_metre(double depth_m) const;
  /// Unit direction from p towards the viewer.
  [[nodiscard]] Eigen::Vector3d to_viewer(const Eigen::Vector3d& p) const;
};

/// Directions of a view only (eye and scale unset), so that the points it can see may be chosen.
Projection view_directions(const SnapshotOptions& options, const SceneAxes& axes);

/// Places the camera so that all but a few in a thousand of `points` and all of `must_see` lie in the
/// picture; sets the depth range. `kept_free_px`: width at the right of the picture in which nothing is to
/// lie, for a colour bar.
void fit(Projection& projection, const std::vector<Eigen::Vector3d>& points,
         const std::vector<Eigen::Vector3d>& must_see, double kept_free_px = 0.0);

/// One point (the first) per cube of about 1/60 of the extent: dense surfaces near a camera then count no
/// more than sparse ones far away, which would be cut off otherwise.
std::vector<Eigen::Vector3d> evened(const std::vector<Eigen::Vector3d>& points);

}  // namespace plumbline::viz
