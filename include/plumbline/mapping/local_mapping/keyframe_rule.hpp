// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Decides which frames become keyframes. Two rules: by what moved and what is lost (plain), or by the sides
// from which landmarks are seen (cone, docs/method/mapping.md).
#include <cstdint>

#include "plumbline/core/options.hpp"
#include "plumbline/mapping/local_mapping/viewing_cones.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::mapping {

struct KeyframeRuleOptions {
  enum class Rule { kPlain, kCone };
  Rule rule = Rule::kPlain;
  /// Case in which a keyframe is made whatever the rule says: tracking gets thin; it is nearly lost (fewer
  /// than min_features); never.
  enum class Urgent { kThin, kNearlyLost, kOff };
  Urgent urgent = Urgent::kThin;
  int min_frames = 2;
  int max_frames = 60;
  double min_shared = 0.6;
  double min_surface_overlap = 0.7;
  double max_parallax = 0.12;
  double max_rotation_rad = 0.26;
  int min_features = 60;
  bool reuse = true;
  int cone_patience = 20;
  double cone_max_shared = 0.75;
  int cone_min_points = 50;
  int cone_min_lines = 15;
  double cone_min_change_rad = 0.1745;
  Balance cone_balance = Balance::kAbove;
  /// Thresholds are relative to the scene, and the rule waits six frames for balance.
  bool cone_scaled = false;
  double cone_epsilon = 1.0;
  void declare(core::OptionTable& table);
};

/// Terms of the cone rule (docs/method/mapping.md); the counts are relative to the reference keyframe.
struct ConeTerms {
  double shared = 1.0;  ///< landmarks of the keyframe matched, as a share of those right after it
  ConeCounts now;
  ConeThreshold threshold;
  GridBalance balance;
  bool candidate = false;  ///< old enough or nothing better to do, enough matched, enough lost
  bool fires = false;      ///< D_c above its threshold, and balanced
};

enum class KeyframeCause { kNone, kPlain, kCone, kUrgent };

/// The terms of one decision, as written to frames.csv.
struct KeyframeDecision {
  int frames_since = 0;
  double shared = 1.0;    ///< features tracked, as a share of those right after the last keyframe
  double overlap = 1.0;   ///< share of the reference keyframe's surface that is in view
  double parallax = 0.0;  ///< movement since the reference keyframe over the scene's depth
  double rotation_rad = 0.0;
  bool mapper_idle = true;
  ConeTerms cone;
  bool wanted = false;
  bool urgent = false;                         ///< tracking is about to be lost
  KeyframeCause cause = KeyframeCause::kNone;  ///< cause of a wanted keyframe
  core::KeyframeId reuse;  ///< instead of a new keyframe this one becomes the reference again; invalid: none
};

/// Plain: enough parallax, rotation or loss of common features and surface; never so rarely that the map
/// starves. Cone: a candidate whose landmarks are seen from other sides, evenly over the image; if next to no
/// landmark has a normal, as on surfaces that are lit but not measured, the plain rule decides. Both: at once
/// if tracking gets thin, and if depth returns after a keyframe that had none.
class KeyframeRule {
 public:
  KeyframeRule(const KeyframeRuleOptions& options, const sensor::Pinhole& camera)
      : options_(options), camera_(camera) {}
  /// `track`: with its features and reference keyframe; `mapper_idle`: no bundle waits to be put back.
  KeyframeDecision decide(const maps::Map& map, const tracking::TrackResult& track, bool mapper_idle);
  /// A new keyframe was made, or another one became the reference.
  void keyframe_made();
  /// A keyframe other than the reference that makes a new one needless, as far as the plain rule goes: it saw
  /// `min_shared` of the landmarks that the frame has matched, and the frame is well within the plain rule's
  /// limits for movement and for its surface. Of several the one that saw most; invalid: none. Without it a
  /// map would grow as long as the camera moves, however often it has been there.
  [[nodiscard]] core::KeyframeId reusable_keyframe(const maps::Map& map,
                                                   const tracking::TrackResult& track) const;

 private:
  [[nodiscard]] bool plain_wants(const KeyframeDecision& decision) const;
  [[nodiscard]] bool is_urgent(const KeyframeDecision& decision, int tracked) const;
  [[nodiscard]] bool knows_cones() const;
  ConeTerms cone_terms(const maps::Map& map, const tracking::TrackResult& track, bool mapper_idle);
  [[nodiscard]] bool balance_will_do(const ConeTerms& terms);
  [[nodiscard]] bool is_candidate(const ConeTerms& terms, const tracking::TrackResult& track,
                                  bool mapper_idle) const;

  KeyframeRuleOptions options_;
  sensor::Pinhole camera_;
  int frames_since_ = 0;
  int features_after_keyframe_ = 0;
  /// The first frame after the keyframe that cones are counted against.
  struct First {
    core::KeyframeId keyframe;
    int landmarks = 0;       ///< of the keyframe, matched
    std::size_t points = 0;  ///< matched
    std::size_t lines = 0;
    ConeCounts counts;
  };
  First first_;
  int unbalanced_ = 0;  ///< candidates since the keyframe with enough changes but no balance
};

}  // namespace plumbline::mapping
