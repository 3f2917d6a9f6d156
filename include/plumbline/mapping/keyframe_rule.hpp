// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// When does a frame become a keyframe?
#include <cstdint>

#include "plumbline/core/options.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::mapping {

struct KeyframeRuleOptions {
  int min_frames = 2;
  int max_frames = 60;
  double min_shared = 0.6;
  double min_surface_overlap = 0.7;
  double max_parallax = 0.12;
  double max_rotation_rad = 0.26;
  int min_features = 60;
  void declare(core::OptionTable& table);
};

/// The terms of one decision, as written to frames.csv.
struct KeyframeDecision {
  int frames_since = 0;
  double shared = 1.0;    ///< features tracked, as a share of those right after the last keyframe
  double overlap = 1.0;   ///< share of the reference keyframe's surface that is in view
  double parallax = 0.0;  ///< movement since the reference keyframe over the scene's depth
  double rotation_rad = 0.0;
  bool wanted = false;
  bool urgent = false;  ///< tracking is about to be lost
};

/// The plain rule: enough parallax, rotation or loss of common features and surface; at once when tracking
/// gets thin; never so rarely that the map starves.
class KeyframeRule {
 public:
  explicit KeyframeRule(const KeyframeRuleOptions& options) : options_(options) {}
  KeyframeDecision decide(const maps::Map& map, core::KeyframeId reference,
                          const tracking::TrackResult& track, const sensor::Pinhole& camera);
  void keyframe_made();

 private:
  KeyframeRuleOptions options_;
  int frames_since_ = 0;
  int features_after_keyframe_ = 0;
};

}  // namespace plumbline::mapping
