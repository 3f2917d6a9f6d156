// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// From scores to candidates worth verifying (docs/method/places.md): scores relative to that of a
// neighbouring keyframe, grouped by covisibility, seen several times in a row.
#include <cstddef>
#include <functional>
#include <map>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/places/database.hpp"

namespace plumbline::places {

struct RecogniserOptions {
  double min_score = 0.25;  ///< eta, relative to the neighbour's score
  double min_absolute = 0.015;
  int consistent = 3;  ///< keyframes in a row that must see the same surroundings
  int hits = 30;       ///< best keyframes that are considered
  bool votes = false;  ///< candidates share most words (section 4.2) instead of having the best scores
  int groups = 3;      ///< candidates at most
  void declare(core::OptionTable& table);
};

struct Candidate {
  core::KeyframeId keyframe;  ///< the best of its group
  double score = 0.0;
  double group_score = 0.0;  ///< sum over its covisible keyframes among the hits
  int in_a_row = 1;          ///< queries in a row that found these surroundings
};

/// Keyframes that see much the same as a keyframe (itself left out), the closest first. Made from a
/// maps::Map, or from several.
using Neighbours = std::function<std::vector<core::KeyframeId>(core::KeyframeId)>;

/// Recognises places; keeps the results of each robot's last queries.
class Recogniser {
 public:
  explicit Recogniser(const RecogniserOptions& options) : options_(options) {}

  /// Candidates for keyframe `query` from the scores of its image (`Database::query`): best group first.
  /// `neighbour` is a keyframe that saw nearly the same as the query (usually the one before): other scores
  /// are relative to its score; invalid: scores are not compared. Keyframes that `allowed` refuses (the
  /// query's own surroundings) are left out. Those seen fewer than options.consistent times in a row come
  /// too, with their in_a_row.
  std::vector<Candidate> recognise(const Database::Scores& scores, core::KeyframeId query,
                                   core::KeyframeId neighbour,
                                   const std::function<bool(core::KeyframeId)>& allowed,
                                   const Neighbours& neighbours);

 private:
  /// Keyframes that see much the same.
  struct Island {
    Candidate candidate;
    std::vector<core::KeyframeId> members;  ///< sorted
  };
  [[nodiscard]] std::vector<Island> islands(const std::vector<Hit>& hits, const Neighbours& neighbours) const;
  std::vector<Candidate> seen_in_a_row(std::int32_t robot, std::vector<Island> islands);

  RecogniserOptions options_;
  std::map<std::int32_t, std::vector<Island>> last_;  ///< by robot
};

}  // namespace plumbline::places
