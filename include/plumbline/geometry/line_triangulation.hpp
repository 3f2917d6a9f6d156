// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A 3D line from its images alone (the paper's section 3.3: where depth is missing, landmarks are
// triangulated).
#include <vector>

#include "plumbline/geometry/plucker.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::geometry {

/// A segment seen by one camera. Its ends are normalised image coordinates, (u - cx) / fx and (v - cy) / fy
/// of an undistorted image: the camera sees it in the directions (x, y, 1).
struct LineView {
  Rigid3 camera_from_world;
  Eigen::Vector2d start = Eigen::Vector2d::Zero();
  Eigen::Vector2d end = Eigen::Vector2d::Zero();
  double sigma = 0.001;  ///< standard deviation of an end across the segment: pixels / focal length
};

struct LineTriangulationOptions {
  double min_angle_rad = 0.02;      ///< between the two interpretation planes that differ most
  double min_depth_m = 0.1;         ///< smallest depth of both ends, in every view
  double max_depth_m = 30.0;        ///< largest depth of both ends, in the first view
  double max_relative_sigma = 0.1;  ///< standard deviation of an end's depth over that depth
  double max_residual = 3.0;        ///< distance of each end from the line's image, standard deviations
  double min_overlap = 0.3;         ///< overlap of the line's image between its ends with each view's segment
};

enum class LineTriangulationStatus {
  kOk,
  kTooFewViews,        ///< fewer than two
  kDegenerate,         ///< a segment without length, or numbers that are not finite
  kTooLittleParallax,  ///< the planes (nearly) coincide: the camera stood, turned, or moved along the line
  kUncertain,          ///< depth is not known well enough
  kOutOfRange,         ///< behind a camera, or too near or too far
  kInconsistent        ///< the segments cannot be images of one 3D segment
};

/// `line`, `start`, `end` and the sigmas are set only when ok().
struct TriangulatedLine {
  LineTriangulationStatus status = LineTriangulationStatus::kTooFewViews;
  PluckerLine line;                                 ///< world frame, v a unit vector
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  ///< on the line, where the first view's segment starts;
  Eigen::Vector3d end = Eigen::Vector3d::Zero();    ///< world frame, metres
  double start_sigma = 0.0;  ///< metres, standard deviation along the first view's rays
  double end_sigma = 0.0;
  double angle_rad = 0.0;  ///< between the two interpretation planes that differ most
  double rms = 0.0;  ///< RMS of the residuals, standard deviations; 0 for two views, whose planes always meet

  [[nodiscard]] bool ok() const { return status == LineTriangulationStatus::kOk; }
};

/// The line in which the interpretation planes (camera centre and segment) of all views meet: linear solution
/// from the planes, then Gauss-Newton over the four degrees of freedom of the orthonormal form on the
/// distances of the measured ends from the line's image. Needs two views; three or more are checked against
/// each other. Segments of all views must have the same direction; their ends need not be the same points.
/// The first view should be the one that sees most of the line.
TriangulatedLine triangulate_line(const std::vector<LineView>& views,
                                  const LineTriangulationOptions& options = {});

}  // namespace plumbline::geometry
