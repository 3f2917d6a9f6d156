// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/loop_closing/relocalisation.hpp"

#include <memory>
#include <utility>

#include "plumbline/mapping/merging/components.hpp"

namespace plumbline::mapping {

maps::Map image_map(const sensor::RgbdFrame& frame, std::shared_ptr<const features::FrameFeatures> features,
                    const sensor::Pinhole& camera, const tracking::SurfaceSamplerOptions& surface) {
  auto seen = std::make_shared<maps::Keyframe>();
  seen->id = {0, 0};
  seen->stamp = frame.stamp;
  seen->features = std::move(features);
  seen->surface = tracking::sample_surface(frame.depth, camera, surface);
  maps::Map map;
  map.add_keyframe(seen, {});
  return map;
}

bool Relocalisation::is_place(const maps::Map& map, const tracking::LostCamera& lost,
                              const tracking::FoundFrame& found) const {
  // After half a second the camera may be where doors and walls repeat: one frame that looks like another
  // place is no evidence there. A component that begins in its place is joined by the evidence of several
  // keyframes.
  const bool stayed = is_near(found.camera_from_world, lost.camera_from_world, 0.15, 0.15);
  if (options_.components && !stayed && lost.frames >= kLostFrames &&
      can_begin_component(found.frame, found.features)) {
    return false;
  }

  const bool near = is_near(found.camera_from_world, lost.camera_from_world, 0.6, 0.6);
  return (near && !lost.astray) || verified(map, found);
}

/// True if the frame, verified like a loop, gives the same pose.
bool Relocalisation::verified(const maps::Map& map, const tracking::FoundFrame& found) const {
  const features::FrameFeatures& features = found.features;
  if (features.points.empty() && features.lines.empty()) return true;  // depth alone: nothing to match
  const maps::Map image = image_map(found.frame, std::make_shared<features::FrameFeatures>(features), camera_,
                                    options_.mapper.surface);
  const PlaceVerification place =
      verify_place({&image, image.keyframe_ids().front(), camera_}, {&map, found.keyframe, camera_},
                   options_.loops.verify, options_.loops.seed);
  return place.accepted && is_near(found.camera_from_world,
                                   place.query_from_match * map.camera_from_world(found.keyframe), 0.1, 0.05);
}

std::optional<int> Relocalisation::judge(const maps::Map& map, const sensor::RgbdFrame& frame,
                                         const features::FrameFeatures& features, int lost_before,
                                         tracking::TrackResult& track) {
  constexpr int kFrames = 5;
  constexpr int kOutdated = 5;  // lost frames after which the camera may be anywhere
  if (!options_.loops.enabled) return std::nullopt;
  if (!probation_ && track.relocalised && lost_before >= kOutdated) probation_ = Probation{lost_before, 0};
  if (!probation_) return std::nullopt;

  // It must be tracked all the time.
  ++probation_->frames;
  const int lost_frames = probation_->lost_before + probation_->frames;
  bool stands = track.state == tracking::TrackState::kTracked;
  if (stands && probation_->frames < kFrames) {
    track.state = tracking::TrackState::kLost;
    track.loss = tracking::Loss::kUnconfirmed;
    return std::nullopt;
  }

  // And be recognised once more at the end.
  stands = stands && verified(map, {frame, features, track.reference, track.camera_from_world});
  probation_.reset();
  track.relocalised = stands;
  found_again_ = found_again_ || stands;
  if (stands) return std::nullopt;
  if (track.loss == tracking::Loss::kNone) track.loss = tracking::Loss::kUnconfirmed;
  track.state = tracking::TrackState::kLost;
  return lost_frames;
}

}  // namespace plumbline::mapping
