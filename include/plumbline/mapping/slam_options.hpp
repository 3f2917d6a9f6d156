// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Options of one robot's SLAM.
#include "plumbline/core/options.hpp"
#include "plumbline/mapping/local_mapping/keyframe_rule.hpp"
#include "plumbline/mapping/local_mapping/local_mapper.hpp"
#include "plumbline/mapping/loop_closing/loop_closer.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::mapping {

struct SlamOptions {
  tracking::TrackerOptions tracker;
  KeyframeRuleOptions keyframe;
  LocalMapperOptions mapper;
  int bundle_lag = 8;  ///< frames
  LoopOptions loops;
  bool components = true;
  void declare(core::OptionTable& table);
  /// Noise of observations in bundles, by the options of tracker and mapper.
  [[nodiscard]] ObservationNoise noise() const;
};

}  // namespace plumbline::mapping
