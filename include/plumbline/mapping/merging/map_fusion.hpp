// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Maps of several robots become one (docs/method/merging.md; Algorithm 2). Each map has a world frame of its
// own. Places that two maps share are found by the appearance of keyframes, verified one by one, and believed
// only if enough of them agree on the relative pose of the two worlds, the aligned maps fit, and no other
// alignment is as good.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/mapping/adjustment/global_adjustment.hpp"
#include "plumbline/mapping/local_mapping/landmark_fusion.hpp"
#include "plumbline/mapping/loop_closing/consistent_pairs.hpp"
#include "plumbline/mapping/loop_closing/place_verification.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/maps/map_join.hpp"
#include "plumbline/places/recogniser.hpp"

namespace plumbline::mapping {

struct MapFusionOptions {
  int min_pairs = 5;  ///< with fewer keyframes that agree, those around them are verified too
  /// Smallest extent of both maps along a direction that the surfaces of the agreeing keyframes leave free:
  /// repetition along it cannot be seen in less.
  double few_extent_m = 3.0;
  double min_span_m = 0.25;   ///< agreeing keyframes nearer than this, and
  double min_span_rad = 0.5;  ///< turned by less than this, count as one
  ConsistencyOptions consistency;
  double prior_shared = 0.1;     ///< probability, before anything is seen, that two maps share a place
  double prior_wrong = 1e-4;     ///< largest probability of a wrong merge
  int verifications = 250;       ///< largest number of keyframe pairs that are verified for each two maps
  bool robust = true;            ///< the pose graph may reject pairs
  bool merge_duplicates = true;  ///< merge duplicate landmarks; a preview does not
  std::uint64_t seed = 1;
  places::VocabularyOptions vocabulary;
  places::RecogniserOptions places;
  VerificationOptions verify;
  FusionOptions doubles;
  GlobalAdjustmentOptions adjustment;
  MapFusionOptions();
  void declare(core::OptionTable& table);
  /// Declares only the options that decide whether maps are merged.
  void declare_decision(core::OptionTable& table, const std::string& prefix = "");
};

/// A map in its own world frame; its robots' numbers differ from those of all other parts. Must outlive the
/// functions it is passed to.
struct MapPart {
  const maps::Map* map = nullptr;
  Cameras cameras;  ///< cameras of its robots
};

/// Two keyframes of different parts that show the same place.
struct VerifiedPair {
  core::KeyframeId query;
  core::KeyframeId match;
  PlaceVerification evidence;
};

/// Fit of two aligned maps: the landmarks of either one, tested in the other.
struct OverlayFit {
  int expected = 0;  ///< landmarks where the other map measured a surface, from a similar side and distance
  int matched = 0;   ///< expected landmarks that the other map has too
  int contradicted = 0;   ///< landmarks where the other map saw through
  double chance = 0.0;    ///< expected matches with any other landmarks of that density
  double log_odds = 0.0;  ///< natural logarithm of the odds that it is one place, against any other
  /// Share of the expected landmarks that match, beyond chance.
  [[nodiscard]] double share() const {
    return expected > 0 ? std::max(0.0, matched - chance) / expected : 0.0;
  }
  /// Share of landmarks seen through, of those that can be judged.
  [[nodiscard]] double seen_through() const {
    const int judged = expected + contradicted;
    return judged > 0 ? static_cast<double>(contradicted) / judged : 0.0;
  }
};

/// The largest set of verified pairs of keyframes that agree on the relative pose of two worlds.
struct Consistency {
  int verified = 0;                 ///< pairs in all
  int agreeing = 0;                 ///< keyframes of the set, on the side that has fewer
  int places = 0;                   ///< the same, without those at one place
  double span_m = 0.0;              ///< largest distance between b's keyframes of the set
  double span_rad = 0.0;            ///< largest rotation between them
  std::vector<VerifiedPair> pairs;  ///< pairs of the set
};

/// Relative pose of two worlds according to a set of pairs.
struct Alignment {
  geometry::Rigid3 a_from_b;
  /// Covariance of log(a_from_b_true * a_from_b^-1), at the middle of b's keyframes.
  geometry::Matrix6d covariance = geometry::Matrix6d::Identity();
  double spread_m = 0.0;  ///< RMS of where the pairs put b's cameras, about the mean
};

/// Evidence on whether another alignment would fit as well.
struct Ambiguity {
  OverlayFit overlap;  ///< fit of the maps as aligned
  /// Natural logarithm of the odds that it is one place, against one that looks alike in part: from cells of
  /// the pictures that do not correlate, and from surfaces that are seen through.
  double against_like = 0.0;
  OverlayFit alternative_overlap;  ///< fit of the best other alignment that has the odds on its side
  int alternative = 0;             ///< keyframes that support it
  double alternative_m = 0.0;      ///< distance by which that alignment moves b's cameras; 0: there is none
};

/// Check that other keyframes see what they should, if the alignment is right.
struct CrossValidation {
  int expected = 0;                 ///< keyframes of b that should see what a saw
  int confirmed = 0;                ///< expected keyframes that do
  double against_like = 0.0;        ///< as in Ambiguity, from these two numbers
  std::vector<VerifiedPair> pairs;  ///< further pairs that agree
};

struct PairTotals {
  int matches = 0;       ///< sum of matches by descriptor
  int inliers = 0;       ///< sum of points and lines that fit in the end
  double rms_px = 0.0;   ///< mean residual, standard deviations
  double overlap = 0.0;  ///< mean overlap of the surfaces
};

/// All evidence on two parts. Steps after the one that refused a merge are not run.
struct MergeEvidence {
  std::size_t a = 0;  ///< index of the first part; a < b
  std::size_t b = 0;
  int candidates = 0;  ///< pairs of keyframes that look alike
  int tried = 0;       ///< candidates that were verified or refused
  Consistency consistency;
  Alignment alignment;
  Ambiguity ambiguity;
  CrossValidation validation;
  std::vector<VerifiedPair> pairs;           ///< all pairs that agree
  int rejected = 0;                          ///< agreeing pairs rejected by the pose graph of all maps
  std::map<std::string, int> refused_pairs;  ///< number of refused pairs by reason
  bool accepted = false;
  std::string refused;  ///< reason against the merge; empty if accepted
  [[nodiscard]] PairTotals totals() const;
};

/// Looks for shared places among the keyframes of several parts.
class OverlapFinder {
 public:
  explicit OverlapFinder(const MapFusionOptions& options)
      : options_(options), database_(places::Vocabulary(options.vocabulary)), recogniser_(options.places) {}

  struct Candidate {
    core::KeyframeId query;
    core::KeyframeId match;
    std::size_t query_part = 0;
    std::size_t match_part = 0;
    double score = 0.0;
  };

  void add(const maps::Map& map, core::KeyframeId keyframe);
  /// Keyframes of other parts that look like this one, best first. `before`: the keyframe before it of its
  /// robot, or an invalid id.
  std::vector<Candidate> recognise(const std::vector<MapPart>& parts, std::size_t part,
                                   core::KeyframeId keyframe, core::KeyframeId before);
  /// The same for all keyframes of all parts, one after the other; the keyframe before each is that of the
  /// lower id.
  std::vector<Candidate> look_at_all(const std::vector<MapPart>& parts, const core::Executor& executor);

 private:
  std::vector<Candidate> recognise(const places::Database::Scores& scores, const std::vector<MapPart>& parts,
                                   std::size_t part, core::KeyframeId keyframe, core::KeyframeId before);

  MapFusionOptions options_;
  places::Database database_;
  places::Recogniser recogniser_;
};

/// Verifies one candidate.
VerifiedPair verify_candidate(const std::vector<MapPart>& parts, const OverlapFinder::Candidate& candidate,
                              const MapFusionOptions& options);

/// Decides whether these pairs, all between parts a and b, show that the maps overlap, and finds their
/// relative pose. Fills all but candidates, tried and refused_pairs. If too few agree, keyframes near them
/// are verified first; if enough agree, further views that should show both maps are verified.
MergeEvidence decide_overlap(const std::vector<MapPart>& parts, std::size_t a, std::size_t b,
                             const std::vector<VerifiedPair>& found, const MapFusionOptions& options,
                             const core::Executor& executor);

/// A finder to which all parts' keyframes were added, for look_at_all(): the first step of find_overlaps, on
/// one thread.
OverlapFinder learn_places(const std::vector<MapPart>& parts, const MapFusionOptions& options);

/// Evidence on all pairs of parts, by a, then b. The same for any number of threads. `look_alikes`: result of
/// look_at_all().
std::vector<MergeEvidence> find_overlaps(const std::vector<MapPart>& parts,
                                         const std::vector<OverlapFinder::Candidate>& look_alikes,
                                         const MapFusionOptions& options, const core::Executor& executor);
std::vector<MergeEvidence> find_overlaps(const std::vector<MapPart>& parts, const MapFusionOptions& options,
                                         const core::Executor& executor);

/// Connected groups of parts: for each part the lowest number of its group.
std::vector<std::size_t> connected_parts(std::size_t parts, const std::vector<MergeEvidence>& merges);

struct FusedMap {
  maps::Map map;  ///< map of all parts of the anchor's group, in the anchor's world frame
  Cameras cameras;
  std::vector<std::size_t> parts;                  ///< parts in the map, ascending
  std::vector<geometry::Rigid3> anchor_from_part;  ///< their poses before adjustment
  int merged_points = 0;                           ///< duplicate landmarks removed
  int merged_lines = 0;
  int edges = 0;        ///< pairs of keyframes given to the pose graph
  int rejected = 0;     ///< pairs that the pose graph rejected
  int refused = 0;      ///< 1: the pose graph would have torn a map, and the parts lie at `anchor_from_part`
  std::string refusal;  ///< location of that tear
};

/// Moves all parts that are connected with `anchor` into its world by a pose graph and merges duplicates.
/// Poses and landmarks are not adjusted together here: that is done when surfaces are aligned too (stage
/// refine). Merges that contradict the rest in the pose graph are no longer accepted, and the fusion is then
/// done without them.
FusedMap fuse_maps(const std::vector<MapPart>& parts, std::vector<MergeEvidence>& merges, std::size_t anchor,
                   const MapFusionOptions& options);

}  // namespace plumbline::mapping
