// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What laying clouds down takes besides clouds and poses. It is kept with a map, so that a cloud that is made
// of a store has the bytes of the run's own.
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::maps {

inline const char* const kFusionAttachment = "fusion";  ///< its name in a store

struct FusionState {
  /// Of keyframes' poses, by robot and stamp; empty: not known.
  std::map<std::pair<std::int32_t, double>, geometry::Matrix6d> covariances;

  /// Of views: as those of the keyframes, and between these as that of the one before; empty: not known.
  [[nodiscard]] std::vector<geometry::Matrix6d> covariances_of(const std::vector<std::int32_t>& robots,
                                                               const std::vector<double>& stamps) const;
};

std::vector<std::uint8_t> to_bytes(const FusionState& state);
/// Errors (kInput): damaged.
core::Result<FusionState> fusion_state_of(const std::vector<std::uint8_t>& bytes);

}  // namespace plumbline::maps
