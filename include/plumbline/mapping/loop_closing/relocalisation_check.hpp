// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Check that a lost camera really is where it was found by appearance.
#include <memory>

#include "plumbline/mapping/loop_closing/place_verification.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/tracking/surface_sampler.hpp"

namespace plumbline::mapping {

/// A map of one single frame, as keyframe 0 of `robot` in the origin; for verifying places.
maps::Map image_map(const sensor::RgbdFrame& frame, std::shared_ptr<const features::FrameFeatures> features,
                    const sensor::Pinhole& camera, const tracking::SurfaceSamplerOptions& surface);

/// True if two cameras (camera_from_world) lie within `most_m` metres and are turned by less than `most_rad`.
bool is_near(const geometry::Rigid3& a, const geometry::Rigid3& b, double most_m, double most_rad);

/// Last known position of a lost camera.
struct LostAt {
  core::KeyframeId reference;          ///< keyframe near which it was lost
  geometry::Rigid3 camera_from_world;  ///< the last pose that was known
  bool astray = false;                 ///< lost several frames ago: the camera may be elsewhere by now
};

/// A camera that turns up far from where it was lost, or after several frames, must pass as a loop would:
/// corridors look alike from both ends. Near by there is nothing to confuse. In another component it never
/// is: components are joined by more evidence than one frame has.
struct RelocalisationCheck {
  sensor::Pinhole camera;
  VerificationOptions verify;
  std::uint64_t seed = 0;
  tracking::SurfaceSamplerOptions surface;

  /// True if the camera passes. `keyframe`: near which it was found; `found_at`: its camera_from_world.
  [[nodiscard]] bool passes(const maps::Map& map, const LostAt& lost, const sensor::RgbdFrame& frame,
                            const features::FrameFeatures& features, core::KeyframeId keyframe,
                            const geometry::Rigid3& found_at) const;
};

}  // namespace plumbline::mapping
