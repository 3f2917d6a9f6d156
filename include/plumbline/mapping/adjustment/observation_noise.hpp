// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Noise of a keyframe's features in bundles of a few keyframes or of the whole map: standard deviations as
// they were found at true poses (docs/notes/2026-11-24-mapping.md).
#include <string>

#include "plumbline/core/options.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline::mapping {

struct ObservationNoise {
  double orb_scale_factor = 1.2;  ///< from octave to octave; corners are good to a pixel of theirs
  double aligned = 0.3;           ///< factor on it for aligned corners (maps::Observation)
  double line_sigma_px = 0.25;    ///< of a line's ends, across it
  double depth_factor = 2.0;      ///< of the depth noise, for the depth of corners and lines
  bool depth_rows = true;         ///< off: only image positions of corners and lines are used
  /// rad/s. Images taken while turning are distorted by the rolling shutter of common sensors, and their
  /// depth is stamped apart: what they say counts for half at this rate and fades with the fourth power of
  /// it.
  double turn_rate = 0.4;

  /// All but the scale factor, which is that of the features.
  void declare(core::OptionTable& table, const std::string& prefix);

  /// Observation of a corner for a bundle whose camera has the same intrinsics; the caller sets pose and
  /// landmark. `motion_factor`: factor on all standard deviations.
  [[nodiscard]] optimize::BundlePointObservation of(const features::PointFeature& corner, bool is_aligned,
                                                    double motion_factor = 1.0) const;
  /// `motion_factor` of a keyframe that was taken while the camera turned at this rate, rad/s.
  [[nodiscard]] double motion_factor_of(double rate) const;
  [[nodiscard]] optimize::BundleLineObservation of(const features::LineFeature& line,
                                                   double motion_factor = 1.0) const;
};

}  // namespace plumbline::mapping
