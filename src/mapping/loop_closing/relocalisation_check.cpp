// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/loop_closing/relocalisation_check.hpp"

#include <utility>

#include "plumbline/maps/components.hpp"

namespace plumbline::mapping {

using geometry::Rigid3;

bool is_near(const Rigid3& a, const Rigid3& b, double most_m, double most_rad) {
  return (a.inverse().translation - b.inverse().translation).norm() < most_m &&
         geometry::rotation_angle(a.rotation * b.rotation.transpose()) < most_rad;
}

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

bool RelocalisationCheck::passes(const maps::Map& map, const LostAt& lost, const sensor::RgbdFrame& frame,
                                 const features::FrameFeatures& features, core::KeyframeId keyframe,
                                 const Rigid3& found_at) const {
  if (maps::root_of(map, keyframe) != maps::root_of(map, lost.reference)) return false;
  const bool near = is_near(found_at, lost.camera_from_world, 0.6, 0.6);
  if (near && !lost.astray) return true;
  if (features.points.empty() && features.lines.empty()) return true;  // depth alone: nothing to match
  const maps::Map image =
      image_map(frame, std::make_shared<features::FrameFeatures>(features), camera, surface);
  const PlaceVerification place =
      verify_place({&image, image.keyframe_ids().front(), camera}, {&map, keyframe, camera}, verify, seed);
  return place.accepted &&
         is_near(found_at, place.query_from_match * map.camera_from_world(keyframe), 0.1, 0.05);
}

}  // namespace plumbline::mapping
