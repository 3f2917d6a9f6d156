// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/fusion_state.hpp"

#include <iterator>

#include "plumbline/core/archive.hpp"

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

namespace {

/// As it is kept: what its maps hold, one behind the other.
struct KeptState {
  struct Field {
    std::int32_t robot = 0;
    cloud::DepthField::Terms coefficients = cloud::DepthField::Terms::Zero();
  };
  struct View {
    std::int32_t robot = 0;
    double stamp = 0.0;
    geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  };
  std::vector<Field> fields;
  std::vector<View> views;
};
template <typename Io>
void fields(Io& io, KeptState::Field& field) {
  io(field.robot, field.coefficients);
}
template <typename Io>
void fields(Io& io, KeptState::View& view) {
  io(view.robot, view.stamp, view.covariance);
}
template <typename Io>
void fields(Io& io, KeptState& state) {
  io(state.fields, state.views);
}

}  // namespace

std::vector<std::uint8_t> to_bytes(const FusionState& state) {
  KeptState kept;
  for (const auto& [robot, field] : state.depth_fields) kept.fields.push_back({robot, field.coefficients()});
  for (const auto& [view, covariance] : state.covariances) {
    kept.views.push_back({view.first, view.second, covariance});
  }
  core::ByteWriter bytes;
  core::encode(kept, bytes);
  return bytes.bytes();
}

core::Result<FusionState> fusion_state_of(const std::vector<std::uint8_t>& bytes) {
  FusionState state;
  try {
    const auto kept = core::decode<KeptState>(bytes);
    for (const auto& [robot, coefficients] : kept.fields) {
      state.depth_fields[robot] = cloud::DepthField(coefficients);
    }
    for (const auto& [robot, stamp, covariance] : kept.views) state.covariances[{robot, stamp}] = covariance;
  } catch (const core::BadBytes&) {
    return core::input_error("what its clouds were laid down with is damaged; map the recording again");
  }
  return state;
}

}  // namespace plumbline::maps
