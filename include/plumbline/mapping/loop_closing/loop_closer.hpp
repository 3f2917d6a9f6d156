// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Closes loops (docs/method/places.md): every keyframe is compared with earlier places; verified matches that
// are consistent several times in a row become edges of a robust pose graph; edges that it does not reject
// move the map, duplicate landmarks are merged, and everything is adjusted together.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/mapping/adjustment/global_adjustment.hpp"
#include "plumbline/mapping/local_mapping/landmark_fusion.hpp"
#include "plumbline/mapping/loop_closing/consistent_pairs.hpp"
#include "plumbline/mapping/loop_closing/place_verification.hpp"
#include "plumbline/mapping/merging/other_maps.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/places/recogniser.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/tracking/surface_sampler.hpp"

namespace plumbline::mapping {

struct LoopOptions {
  bool enabled = true;
  double min_gap_s = 3.0;        ///< keyframes made within this time are the present, not a loop
  int agreeing = 2;              ///< verified keyframes, following one another, that must be consistent
  double max_alternative = 0.5;  ///< largest share of them that another consistent set may have
  ConsistencyOptions consistency;
  /// Largest correction by a loop, as a share of the distance travelled since the match: what looks alike
  /// further off (doors of a corridor) is another place.
  double max_drift = 0.02;
  bool robust = true;  ///< the pose graph may reject loops
  bool bundle = true;  ///< adjust the whole map after a loop
  std::uint64_t seed = 1;
  places::VocabularyOptions vocabulary;
  places::RecogniserOptions places;
  VerificationOptions verify;
  FusionOptions fusion;
  LoopOptions() { verify.rounds = 200; }  ///< enough if a third agrees; done for every keyframe
  void declare(core::OptionTable& table);
};

struct LoopCounts {
  int candidates = 0;  ///< places that looked like one seen before and were verified
  int verified = 0;    ///< candidates that were verified successfully
  int accepted = 0;    ///< loops that moved the map
  int rejected = 0;    ///< edges that the pose graph rejected
  int refused = 0;     ///< closings that would have torn the map
  int located = 0;     ///< frames of a lost tracker that another robot's map knew
  int by_others = 0;   ///< loops through another robot's map that moved this one
};

/// A verified pair of keyframes.
struct Loop {
  core::KeyframeId query;
  core::KeyframeId match;
  PlaceVerification evidence;
};

/// One candidate that was verified, and what became of it.
struct LoopTrial {
  Loop loop;
  double score = 0.0;         ///< similarity of the images
  double correction_m = 0.0;  ///< motion of the query if the loop is closed; 0: there is no pose
  double correction_rad = 0.0;
  double path_m = 0.0;     ///< length of the path from match to query, along the keyframes
  bool by_others = false;  ///< query and match were both seen in another robot's map, not in each other
  bool closed = false;     ///< the pose graph accepted it, and the map was moved
  std::string refused;     ///< reason why it is not a loop; empty: it passed
};

/// Loops that were verified, agree with one another and are more than drift explains: the path is wrong
/// somewhere between, or places look alike.
struct LoopDispute {
  std::vector<Loop> loops;
  LoopTrial strongest;  ///< the loop with most landmarks
};

/// Verified loops that wait for others to agree with them.
class PendingLoops {
 public:
  /// `patience`: number of keyframes for which a verified loop waits for another one.
  explicit PendingLoops(int patience = 6) : patience_(patience) {}
  /// Adds the loops of `keyframe`, which is new in the queries' map. Returns the largest consistent set of
  /// recent loops that includes `keyframe`, if it has enough keyframes and no other set is nearly as large;
  /// then no loop is left waiting.
  std::vector<Loop> confirm(const maps::Map& matches, const maps::Map& queries, core::KeyframeId keyframe,
                            const std::vector<Loop>& verified, const LoopOptions& options);

 private:
  int patience_;
  std::vector<Loop> waiting_;
};

class InterRobotLoops;

class LoopCloser {
 public:
  LoopCloser(const LoopOptions& options, const sensor::Pinhole& camera)
      : options_(options),
        camera_(camera),
        database_(places::Vocabulary(options.vocabulary)),
        recogniser_(options.places) {}

  /// Asks for the place of a new keyframe of the map and adds it to the database. Loops that are sure enough
  /// to be closed; mostly none.
  std::vector<Loop> detect(const maps::Map& map, core::KeyframeId keyframe);

  /// Knows the places of a map that another one left, whose newest keyframe is `newest`; its loops are in the
  /// map.
  void restore(const maps::Map& map, core::KeyframeId newest);

  /// From now on detect() also finds loops through other robots' maps.
  void use(std::shared_ptr<const OtherMapsInbox> others);
  /// Pose of an image that the tracker cannot place, camera_from_world, according to other robots' maps.
  std::optional<geometry::Rigid3> locate(const sensor::RgbdFrame& frame,
                                         const std::shared_ptr<const features::FrameFeatures>& features,
                                         const tracking::SurfaceSamplerOptions& surface);

  /// Solves a pose graph with these edges and the loops of the map; edges that it does not reject become the
  /// map's loops. If one of the new edges is among them, the map is moved, duplicates around these edges are
  /// merged, and everything is adjusted. Returns whether the map was moved. Edges may come from elsewhere
  /// too. No work on data that was taken from the map before may be running.
  bool close(maps::Map& map, const std::vector<PoseEdge>& edges);

  /// Drops loops that wait for others to agree with them: they were measured with another camera.
  void clear_pending() {
    pending_ = PendingLoops();
    pending_disputes_ = PendingLoops(kDisputePatience);
  }

  /// The loop as an edge of the pose graph: the pose of the query relative to the match.
  static PoseEdge to_edge(const Loop& loop) {
    return {loop.match, loop.query, loop.evidence.query_from_match, loop.evidence.information, false};
  }

  /// Keyframes of the map that an image looks like, best first; for a tracker that is lost.
  [[nodiscard]] std::vector<core::KeyframeId> look_alikes(const maps::Map& map,
                                                          const features::FrameFeatures& image,
                                                          std::size_t count) const;

  [[nodiscard]] const LoopCounts& counts() const { return counts_; }
  /// Every candidate that was verified so far.
  [[nodiscard]] const std::vector<LoopTrial>& trials() const { return trials_; }
  /// Evidence against the tracked path, in the order in which enough loops agreed.
  [[nodiscard]] const std::vector<LoopDispute>& disputes() const { return disputes_; }
  /// Removes the newest dispute, because the path was corrected for it.
  void remove_dispute() { disputes_.pop_back(); }
  [[nodiscard]] const places::Database& database() const { return database_; }

 private:
  static constexpr int kDisputePatience = 20;  ///< keyframes

  [[nodiscard]] std::vector<Loop> verify(const maps::Map& map, core::KeyframeId keyframe,
                                         const std::vector<places::Candidate>& candidates);
  void note_dispute(const maps::Map& map, core::KeyframeId keyframe, const std::vector<Loop>& far);
  void note_verdict(const PoseEdge& edge, const std::string& refused);
  void measure_correction(const maps::Map& map, LoopTrial& trial) const;
  [[nodiscard]] std::string judge(const maps::Map& map, LoopTrial& trial) const;
  void merge_duplicates(maps::Map& map, const PoseEdge& edge) const;

  LoopOptions options_;
  sensor::Pinhole camera_;
  places::Database database_;
  places::Recogniser recogniser_;
  core::KeyframeId last_;  ///< the keyframe before
  PendingLoops pending_;
  PendingLoops pending_disputes_{kDisputePatience};
  std::vector<LoopDispute> disputes_;
  std::shared_ptr<InterRobotLoops> others_;  ///< null: none are used
  LoopCounts counts_;
  std::vector<LoopTrial> trials_;
};

}  // namespace plumbline::mapping
