// SPDX-License-Identifier: BSD-3-Clause
// Would another answer do as well?
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "merging/map_fusion_sets.hpp"
#include "merging/map_overlay.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;

constexpr double kApart_m = 1.0;     // another place: more than maps drift within what they share
constexpr double kTurned_rad = 0.3;  // ... or so far turned
constexpr int kFewLandmarks = 30;    // tell nothing
constexpr double kWrong = 0.2;       // share of landmarks seen through where maps do not belong together
// What rules an answer out that no landmark speaks against: so many surfaces seen through ...
constexpr double kNoAlternative = 0.2;
constexpr int kSurfaces = 500;
// ... or fewer, where landmarks match at a spot or two: an edge or a strip is alike all along itself.
constexpr int kSpots = 3;
constexpr double kNoAlternativeOfFewSpots = 0.1;
constexpr int kFewSurfaces = 100;

/// How far apart two answers put the camera of b's keyframes that agree, and how far they turn it.
struct Difference {
  double metres = 0.0;
  double radians = 0.0;
  [[nodiscard]] bool elsewhere() const { return metres > kApart_m || radians > kTurned_rad; }
};

Difference between(const maps::Map& b, core::KeyframeId at, const Rigid3& one, const Rigid3& other) {
  const Eigen::Vector3d camera = b.camera_from_world(at).inverse().translation;
  return {(one * camera - other * camera).norm(),
          geometry::rotation_angle(one.rotation.transpose() * other.rotation)};
}

bool refuted(const OverlayFit& fit, const MapFusionOptions& options) {
  return fit.expected + fit.contradicted >= kFewLandmarks && fit.seen_through() > options.max_seen_through;
}

/// Landmarks match beyond chance and nothing speaks against it. Not many can: what repeats was seen from
/// nearer at one end of the step and from afar at the other, and looks little alike then.
bool fits_as_well(const OverlayFit& fit, const OverlayFit& answer, const MapFusionOptions& options) {
  constexpr double kSigmas = 2.5;
  constexpr double kLeast = 8.0;
  const double beyond_chance = fit.matched - fit.chance;
  return fit.expected >= kFewLandmarks && !refuted(fit, options) && beyond_chance >= kLeast &&
         beyond_chance >= kSigmas * std::sqrt(fit.chance) &&
         fit.share() >= options.alternative_share * answer.share();
}

/// Another way to overlay b over a.
struct Alternative {
  Rigid3 a_from_b;
  Difference apart;
  int support = 0;  ///< keyframes that stand for it; 0: landmarks alone
  OverlayFit fit;
  bool refuted = false;
};

/// Held against the maps, side by side. Surfaces are tried where landmarks leave it open; what landmarks
/// alone stand for must show at several spots.
void test_alternatives(const MapOverlay& maps, const Rigid3& a_from_b, const OverlayFit& answer,
                       const MapFusionOptions& options, const core::Executor& executor,
                       std::vector<Alternative>& alternatives) {
  executor.parallel_for(alternatives.size(), [&](std::size_t i) {
    Alternative& alternative = alternatives[i];
    alternative.fit = maps.fit(alternative.a_from_b);
    alternative.refuted = alternative.support > 0 ? refuted(alternative.fit, options)
                                                  : !fits_as_well(alternative.fit, answer, options);
    if (alternative.refuted) return;
    const MapOverlay::Surfaces surfaces = maps.surfaces(alternative.a_from_b);
    alternative.refuted = surfaces.contradict(kNoAlternative, kSurfaces);
    if (alternative.refuted || alternative.support > 0 ||
        !surfaces.contradict(kNoAlternativeOfFewSpots, kFewSurfaces))
      return;
    const Eigen::Vector3d step = alternative.a_from_b.translation - a_from_b.translation;
    alternative.refuted = maps.matching_spots(alternative.a_from_b, step) < kSpots;
  });
}

std::string percent(double share) { return fmt::format("{:.0f} %", 100.0 * share); }

}  // namespace

int support(const ConsistentSet& set) { return static_cast<int>(std::min(set.keyframes_a, set.keyframes_b)); }

std::string ambiguity(const std::vector<MapPart>& parts, const SortedPairs& all,
                      const std::vector<ConsistentSet>& sets, const MapFusionOptions& options,
                      const core::Executor& executor, MergeEvidence& merge) {
  const maps::Map& a = *parts[merge.a].map;
  const maps::Map& b = *parts[merge.b].map;
  const MapOverlay maps(parts[merge.a], parts[merge.b]);
  merge.laid = maps.fit(merge.a_from_b);
  std::vector<Alternative> alternatives;
  for (std::size_t i = 1; i < sets.size(); ++i) {
    std::vector<PlacePair> pairs;
    for (const std::size_t k : sets[i].members) pairs.push_back(all.places[k]);
    const Rigid3 other = mean_transform(a, b, pairs).a_from_b;
    const Difference apart = between(b, pairs.front().b, merge.a_from_b, other);
    if (apart.elsewhere()) alternatives.push_back({other, apart, support(sets[i]), {}, false});
  }
  const core::KeyframeId at = all.places[sets.front().members.front()].b;
  for (const Rigid3& other : maps.steps(merge.a_from_b, merge.pairs, kApart_m)) {
    alternatives.push_back({other, between(b, at, merge.a_from_b, other), 0, {}, false});
  }
  test_alternatives(maps, merge.a_from_b, merge.laid, options, executor, alternatives);
  for (const Alternative& alternative : alternatives) {
    if (alternative.refuted) continue;
    merge.alternative = std::max(merge.alternative, alternative.support);
    if (!fits_as_well(alternative.fit, merge.laid, options) ||
        alternative.fit.share() <= merge.alternative_fit.share())
      continue;
    merge.alternative_fit = alternative.fit;
    merge.alternative_m = alternative.apart.metres;
  }
  if (merge.laid.expected + merge.laid.contradicted >= kFewLandmarks && merge.laid.seen_through() > kWrong) {
    return fmt::format("laid over each other, the maps contradict: {} of the landmarks were seen through",
                       percent(merge.laid.seen_through()));
  }
  const bool few = merge.agreeing < options.min_pairs;
  if (const MapOverlay::Surfaces surfaces = few ? maps.surfaces(merge.a_from_b) : MapOverlay::Surfaces{};
      few && (surfaces.there < kSurfaces || surfaces.contradict(kNoAlternativeOfFewSpots, kSurfaces))) {
    return fmt::format(
        "only {} keyframes agree on how the maps lie, and laid over each other {} pieces of surface are "
        "there "
        "and {} were seen through",
        merge.agreeing, surfaces.there, surfaces.through);
  }
  // One keyframe may be mistaken; two that agree are an answer. Few have no such alternatives at all.
  if (merge.alternative >= (few ? 1 : 2) && merge.alternative >= options.alternative * merge.agreeing) {
    return fmt::format(
        "two answers exclude each other: {} keyframes say one thing, {} another; places look "
        "alike here",
        merge.agreeing, merge.alternative);
  }
  if (merge.alternative_m > 0.0) {
    return fmt::format(
        "places look alike here: {:.1f} m away the maps fit too ({} of the landmarks are found instead of "
        "{}, "
        "and {} seen through)",
        merge.alternative_m, percent(merge.alternative_fit.share()), percent(merge.laid.share()),
        percent(merge.alternative_fit.seen_through()));
  }
  return {};
}

}  // namespace plumbline::mapping
