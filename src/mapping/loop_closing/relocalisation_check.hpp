// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Whether a camera that was lost is where it was found by appearance.
#include <memory>

#include "plumbline/mapping/place_verification.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/tracking/surface_sampler.hpp"

namespace plumbline::mapping {

/// A map of nothing but one frame, as keyframe 0 of `robot` in the origin: what places are verified with.
maps::Map image_map(const sensor::RgbdFrame& frame, std::shared_ptr<const features::FrameFeatures> features,
                      const sensor::Pinhole& camera, const tracking::SurfaceSamplerOptions& surface);

/// A camera that turns up far from where it was lost must pass as a loop would: corridors look alike from
/// both ends. Near by there is nothing to confuse.
struct RelocalisationCheck {
  sensor::Pinhole camera;
  VerificationOptions verify;
  std::uint64_t seed = 0;
  tracking::SurfaceSamplerOptions surface;

  /// `lost_at`: the last pose that was known; `keyframe`: near which the camera was found. All
  /// camera_from_world.
  [[nodiscard]] bool passes(const maps::Map& map, const geometry::Rigid3& lost_at,
                            const sensor::RgbdFrame& frame, const features::FrameFeatures& features,
                            core::KeyframeId keyframe, const geometry::Rigid3& found_at) const;
};

}  // namespace plumbline::mapping
