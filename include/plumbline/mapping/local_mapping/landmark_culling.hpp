// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Landmarks that deserve to stay (docs/method/mapping.md): seen by enough keyframes, and found in at least 30
// % of the frames that should see them.
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/maps/map.hpp"

namespace plumbline::mapping {

struct LandmarkCullingOptions {
  double min_found_share = 0.3;
  int min_visible = 10;
  int min_keyframes = 1;  ///< 3 in the paper, whose keyframes are denser
  int grace_keyframes = 5;
  bool by_keyframes = false;  ///< keyframes alone are counted for the share, as the paper has it

  void declare(core::OptionTable& table);
};

/// Watches landmarks from their making until they are judged; a landmark that passed stays.
class LandmarkCuller {
 public:
  explicit LandmarkCuller(const LandmarkCullingOptions& options) : options_(options) {}

  /// A landmark was made with keyframe `born`.
  void watch(core::PointId id, core::KeyframeId born) { points_.push_back({id, born.index}); }
  void watch(core::LineId id, core::KeyframeId born) { lines_.push_back({id, born.index}); }

  /// Watches again those of a robot's landmarks that are not beyond judgement, as another one left them.
  void restore(const maps::Map& map, core::KeyframeId newest);

  /// Keyframe `newest` has been made. Removes landmarks that were found in too small a share of the frames
  /// that should see them, and those that too few keyframes see although `grace_keyframes` were made since
  /// theirs. Returns how many.
  int judge(maps::Map& map, core::KeyframeId newest);

 private:
  template <typename Id>
  struct Watched {
    Id id;
    int born = 0;  ///< index of the keyframe
  };
  enum class Verdict { kWait, kStay, kGo };
  template <typename Landmark>
  [[nodiscard]] Verdict verdict(const Landmark& landmark, int age) const;

  LandmarkCullingOptions options_;
  std::vector<Watched<core::PointId>> points_;
  std::vector<Watched<core::LineId>> lines_;
};

}  // namespace plumbline::mapping
