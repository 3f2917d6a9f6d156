// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Inputs of the fusion besides clouds and poses. They are kept with a map, so that a cloud made of a store
// has the bytes of the run's own.
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::maps {

inline const char* const kFusionAttachment = "fusion";  ///< its name in a store

struct FusionState {
  /// Covariances of keyframes' poses, by robot and stamp; empty, or NaN for one keyframe: not known.
  std::map<std::pair<std::int32_t, double>, geometry::Matrix6d> covariances;

  /// Covariances of views: those of keyframes, and in between that of the previous one; empty: not known.
  [[nodiscard]] std::vector<geometry::Matrix6d> covariances_of(const std::vector<std::int32_t>& robots,
                                                               const std::vector<double>& stamps) const;
};

std::vector<std::uint8_t> to_bytes(const FusionState& state);
/// Errors (kInput): damaged.
core::Result<FusionState> fusion_state_of(const std::vector<std::uint8_t>& bytes);

}  // namespace plumbline::maps
