// SPDX-License-Identifier: BSD-3-Clause
#include "run/fusion_state.hpp"

#include <iterator>
#include <nlohmann/json.hpp>

namespace plumbline::pipeline {

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

std::vector<std::uint8_t> to_bytes(const FusionState& state) {
  nlohmann::json json = {{"depth_fields", nlohmann::json::array()}, {"covariances", nlohmann::json::array()}};
  for (const auto& [robot, field] : state.depth_fields) {
    const auto& c = field.coefficients();
    json["depth_fields"].push_back({robot, std::vector<double>(c.data(), c.data() + c.size())});
  }
  for (const auto& [view, covariance] : state.covariances) {
    json["covariances"].push_back(
        {view.first, view.second, std::vector<double>(covariance.data(), covariance.data() + 36)});
  }
  return nlohmann::json::to_cbor(json);
}

core::Result<FusionState> fusion_state_of(const std::vector<std::uint8_t>& bytes) {
  FusionState state;
  try {
    const nlohmann::json json = nlohmann::json::from_cbor(bytes);
    for (const nlohmann::json& entry : json.at("depth_fields")) {
      const std::vector<double> numbers = entry.at(1);
      if (numbers.size() != cloud::DepthField::Terms::RowsAtCompileTime) throw std::range_error("field");
      state.depth_fields[entry.at(0)] =
          cloud::DepthField(Eigen::Map<const cloud::DepthField::Terms>(numbers.data()));
    }
    for (const nlohmann::json& entry : json.at("covariances")) {
      const std::vector<double> numbers = entry.at(2);
      if (numbers.size() != 36) throw std::range_error("covariance");
      state.covariances[{entry.at(0), entry.at(1)}] = Eigen::Map<const geometry::Matrix6d>(numbers.data());
    }
  } catch (const std::exception&) {
    return core::input_error("what its clouds were laid down with is damaged; map the recording again");
  }
  return state;
}

}  // namespace plumbline::pipeline
