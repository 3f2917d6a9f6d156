// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/map_connector.hpp"

#include <utility>

namespace plumbline::mapping {
namespace {

/// Frames after which background measurements go into the map: a keyframe's work is spread over several
/// frames, and its surfaces are aligned meanwhile.
constexpr std::int64_t kConnectAfter = 2;

}  // namespace

MapConnector::MapConnector(const SlamOptions& options, const sensor::Pinhole& camera,
                           const core::Executor& executor, core::Log& log)
    : options_(options),
      bundle_({options.mapper.bundle_keyframes, options.noise()}, options.mapper.bundle_options,
              options.bundle_lag, camera, executor, log),
      loops_(options.loops, camera),
      components_(camera, executor) {}

void MapConnector::restore(const maps::Map& map, core::KeyframeId newest, std::int64_t frame) {
  frame_ = frame;
  if (options_.loops.enabled) loops_.restore(map, newest);
  if (options_.mapper.bundle) bundle_.request(map, newest, frame_);
}

BundleReport MapConnector::begin_frame(maps::Map& map, MapPosition& camera, bool all) {
  BundleReport report;
  ++frame_;
  if (all) finish(map, camera);
  while (!waiting_.empty() && frame_ >= waiting_.front().frame + kConnectAfter) connect(map, camera, report);
  if (bundle_.due(frame_)) put_back_bundle(map, camera, report);
  return report;
}

void MapConnector::connect_at_once(maps::Map& map, MapPosition& camera, BundleReport& report) {
  if (options_.bundle_lag < kConnectAfter) connect(map, camera, report);
}

void MapConnector::finish(maps::Map& map, MapPosition& camera) {
  BundleReport ignored;
  while (!waiting_.empty()) connect(map, camera, ignored);
  commit_bundles(map, camera);
}

void MapConnector::connect(maps::Map& map, MapPosition& camera, BundleReport& report) {
  NewKeyframe made = std::move(waiting_.front());
  waiting_.pop_front();

  // Relative poses with covariance.
  if (made.edges) {
    for (const maps::SurfaceEdge& edge : made.edges->take()) map.add_edge(edge);
  }

  close_loops(map, made.id, camera);  // section 4.2
  join(map, made.id, camera);
  if (!options_.mapper.bundle) return;

  // Section 3.3: local bundle adjustment, put back `lag` frames later.
  bundle_.request(map, made.id, frame_);
  if (bundle_.due(frame_)) put_back_bundle(map, camera, report);
}

/// Puts the bundle's result into the map. The camera moves with its reference keyframe; the tracker's motion
/// model is a motion between cameras and is not affected.
void MapConnector::put_back_bundle(maps::Map& map, MapPosition& camera, BundleReport& report) {
  const std::optional<MapCorrection> correction = bundle_.commit(map, frame_, report);
  if (!correction) return;
  const auto moved = correction->find(camera.reference);
  if (moved != correction->end())
    camera.camera_from_world = camera.camera_from_world * moved->second.inverse();
  camera.map_changed = true;
}

void MapConnector::commit_bundles(maps::Map& map, MapPosition& camera) {
  while (!bundle_.idle()) {
    BundleReport ignored;
    put_back_bundle(map, camera, ignored);
  }
}

/// The whole map may move, so everything that was taken from it before must be back. The tracker waits, so
/// that the next frame is tracked in the new map, independent of the clock.
void MapConnector::close_loops(maps::Map& map, core::KeyframeId keyframe, MapPosition& camera) {
  if (!options_.loops.enabled) return;
  const std::size_t disputes = loops_.disputes().size();
  const std::vector<Loop> loops = loops_.detect(map, keyframe);
  if (loops_.disputes().size() > disputes && divide(map, camera)) return;
  if (loops.empty()) return;

  commit_bundles(map, camera);
  const geometry::Rigid3 camera_from_reference = camera.camera_from_reference(map);
  std::vector<PoseEdge> edges;
  edges.reserve(loops.size());
  for (const Loop& loop : loops) edges.push_back(LoopCloser::to_edge(loop));
  if (loops_.close(map, edges)) camera.move(map, camera_from_reference);
}

/// True if a relocalisation was taken back because of the newest dispute: the keyframes after it are now a
/// component of their own.
bool MapConnector::divide(maps::Map& map, MapPosition& camera) {
  if (!options_.components) return false;
  const LoopDispute dispute = loops_.disputes().back();
  const auto first = components_.wrong_turn(map, dispute);
  if (!first) return false;
  commit_bundles(map, camera);
  components_.divide(map, *first, dispute);
  loops_.remove_dispute();
  loops_.clear_pending();
  camera.map_changed = true;
  return true;
}

/// Joins two components if the new keyframe makes it certain that they show the same place.
void MapConnector::join(maps::Map& map, core::KeyframeId keyframe, MapPosition& camera) {
  if (!options_.loops.enabled || !options_.components) return;
  auto overlap = components_.look_up(map, keyframe, loops_.database());
  if (!overlap) return;
  commit_bundles(map, camera);
  const geometry::Rigid3 camera_from_reference = camera.camera_from_reference(map);
  if (components_.join(map, std::move(*overlap), keyframe, loops_)) camera.move(map, camera_from_reference);
}

}  // namespace plumbline::mapping
