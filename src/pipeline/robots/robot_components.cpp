// SPDX-License-Identifier: BSD-3-Clause
#include "robots/robot_components.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>

#include "plumbline/maps/components.hpp"

namespace plumbline::pipeline {

RobotComponents components_of(const RobotMap& whole) {
  constexpr std::size_t kLeastKeyframes = 5;
  RobotComponents result;
  const std::vector<core::KeyframeId> roots = maps::roots(*whole.map);
  if (roots.size() < 2) {
    result.maps.push_back(whole);
    return result;
  }

  const core::KeyframeId main = maps::main_root(*whole.map, whole.frame_poses);
  for (const core::KeyframeId root : roots) {
    auto map = std::make_shared<maps::Map>(maps::component(*whole.map, root));
    std::vector<maps::FramePose> frames = maps::frames_in(*map, whole.frame_poses);

    // A few keyframes apart from the rest are mostly a failed start. The main component stays however small.
    if (root != main && map->keyframe_count() < kLeastKeyframes) {
      ++result.dropped;
      result.dropped_frames += static_cast<std::size_t>(
          std::count_if(frames.begin(), frames.end(), [](const auto& frame) { return frame.tracked; }));
      continue;
    }

    const std::size_t number = result.maps.size() + 1;
    result.maps.push_back({number == 1 ? whole.name : fmt::format("{}-{}", whole.name, number), whole.robots,
                           std::move(map), std::move(frames), true});
  }

  // A component that remains alone is the map of its robot.
  if (result.maps.size() == 1) result.maps.front().component = false;
  return result;
}

std::vector<maps::FramePose> frames_of(const std::vector<const RobotMap*>& parts) {
  std::vector<maps::FramePose> all;
  std::map<std::int32_t, std::size_t> begin;  // in `all`, by the first robot of a part
  for (const RobotMap* part : parts) {
    const auto [found, is_new] = begin.emplace(part->robots.front().number, all.size());
    if (is_new) {
      all.insert(all.end(), part->frame_poses.begin(), part->frame_poses.end());
      continue;
    }
    for (std::size_t i = 0; i < part->frame_poses.size(); ++i) {
      if (part->frame_poses[i].tracked) all[found->second + i] = part->frame_poses[i];
    }
  }
  return all;
}

Json section_of(const ComponentFate& component) {
  Json section = {{"name", component.name},
                  {"frames", component.frames},
                  {"keyframes", component.keyframes},
                  {"joined", component.joined}};
  if (component.joined) {
    section["joined_s"] = component.joined_s < 0.0 ? Json() : Json(rounded(component.joined_s));
    section["agreeing_keyframes"] = component.agreeing;
  } else {
    section["why_not"] = component.why_not;
  }
  return section;
}

void doubt_components_apart(const Json& summary, std::vector<Doubt>& reasons) {
  std::size_t apart = 0;
  double frames = 0.0;
  std::string names;
  for (const Json& component : summary.at("components").at("list")) {
    if (component.at("joined").get<bool>()) continue;
    ++apart;
    frames += component.at("frames").get<double>();
    names += (names.empty() ? "" : ", ") + component.at("name").get<std::string>();
  }
  if (apart == 0) return;

  // The number of keyframes depends on the motion; the share of frames shows how much of the recording the
  // first map lacks.
  const FrameCounts all(summary);
  const auto read = static_cast<double>(all.read + all.unreadable);
  const double percent = read > 0.0 ? 100.0 * frames / read : 0.0;
  const std::string which =
      apart == 1 ? "a second map that shares" : fmt::format("{} more maps that share", apart);
  reasons.push_back(
      {Doubt::About::kComponents,
       fmt::format(
           "{:.0f} % of the frames form {} no place with the first: film a place of both (components/: {})",
           percent, which, names)});
}

}  // namespace plumbline::pipeline
