// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/local_mapping/landmark_culling.hpp"

namespace plumbline::mapping {

// Age in keyframes after which a landmark is not checked any more: the list stays short.
constexpr int kMaxAge = 100;

void LandmarkCullingOptions::declare(core::OptionTable& table) {
  table.number("landmark.min_found", min_found_share, {0.0, 1.0}, "",
               "Remove landmarks found in a smaller share of the frames that should see them");
  table.integer("landmark.min_visible", min_visible, {1, 1000}, "",
                "Number of frames that should have seen a landmark before that share is tested");
  table.boolean("landmark.by_keyframes", by_keyframes, "Count only frames that become keyframes");
  table.integer("landmark.min_keyframes", min_keyframes, {1, 100}, "",
                "Remove landmarks that fewer keyframes see after the grace period; 1: none");
  table.integer("landmark.min_age", grace_keyframes, {1, 1000}, "",
                "Grace period: number of keyframes after a landmark's first before the keyframes that see it "
                "are counted");
}

template <typename Landmark>
LandmarkCuller::Verdict LandmarkCuller::verdict(const Landmark& landmark, int age) const {
  if (landmark.visible >= options_.min_visible &&
      landmark.found < options_.min_found_share * landmark.visible) {
    return Verdict::kGo;
  }
  if (age < options_.grace_keyframes) return Verdict::kWait;
  if (static_cast<int>(landmark.observations.size()) < options_.min_keyframes) return Verdict::kGo;
  const bool well_known = landmark.visible >= 3 * options_.min_visible;
  return well_known || age >= kMaxAge ? Verdict::kStay : Verdict::kWait;
}

void LandmarkCuller::restore(const maps::Map& map, core::KeyframeId newest) {
  const auto watch_again = [&](const auto& landmark) {
    if (landmark.id.robot != newest.robot || landmark.observations.empty()) return;
    const core::KeyframeId born = landmark.observations.front().keyframe;
    if (verdict(landmark, newest.index - born.index) == Verdict::kWait) watch(landmark.id, born);
  };
  for (const core::PointId id : map.point_ids()) watch_again(map.point(id));
  for (const core::LineId id : map.line_ids()) watch_again(map.line(id));
}

int LandmarkCuller::judge(maps::Map& map, core::KeyframeId newest) {
  int removed = 0;
  const auto judge_all = [&](auto& watched) {
    std::size_t kept = 0;
    for (const auto& w : watched) {
      const auto* landmark = map.find(w.id);
      if (landmark == nullptr) continue;  // merged, or gone with its keyframes
      const Verdict v = verdict(*landmark, newest.index - w.born);
      if (v == Verdict::kWait) watched[kept++] = w;
      if (v != Verdict::kGo) continue;
      map.remove(w.id);
      ++removed;
    }
    watched.resize(kept);
  };
  judge_all(points_);
  judge_all(lines_);
  return removed;
}

}  // namespace plumbline::mapping
