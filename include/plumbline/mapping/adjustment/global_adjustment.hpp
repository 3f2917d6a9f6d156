// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The whole map in one optimisation: all keyframes, points and lines, the surface edges of the map, and edges
// from elsewhere (aligned local maps, closed loops, overlaps of robots). First a pose graph, which removes
// drift and rejects wrong edges; then bundle adjustment with the remaining edges (docs/method/refinement.md).
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/mapping/adjustment/observation_noise.hpp"
#include "plumbline/mapping/adjustment/tracked_path.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"
#include "plumbline/optimize/pose_graph.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

/// The camera of each robot that has keyframes in the map.
using Cameras = std::map<std::int32_t, sensor::Pinhole>;

/// Measured pose of keyframe b relative to keyframe a. The information of xi = log(b_from_a_estimate *
/// b_from_a^-1), xi = (rho, phi) in metres and radians, may be singular.
struct PoseEdge {
  core::KeyframeId a;
  core::KeyframeId b;
  geometry::Rigid3 b_from_a;
  geometry::Matrix6d information = geometry::Matrix6d::Zero();
  bool trusted = false;  ///< never rejected
};

/// Relative poses of keyframes in the map now: of each to its predecessor of the same robot, to those it
/// shares at least `min_shared` landmarks with (at most `max_neighbours`), and to those its surface is
/// aligned with. All are trusted; the information grows with what they share. They are the body of a pose
/// graph.
std::vector<PoseEdge> map_edges(const maps::Map& map, int min_shared = 30, int max_neighbours = 6);

/// Covariance of the map's own path from keyframe `a` to `b` of one robot, if the errors from one keyframe to
/// the next were independent: of log(b_from_a_estimate * b_from_a^-1).
geometry::Matrix6d path_covariance(const maps::Map& map, core::KeyframeId a, core::KeyframeId b);

/// The loops of the map that were closed: edges that may be rejected.
std::vector<PoseEdge> loop_edges(const maps::Map& map);
/// Makes these the map's loops. Throws as maps::Map::set_loops.
void set_loops(maps::Map& map, const std::vector<PoseEdge>& edges);

struct MapGraphResult {
  KeyframePoses poses;                 ///< all keyframes, by id
  optimize::PoseGraphSummary summary;  ///< its edges: those of `extra`, in their order
};

/// Pose graph of map_edges(map) and `extra`. `anchor` is held (an invalid id: the map's first keyframe). The
/// map is not changed. Edges of `extra` between keyframes that the map does not hold throw std::out_of_range.
MapGraphResult solve_map_graph(const maps::Map& map, const std::vector<PoseEdge>& extra, bool robust,
                               core::KeyframeId anchor = {});

/// Keyframe poses that follow from trusted relative poses, by id; the map's first keyframe is held. Empty if
/// the graph could not be solved.
KeyframePoses solve_trusted_graph(const maps::Map& map, const std::vector<PoseEdge>& edges);

/// Gives keyframes new poses; points and lines follow the keyframes that see them (mean over these).
void move_keyframes(maps::Map& map, const KeyframePoses& poses);

/// Factors on the standard deviations of each kind of observation for covariances: residuals of neighbours
/// are correlated, so many of them weigh less than as many independent ones (docs/method/refinement.md
/// explains the numbers).
struct SigmaFactors {
  double points = 1.0;
  double lines = 1.0;
  double edges = 1.0;  ///< of surfaces, alignments and loops, and from one keyframe to the next
};

struct GlobalAdjustmentOptions {
  bool pose_graph = true;  ///< before bundle adjustment, when there are edges besides the map's own
  bool bundle = true;
  int observations = 250;  ///< largest number of points and lines per keyframe; those seen most often
  ObservationNoise noise;
  double surface_weight = 0.3;  ///< of the map's surface edges: their samples are alike from one to the next
  /// Standard deviations. Where a tracker slid along a wall, it is the landmarks of that moment that agree on
  /// it, all alike: in a bundle they would undo what edges from elsewhere have corrected. What is further off
  /// than this, and 0.8 px, at the poses of the graph waits for the second round (optimize::BundleOptions);
  /// 0: none waits.
  double first_gate = 3.0;
  bool robust = true;  ///< the pose graph puts wrong edges aside (optimize::solve_pose_graph)
  optimize::BundleOptions bundle_options;
  SigmaFactors sigma_factors;
  GlobalAdjustmentOptions();
  void declare(core::OptionTable& table);
};

struct GlobalAdjustmentSummary {
  int keyframes = 0;
  int points = 0;  ///< adjusted; the others follow their keyframes
  int lines = 0;
  int surface_edges = 0;
  std::vector<optimize::EdgeVerdict> extra;  ///< of each edge of `extra`; empty when no pose graph was solved
  int rejected = 0;                          ///< edges of `extra` that were rejected
  optimize::BundleSummary bundle;
  double mean_shift_m = 0.0;  ///< mean motion of the keyframes
  double max_shift_m = 0.0;
  bool changed = false;  ///< the map was moved
  int refused = 0;       ///< solutions that contradicted what the tracker had measured
  std::string refusal;   ///< connection that the last of these would have torn
  std::string message;   ///< reason for no change, or the solver's message
};

/// Edges that are not rejected by the pose graph's verdicts; all of them if there are no verdicts.
std::vector<PoseEdge> believed_edges(const std::vector<PoseEdge>& edges,
                                     const std::vector<optimize::EdgeVerdict>& verdicts);

/// Moves all keyframes and landmarks of the map to where everything fits best, and takes observations that do
/// not fit out of it. `anchor` stays where it is (an invalid id: the map's first keyframe). The same input
/// gives the same bytes. Every robot of the map must have a camera (throws std::out_of_range).
GlobalAdjustmentSummary adjust_map(maps::Map& map, const Cameras& cameras, const std::vector<PoseEdge>& extra,
                                   const GlobalAdjustmentOptions& options, core::KeyframeId anchor = {});

/// Accuracy of a keyframe's pose relative to the anchor's.
struct KeyframeAccuracy {
  core::KeyframeId keyframe;
  /// Covariance of (rho, phi) in Exp(rho, phi) camera_from_world, metres and radians; NaN in the rows and
  /// columns of a position or a rotation that nothing relates to the anchor's.
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  int points = 0;  ///< observations that hold it
  int lines = 0;
  int edges = 0;  ///< of its surface, alignments and loops

  /// Root of the covariance's trace; NaN: not known.
  [[nodiscard]] double sigma_position_m() const {
    return std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  }
  [[nodiscard]] double sigma_rotation_rad() const {
    return std::sqrt(covariance.bottomRightCorner<3, 3>().trace());
  }
};

/// Accuracy of the keyframes of a map, by id.
struct MapAccuracy {
  std::vector<KeyframeAccuracy> keyframes;  ///< empty: not known
  std::string missing;  ///< why that of some or all keyframes is not known; empty: all are known
};

/// Accuracy of the keyframes of a map that adjust_map has left with the same `extra` (except rejected edges):
/// from its observations, their noise scaled by SigmaFactors. For its limits see optimize::pose_covariances.
MapAccuracy keyframe_accuracy(const maps::Map& map, const Cameras& cameras,
                              const std::vector<PoseEdge>& extra, const GlobalAdjustmentOptions& options,
                              core::KeyframeId anchor = {});

}  // namespace plumbline::mapping
