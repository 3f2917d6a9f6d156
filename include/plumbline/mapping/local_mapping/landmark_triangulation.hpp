// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Landmarks where depth is missing or out of range: rays and interpretation planes of covisible keyframes
// meet (docs/method/mapping.md).
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

struct TriangulationOptions {
  int keyframes = 6;                ///< neighbours that are searched
  int max_hamming = 50;             ///< bits, points
  int max_line_hamming = 60;        ///< bits
  double ratio = 0.8;               ///< best distance over second best
  double max_relative_sigma = 0.1;  ///< standard deviation of the depth over the depth
  double max_depth_m = 40.0;
  double min_line_angle_rad = 0.03;  ///< between the interpretation planes that differ most
  int min_line_views = 3;            ///< two planes always intersect: only a third view can contradict them
  double max_angle_rad = 0.5;        ///< between orientations after the roll between the images is undone
  double scale_factor = 1.2;         ///< of the ORB pyramid
  double aligned = 0.3;              ///< standard deviation of aligned corners, over that of others

  void declare(core::OptionTable& table);
};

/// Image in which the newest keyframe's corners are aligned.
struct NewestImage {
  const std::vector<cv::Mat>& levels;  ///< the newest keyframe's image in each octave
  features::FrameFeatures& newest;     ///< its features, as held by the map
};

/// Triangulates corners of `keyframe` that see no landmark and have no depth (0, or beyond `max_measured_m`)
/// with those of `neighbours`, best first: near the epipolar line, alike in descriptor, orientation and
/// scale, clearly better than the second best; kept if both rays meet within the pixel noise, in front of
/// both cameras, at a known depth. Corners are found to a pixel, which needs a long baseline to determine
/// depth: with `image` the newest corner is aligned with the older one's patch and needs only a third of it;
/// it moves to the aligned position, and both see their landmark exactly. Corners whose images do not agree
/// are used as they are. Returns the new landmarks, which both keyframes observe.
std::vector<core::PointId> triangulate_points(maps::Map& map, core::KeyframeId keyframe,
                                              const std::vector<core::KeyframeId>& neighbours,
                                              double max_measured_m, const sensor::Pinhole& camera,
                                              const TriangulationOptions& options,
                                              const NewestImage* image = nullptr);

/// The same for lines without depth; a line needs three views that agree.
std::vector<core::LineId> triangulate_lines(maps::Map& map, core::KeyframeId keyframe,
                                            const std::vector<core::KeyframeId>& neighbours,
                                            double max_measured_m, const sensor::Pinhole& camera,
                                            const TriangulationOptions& options);

}  // namespace plumbline::mapping
