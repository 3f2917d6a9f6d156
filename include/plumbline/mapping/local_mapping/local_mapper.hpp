// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Turns frames into keyframes, keeps the landmarks worth having (docs/method/mapping.md), and knows what of
// the map is around the camera.
#include <memory>
#include <optional>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/mapping/adjustment/observation_noise.hpp"
#include "plumbline/mapping/local_mapping/landmark_culling.hpp"
#include "plumbline/mapping/local_mapping/landmark_fusion.hpp"
#include "plumbline/mapping/local_mapping/landmark_triangulation.hpp"
#include "plumbline/mapping/registration/surface_edge_job.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/tracking/surface_sampler.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::mapping {

struct LocalMapperOptions {
  double max_landmark_depth_m = 8.0;
  /// Rad/s; images taken while turning faster make and merge no landmarks.
  double max_landmark_turn_rate = 0.6;
  LandmarkCullingOptions culling;
  bool triangulate = true;
  TriangulationOptions triangulation;
  bool fuse = true;
  FusionOptions fusion;
  bool bundle = true;
  int bundle_keyframes = 12;
  ObservationNoise bundle_noise;  ///< without the scale factor, which is the tracker's
  bool edges = true;
  int edge_keyframes = 5;
  bool edge_photometric = true;
  double edge_min_overlap = 0.25;
  optimize::BundleOptions bundle_options;
  tracking::SurfaceSamplerOptions surface;
  LocalMapperOptions() {
    bundle_options.tolerance = 1e-3;  // the next keyframe's bundle continues from here
    bundle_options.point_loss = 1.0;
    bundle_options.line_loss = 1.0;
  }
  void declare(core::OptionTable& table);
};

class LocalMapper {
 public:
  /// `tracker`: whose frames these are; its corners are as exact when triangulated as when tracked.
  LocalMapper(const LocalMapperOptions& options, const tracking::TrackerOptions& tracker,
              const sensor::Pinhole& camera, std::int32_t robot);

  /// Continues with the `map` of another mapper, whose newest keyframe is `newest`.
  void restore(const maps::Map& map, core::KeyframeId newest) {
    culler_.restore(map, newest);
    look_around(map, newest);
  }

  /// The map around the camera, for its tracker.
  [[nodiscard]] tracking::Surroundings& around() { return around_; }
  /// Keyframe that the camera is near.
  [[nodiscard]] core::KeyframeId reference() const { return around_.local_map.reference; }
  /// Takes the local map anew, because the map has changed or another keyframe becomes the reference.
  void look_around(const maps::Map& map, core::KeyframeId reference) {
    around_.local_map = tracking::build_local_map(map, reference, local_map_);
  }
  /// Adapts the intensities that are kept of keyframes to a refined camera.
  void recalibrate(const sensor::Recalibration& change) { around_.photometric.recalibrate(change); }

  /// Adds a keyframe: observations of the landmarks it tracked, new landmarks from its depth, where older
  /// keyframes saw these, and landmarks without depth, triangulated. `levels`: the pyramid of its image;
  /// empty: none. `begins_component`: it gets no parent (maps/components.hpp).
  core::KeyframeId insert(maps::Map& map, const sensor::RgbdFrame& frame, const tracking::TrackResult& track,
                          const std::vector<cv::Mat>& levels, bool begins_component = false);

  /// Counts which landmarks a tracked frame should have seen and did; not where keyframes alone count.
  void count_observations(maps::Map& map, const tracking::TrackResult& track) const {
    if (!options_.culling.by_keyframes) count(map, track);
  }

  /// Starts to align the surfaces of the keyframes around, and their grey values if available, with the
  /// depth image and the image of the new one: the resulting constraints on its pose become edges of the map.
  /// None without the option `edges`.
  [[nodiscard]] std::optional<SurfaceEdgeJob> begin_surface_edges(const maps::Map& map,
                                                                  core::KeyframeId keyframe,
                                                                  const cv::Mat& depth,
                                                                  const tracking::TrackResult& track,
                                                                  const core::Executor& executor) const;

  /// Keeps the intensities of a new keyframe: later frames are aligned with them.
  void keep_intensities(core::KeyframeId keyframe, const cv::Mat& depth, const tracking::TrackResult& track);

  /// Improves the map around a new keyframe: first duplicate landmarks are fused, then those that did not
  /// prove themselves are removed.
  void refine(maps::Map& map, core::KeyframeId keyframe);

 private:
  static void count(maps::Map& map, const tracking::TrackResult& track);
  void add_points(maps::Map& map, core::KeyframeId keyframe, const cv::Mat& depth);
  void add_lines(maps::Map& map, core::KeyframeId keyframe);
  void triangulate(maps::Map& map, core::KeyframeId keyframe, const NewestImage& image);
  /// True for images taken while turning fast: the rolling shutter distorts them, so their rays are wrong.
  [[nodiscard]] bool distorted(const maps::Map& map, core::KeyframeId keyframe) const {
    return map.keyframe(keyframe).turn_rate > options_.max_landmark_turn_rate;
  }
  [[nodiscard]] std::vector<core::KeyframeId> nearest_undistorted(const maps::Map& map,
                                                                  core::KeyframeId keyframe, int count) const;

  LocalMapperOptions options_;
  sensor::Pinhole camera_;
  std::int32_t robot_;
  bool photometric_;
  tracking::LocalMapOptions local_map_;
  tracking::Surroundings around_;
  LandmarkCuller culler_;
};

}  // namespace plumbline::mapping
