// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Associates features of a frame with landmarks of the local map, given a guess of the pose.
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/optimize/pose_solver.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/tracking/local_map.hpp"

namespace plumbline::tracking {

struct PointMatch {
  core::PointId point;
  int feature = -1;
  int distance = 256;
  bool aligned = false;                             ///< with the landmark's patch (align_points)
  Eigen::Vector2f shift = Eigen::Vector2f::Zero();  ///< from the corner to the landmark, px
};
struct LineMatch {
  core::LineId line;
  int feature = -1;
  int distance = 256;
};

struct AssociationOptions {
  int max_hamming = 64;
  double ratio = 0.9;
  double scale_factor = 1.2;  ///< of the ORB pyramid
  double max_point_angle_rad = 0.6;
  bool align = true;           ///< matched corners with their landmark's patch (align_points)
  double aligned_sigma = 0.3;  ///< standard deviation of aligned corners, relative to others
  int max_line_hamming = 90;
  double max_line_angle_rad = 0.2;
  double min_line_ratio = 0.0;  ///< of the lengths of a predicted and a measured line
  /// Focal lengths (px) of the cameras that the landmarks are from, by robot; of robots beyond: that of the
  /// camera. A camera of twice the focal length sees a landmark as if it were half as far away.
  std::vector<double> focals_px;
  void declare(core::OptionTable& table);
};

/// Features of a frame, and a guess of its pose. What it refers to must outlive it.
struct PosedFrame {
  const features::FrameFeatures& features;
  const sensor::Pinhole& camera;
  const geometry::Rigid3& camera_from_world;
};

/// Matches point landmarks by projection: within `radius` pixels (grown with the octave), of a fitting
/// octave, seen from a fitting side, best and clearly better than the second best, each feature used once.
/// `visible` receives the landmarks inside the view.
std::vector<PointMatch> match_points(const maps::Map& map, const std::vector<core::PointId>& points,
                                     const PosedFrame& posed, double radius,
                                     const AssociationOptions& options, std::vector<core::PointId>* visible);

/// Matches line landmarks by projection: near in distance and angle, overlapping, and alike in descriptor.
std::vector<LineMatch> match_lines(const maps::Map& map, const std::vector<core::LineId>& lines,
                                   const PosedFrame& posed, double radius, const AssociationOptions& options,
                                   std::vector<core::LineId>* visible);

struct SurfaceAssociationOptions {
  double max_distance_m = 0.10;  ///< measured point from the tangent plane
  int max_samples = 2000;
  double max_depth_m = 6.0;  ///< of the measured point
};

/// A depth image, and a guess of the pose of the colour image's camera. What it refers to must outlive it.
struct PosedDepth {
  const cv::Mat& depth;  ///< CV_32FC1, metres
  const sensor::Pinhole& camera;
  const geometry::Rigid3& camera_from_world;
  const geometry::Rigid3& depth_from_camera;  ///< the images have different stamps
};

/// Projective association of surface samples with a depth image: the sample is projected, and the depth
/// measured there is the point that should lie on its tangent plane. The measured points are returned in the
/// colour camera's frame. `in_view` receives the number of samples that face the
/// camera and have a measured depth where they should be seen, whether it fits or not.
std::vector<optimize::PlaneTerm> associate_surface(const std::vector<WorldSurface>& surface,
                                                   const PosedDepth& posed,
                                                   const SurfaceAssociationOptions& options,
                                                   int* in_view = nullptr);

}  // namespace plumbline::tracking
