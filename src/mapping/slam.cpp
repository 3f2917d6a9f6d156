// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/slam.hpp"

#include <opencv2/core.hpp>
#include <utility>

#include "plumbline/mapping/local_bundle.hpp"

namespace plumbline::mapping {

using geometry::Rigid3;

void SlamOptions::declare(core::OptionTable& table) {
  tracker.declare(table);
  keyframe.declare(table);
  mapper.declare(table);
}

/// A map's first frame must have depth to make landmarks and surfaces of: on a covered camera's nothing, all
/// that follows would be lost.
static bool can_start_map(const sensor::RgbdFrame& frame) {
  constexpr double kMinMeasured = 0.05;  // share of the pixels
  return !frame.depth.empty() &&
         cv::countNonZero(frame.depth > 0) > kMinMeasured * static_cast<double>(frame.depth.total());
}

Slam::Slam(const SlamOptions& options, const sensor::Pinhole& camera, std::int32_t robot,
           const core::Executor& /*executor*/, core::Log& log)
    : options_(options),
      camera_(camera),
      robot_(robot),
      log_(&log),
      tracker_(options.tracker, camera),
      rule_(options.keyframe),
      mapper_(options.mapper, camera) {}

Slam::~Slam() = default;

void Slam::start_map(const sensor::RgbdFrame& frame,
                     const std::shared_ptr<const features::FrameFeatures>& features, FrameReport& report) {
  tracking::TrackResult origin;
  report.keyframe = mapper_.insert(map_, robot_, frame, features, origin, 0.0);
  report.reference = report.keyframe;
  report.state = tracking::TrackState::kTracked;
  rule_.keyframe_made();
  tracker_.map_changed(map_, report.keyframe, origin.camera_from_world);
}

FrameReport Slam::process(const sensor::RgbdFrame& frame,
                          std::shared_ptr<const features::FrameFeatures> features) {
  FrameReport report;
  report.frame_index = frame.index;
  report.stamp = frame.stamp;
  last_track_ = tracker_.track(map_, frame, *features);
  const tracking::TrackResult& track = last_track_;
  report.state = track.state;
  if (track.state == tracking::TrackState::kInitialising) {
    if (!can_start_map(frame)) return report;
    start_map(frame, features, report);
    remember_pose(frame.stamp, Rigid3{}, true);
    return report;
  }
  report.reference = tracker_.reference();
  report.points = track.estimate.points;
  report.lines = track.estimate.lines;
  report.surface = track.estimate.planes;
  report.min_eigenvalue = track.min_eigenvalue;
  report.weak_directions = track.weak_directions;
  report.relocalised = track.relocalised;
  const bool tracked = track.state == tracking::TrackState::kTracked;
  if (tracked) {
    mapper_.count_sightings(map_, track);
    report.decision = rule_.decide(map_, tracker_.reference(), track, camera_);
    if (report.decision.wanted) {
      report.keyframe = mapper_.insert(map_, robot_, frame, features, track, tracker_.turn_rate());
      report.reference = report.keyframe;
      if (options_.mapper.edges && options_.tracker.depth) {
        mapper_.add_surface_edges(map_, report.keyframe, frame.depth, track.depth_from_camera,
                                  tracker_.local_map().keyframes);
      }
      mapper_.cull(map_);
      if (options_.mapper.bundle && tracker_.turn_rate() <= options_.mapper.bundle_max_turn_rate) {
        const LocalBundleOptions window{options_.mapper.bundle_keyframes,
                                        options_.mapper.bundle_max_turn_rate,
                                        options_.tracker.association.scale_factor};
        LocalBundle bundle = take_local_bundle(map_, report.keyframe, camera_, window);
        if (optimize::adjust_bundle(bundle.problem, options_.mapper.bundle_options).usable)
          put_back(bundle, map_);
      }
      rule_.keyframe_made();
      tracker_.map_changed(map_, report.keyframe, map_.camera_from_world(report.keyframe));
      remember_pose(frame.stamp, map_.camera_from_world(report.keyframe), true);
      return report;
    }
  }
  remember_pose(frame.stamp, track.camera_from_world, tracked);
  return report;
}

void Slam::remember_pose(double stamp, const Rigid3& camera_from_world, bool tracked) {
  const core::KeyframeId reference = tracker_.reference();
  frames_.push_back(
      {stamp, reference, camera_from_world * map_.camera_from_world(reference).inverse(), tracked});
}

void Slam::finish() {}

geometry::Trajectory Slam::trajectory() const { return maps::trajectory(frames_, map_); }

geometry::Trajectory Slam::keyframe_trajectory() const { return maps::keyframe_trajectory(map_); }

std::vector<maps::LineSegment3> Slam::line_segments() const { return maps::line_segments(map_); }

}  // namespace plumbline::mapping
