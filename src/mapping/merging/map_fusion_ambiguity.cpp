// SPDX-License-Identifier: BSD-3-Clause
// Ambiguity check: searches alternative alignments that fit two maps as well.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "merging/map_fusion_sets.hpp"
#include "merging/map_overlay.hpp"
#include "merging/picture_overlay.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;

constexpr double kApart_m = 1.0;      // distance of another place: more than maps drift within their overlap
constexpr double kTurned_rad = 0.3;   // or its rotation
constexpr int kFewLandmarks = 30;     // too few for a decision
constexpr double kWrong = 0.2;        // share of landmarks seen through where maps do not belong together
constexpr double kPerKeyframe = 2.3;  // log odds: of ten keyframes that support an alignment, one is mistaken

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

struct Alternative {
  Rigid3 a_from_b;
  Difference apart;
  int support = 0;  ///< keyframes that support it; 0: landmarks alone
  OverlayFit fit;
  bool stands = false;
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

std::string percent(double share) { return fmt::format("{:.0f} %", 100.0 * share); }

}  // namespace

int support(const ConsistentSet& set) { return static_cast<int>(std::min(set.keyframes_a, set.keyframes_b)); }

Ambiguity ambiguity_of(const PartPair& maps, const PairSets& sets, const Rigid3& a_from_b) {
  const MapPart& a = maps.parts[maps.a];
  const MapPart& b = maps.parts[maps.b];
  const MapOverlay overlay(a, b);
  Ambiguity result;
  const std::vector<double> aligned = picture_correlations(a, b, a_from_b);
  result.overlap = overlay.fit(a_from_b);
  result.overlap.log_odds = PictureOdds().of_one_place(aligned);
  result.against_like = PictureOdds().against_like(aligned) + overlay.surface_log_odds(a_from_b);

  // An alternative stands if the same things are seen there, as much as they are at the alignment. One
  // keyframe alone may be mistaken.
  const PictureOdds odds(aligned);
  std::vector<Alternative> others = alternatives(maps, sets, a_from_b, overlay);
  maps.executor.parallel_for(others.size(), [&](std::size_t i) {
    Alternative& other = others[i];
    const std::vector<double> there = picture_correlations(a, b, other.a_from_b);
    const double keyframes = kPerKeyframe * other.support;
    other.stands =
        odds.of_one_place(there) + keyframes > kPerKeyframe && odds.against_like(there) + keyframes > 0.0;
    if (!other.stands) return;

    other.fit = overlay.fit(other.a_from_b);
    other.fit.log_odds = odds.of_one_place(there) + keyframes + overlay.surface_log_odds(other.a_from_b);
    other.stands =
        other.fit.log_odds > kPerKeyframe && (other.support > 0 || other.fit.expected >= kFewLandmarks);
  });

  for (const Alternative& other : others) {
    if (!other.stands || other.fit.log_odds <= result.alternative_overlap.log_odds) continue;
    result.alternative = other.support;
    result.alternative_overlap = other.fit;
    result.alternative_m = other.apart.metres;
  }

  return result;
}

double log_odds(const Ambiguity& ambiguity, int places, const MapFusionOptions& options) {
  return ambiguity.overlap.log_odds + kPerKeyframe * places +
         std::log(options.prior_shared / (1.0 - options.prior_shared));
}

std::string objection(const Ambiguity& ambiguity, int places, const MapFusionOptions& options) {
  const OverlayFit& overlap = ambiguity.overlap;

  // No landmark can be where the other map looked through; many such cases refute the alignment.
  if (overlap.expected + overlap.contradicted >= kFewLandmarks && overlap.seen_through() > kWrong) {
    return fmt::format("the aligned maps contradict each other: {} of the landmarks were seen through",
                       percent(overlap.seen_through()));
  }

  // Agreeing keyframes and landmarks must outweigh the small prior probability that
  // two maps share a place at all.
  if (const double odds = log_odds(ambiguity, places, options); odds < -std::log(options.prior_wrong)) {
    return fmt::format(
        "keyframes of {} places agree, and {} of {} landmarks are found: the odds that it is one place are "
        "{:.1g} to 1, and {:.0f} to 1 are needed",
        places, overlap.matched, overlap.expected, std::exp(odds), 1.0 / options.prior_wrong);
  }

  // Another alignment fits as well, as along a corridor with equal doors, so neither is certain.
  if (ambiguity.alternative_m > 0.0) {
    return fmt::format(
        "places look alike here and may be copies: {:.1f} m away the maps fit too ({} of the landmarks are "
        "found instead of {}, and {} seen through; {} keyframes say so); a look at what does not repeat "
        "decides",
        ambiguity.alternative_m, percent(ambiguity.alternative_overlap.share()), percent(overlap.share()),
        percent(ambiguity.alternative_overlap.seen_through()), ambiguity.alternative);
  }

  return {};
}

}  // namespace plumbline::mapping
