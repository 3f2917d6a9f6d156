// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/fusion_state.hpp"

#include <iterator>

#include "plumbline/core/archive.hpp"

namespace plumbline::maps {

std::vector<geometry::Matrix6d> FusionState::covariances_of(const std::vector<std::int32_t>& robots,
                                                            const std::vector<double>& stamps) const {
  std::vector<geometry::Matrix6d> result;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    // The last covariance before, else the next one
    auto after = covariances.upper_bound({robots[i], stamps[i]});
    if (after != covariances.begin() && std::prev(after)->first.first == robots[i]) --after;
    if (after == covariances.end()) return {};
    result.push_back(after->second);
  }
  return result;
}

template <typename Io>
void fields(Io& io, FusionState& state) {
  io(state.covariances);
}

std::vector<std::uint8_t> to_bytes(const FusionState& state) { return core::encoded(state); }

core::Result<FusionState> fusion_state_of(const std::vector<std::uint8_t>& bytes) {
  try {
    return core::decode<FusionState>(bytes);
  } catch (const core::BadBytes&) {
    return core::input_error("the state that its clouds were fused with is damaged; map the recording again");
  }
}

}  // namespace plumbline::maps
