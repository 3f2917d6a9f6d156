// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/fusion_state.hpp"

#include <iterator>

#include "plumbline/core/archive.hpp"

namespace plumbline::cloud {

template <typename Io>
void fields(Io& io, DepthField& field) {
  DepthField::Terms coefficients = field.coefficients();
  io(coefficients);
  if constexpr (Io::kReads) field = DepthField(coefficients);
}

}  // namespace plumbline::cloud

namespace plumbline::maps {

std::vector<geometry::Matrix6d> FusionState::covariances_of(const std::vector<std::int32_t>& robots,
                                                            const std::vector<double>& stamps) const {
  std::vector<geometry::Matrix6d> result;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    auto after = covariances.upper_bound({robots[i], stamps[i]});
    if (after != covariances.begin() && std::prev(after)->first.first == robots[i]) --after;
    if (after == covariances.end()) return {};
    result.push_back(after->second);
  }
  return result;
}

void FusionState::correct(std::int32_t robot, cloud::Cloud& camera_cloud) const {
  const auto field = depth_fields.find(robot);
  if (field != depth_fields.end()) field->second.correct(camera_cloud);
}

template <typename Io>
void fields(Io& io, FusionState& state) {
  io(state.depth_fields, state.covariances);
}

std::vector<std::uint8_t> to_bytes(const FusionState& state) { return core::encoded(state); }

core::Result<FusionState> fusion_state_of(const std::vector<std::uint8_t>& bytes) {
  try {
    return core::decode<FusionState>(bytes);
  } catch (const core::BadBytes&) {
    return core::input_error("what its clouds were laid down with is damaged; map the recording again");
  }
}

}  // namespace plumbline::maps
