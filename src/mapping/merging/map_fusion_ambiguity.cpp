// SPDX-License-Identifier: BSD-3-Clause
// Ambiguity check: searches alternative alignments that fit two maps as well.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "merging/map_fusion_sets.hpp"
#include "merging/map_overlay.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;

constexpr double kApart_m = 1.0;     // distance of another place: more than maps drift within their overlap
constexpr double kTurned_rad = 0.3;  // or its rotation
constexpr int kFewLandmarks = 30;    // too few for a decision
constexpr double kWrong = 0.2;       // share of landmarks seen through where maps do not belong together
// An alignment that no landmark contradicts is refuted if this share of at least so many surfaces is seen
// through ...
constexpr double kNoAlternative = 0.2;
constexpr int kSurfaces = 500;
// ... or this share of fewer, if landmarks match at fewer than kSpots spots: an edge or a strip
// looks the same all along itself.
constexpr int kSpots = 3;
constexpr double kNoAlternativeOfFewSpots = 0.1;
constexpr int kFewSurfaces = 100;

/// Difference between two alignments at b's agreeing keyframes: distance and rotation of their cameras.
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

/// True if landmarks match beyond chance and nothing contradicts the alignment. Few can match: repeated
/// things seen from near at one end of the step and from afar at the other look little alike.
bool fits_as_well(const OverlayFit& fit, const OverlayFit& best, const MapFusionOptions& options) {
  constexpr double kSigmas = 2.5;
  constexpr double kLeast = 8.0;
  const double beyond_chance = fit.matched - fit.chance;
  return fit.expected >= kFewLandmarks && !refuted(fit, options) && beyond_chance >= kLeast &&
         beyond_chance >= kSigmas * std::sqrt(fit.chance) &&
         fit.share() >= options.alternative_share * best.share();
}

struct Alternative {
  Rigid3 a_from_b;
  Difference apart;
  int support = 0;  ///< keyframes that support it; 0: landmarks alone
  OverlayFit fit;
  bool refuted = false;
};

std::vector<Alternative> alternatives(const PartPair& maps, const PairSets& sets, const Rigid3& a_from_b,
                                      const MapOverlay& overlay) {
  std::vector<Alternative> result;
  for (std::size_t i = 1; i < sets.sets.size(); ++i) {
    const std::vector<PlacePair> places = sets.places_of(i);
    const Rigid3 other = mean_alignment(maps, places).a_from_b;
    const Difference apart = between(maps.map_b(), places.front().b, a_from_b, other);
    if (apart.elsewhere()) result.push_back({other, apart, support(sets.sets[i]), {}, false});
  }

  std::vector<VerifiedPair> agreeing;
  for (const std::size_t i : sets.sets.front().members) agreeing.push_back(sets.pairs[i]);
  const core::KeyframeId at = sets.places_of(0).front().b;
  for (const Rigid3& other : overlay.steps(a_from_b, agreeing, kApart_m)) {
    result.push_back({other, between(maps.map_b(), at, a_from_b, other), 0, {}, false});
  }

  return result;
}

/// Tests the alignment against the maps. Surfaces are used if landmarks are undecided; an alignment that only
/// landmarks support must match at several spots.
void check_against_maps(const MapOverlay& overlay, const Rigid3& a_from_b, const OverlayFit& best,
                        const MapFusionOptions& options, Alternative& other) {
  other.fit = overlay.fit(other.a_from_b);
  other.refuted = other.support > 0 ? refuted(other.fit, options) : !fits_as_well(other.fit, best, options);
  if (other.refuted) return;

  const MapOverlay::Surfaces surfaces = overlay.surfaces(other.a_from_b);
  other.refuted = surfaces.contradict(kNoAlternative, kSurfaces);
  if (other.refuted || other.support > 0 || !surfaces.contradict(kNoAlternativeOfFewSpots, kFewSurfaces))
    return;

  const Eigen::Vector3d step = other.a_from_b.translation - a_from_b.translation;
  other.refuted = overlay.matching_spots(other.a_from_b, step) < kSpots;
}

std::string percent(double share) { return fmt::format("{:.0f} %", 100.0 * share); }

}  // namespace

int support(const ConsistentSet& set) { return static_cast<int>(std::min(set.keyframes_a, set.keyframes_b)); }

Ambiguity ambiguity_of(const PartPair& maps, const PairSets& sets, const Rigid3& a_from_b) {
  const MapOverlay overlay(maps.parts[maps.a], maps.parts[maps.b]);
  Ambiguity result;
  result.overlap = overlay.fit(a_from_b);

  if (support(sets.sets.front()) < maps.options.min_pairs) {
    const MapOverlay::Surfaces surfaces = overlay.surfaces(a_from_b);
    result.surfaces_there = surfaces.there;
    result.surfaces_through = surfaces.through;
  }

  std::vector<Alternative> others = alternatives(maps, sets, a_from_b, overlay);
  maps.executor.parallel_for(others.size(), [&](std::size_t i) {
    check_against_maps(overlay, a_from_b, result.overlap, maps.options, others[i]);
  });

  for (const Alternative& other : others) {
    if (other.refuted) continue;
    result.alternative = std::max(result.alternative, other.support);
    if (!fits_as_well(other.fit, result.overlap, maps.options) ||
        other.fit.share() <= result.alternative_overlap.share()) {
      continue;
    }
    result.alternative_overlap = other.fit;
    result.alternative_m = other.apart.metres;
  }

  return result;
}

std::string objection(const Ambiguity& ambiguity, int agreeing, const MapFusionOptions& options) {
  const OverlayFit& overlap = ambiguity.overlap;
  if (overlap.expected + overlap.contradicted >= kFewLandmarks && overlap.seen_through() > kWrong) {
    return fmt::format("the aligned maps contradict each other: {} of the landmarks were seen through",
                       percent(overlap.seen_through()));
  }

  const bool few = agreeing < options.min_pairs;
  const MapOverlay::Surfaces surfaces{ambiguity.surfaces_there, ambiguity.surfaces_through};
  if (few && (surfaces.there < kSurfaces || surfaces.contradict(kNoAlternativeOfFewSpots, kSurfaces))) {
    return fmt::format(
        "only {} keyframes agree on the relative pose, where {} pieces of surface are confirmed and {} are "
        "seen through",
        agreeing, surfaces.there, surfaces.through);
  }

  // One keyframe may be mistaken; two that agree are an alternative. For few keyframes no alternative is
  // allowed.
  if (ambiguity.alternative >= (few ? 1 : 2) && ambiguity.alternative >= options.alternative * agreeing) {
    return fmt::format(
        "two alignments exclude each other: {} keyframes support one, {} the other; places look alike here",
        agreeing, ambiguity.alternative);
  }

  if (ambiguity.alternative_m > 0.0) {
    return fmt::format(
        "places look alike here: {:.1f} m away the maps fit too ({} of the landmarks are found instead of "
        "{}, "
        "and {} seen through)",
        ambiguity.alternative_m, percent(ambiguity.alternative_overlap.share()), percent(overlap.share()),
        percent(ambiguity.alternative_overlap.seen_through()));
  }

  return {};
}

}  // namespace plumbline::mapping
