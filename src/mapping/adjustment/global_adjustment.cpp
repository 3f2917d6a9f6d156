// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/adjustment/global_adjustment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plumbline/geometry/adjoint.hpp"
#include "plumbline/geometry/plucker.hpp"
#include "plumbline/mapping/adjustment/map_bundle.hpp"
#include "plumbline/optimize/pose_covariances.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Matrix6d;
using geometry::Rigid3;

/// Information between consecutive keyframes, from tracking. Weaker than landmarks and surfaces: it holds
/// keyframes that have neither or were taken while turning, and a corridor's unmeasured length.
Matrix6d chain_information() { return geometry::information_of(0.01, 0.007); }

/// Builds the bundle of a whole map. Several cameras become one: pixels are carried to the first robot's
/// camera, their standard deviations with them.
class GlobalBuilder {
 public:
  GlobalBuilder(const maps::Map& map, const Cameras& cameras, const GlobalAdjustmentOptions& options,
                KeyframeId anchor)
      : map_(map), cameras_(cameras), options_(options) {
    bundle_.problem.camera = cameras.at(anchor.robot);
    for (const KeyframeId id : map.keyframe_ids()) {
      index_.insert(id, static_cast<int>(bundle_.keyframes.size()));
      motion_factor_.push_back(options.noise.motion_factor_of(map.keyframe(id).turn_rate));
      bundle_.keyframes.push_back(id);
      bundle_.problem.poses.push_back({map.camera_from_world(id), id == anchor});
    }
  }

  void add_points() { add_seen_most(map_.point_ids()); }
  void add_lines() { add_seen_most(map_.line_ids()); }
  int add_surface_edges() {
    int count = 0;
    for (const KeyframeId id : bundle_.keyframes) {
      for (const maps::SurfaceEdge& edge : map_.edges_of(id)) {
        if (edge.b != id) continue;  // each edge once, at its newer end
        const double motion_factor2 = motion_factor(edge.a) * motion_factor(edge.b);
        add_edge(edge.a, edge.b, edge.b_from_a, options_.surface_weight / motion_factor2 * edge.information);
        ++count;
      }
    }
    return count;
  }
  void add_chain() {
    for (std::size_t i = 1; i < bundle_.keyframes.size(); ++i) {
      const KeyframeId a = bundle_.keyframes[i - 1];
      const KeyframeId b = bundle_.keyframes[i];
      if (a.robot != b.robot) continue;
      const double motion_factor2 = motion_factor(a) * motion_factor(b);
      add_edge(a, b, map_.camera_from_world(b) * map_.camera_from_world(a).inverse(),
               motion_factor2 * motion_factor2 * chain_information());
    }
  }
  void add_edge(KeyframeId a, KeyframeId b, const Rigid3& b_from_a, const Matrix6d& information) {
    bundle_.problem.edges.push_back({index_of(a), index_of(b), b_from_a, information});
  }
  MapBundle take() { return std::move(bundle_); }

 private:
  /// Adds as many landmarks as every keyframe needs, those seen most often first. A landmark is left out if
  /// all keyframes that see it have enough.
  template <typename Id>
  void add_seen_most(const std::vector<Id>& ids) {
    std::vector<std::pair<int, Id>> order;
    for (const Id id : ids) order.emplace_back(-static_cast<int>(map_.find(id)->observations.size()), id);
    std::sort(order.begin(), order.end());
    std::vector<int> tied(bundle_.keyframes.size(), 0);  // landmarks taken that a keyframe sees
    const auto tied_at = [&](const maps::Observation& o) -> int& {
      return tied[static_cast<std::size_t>(index_of(o.keyframe))];
    };

    for (const auto& [minus_seen, id] : order) {
      const std::vector<maps::Observation>& seen = map_.find(id)->observations;
      if (seen.size() < 2 || std::all_of(seen.begin(), seen.end(), [&](const maps::Observation& o) {
            return tied_at(o) >= options_.observations;
          })) {
        continue;
      }
      for (const maps::Observation& o : seen) ++tied_at(o);
      add(*map_.find(id));
    }
  }
  /// Among the problem's poses.
  [[nodiscard]] int index_of(KeyframeId id) const {
    const int* found = index_.find(id);
    if (found == nullptr) throw std::out_of_range("adjust_map: no such keyframe");
    return *found;
  }
  /// Factor on the standard deviations of a keyframe's measurements.
  [[nodiscard]] double motion_factor(KeyframeId id) const {
    return motion_factor_[static_cast<std::size_t>(index_of(id))];
  }
  /// A pixel converted to the problem's camera.
  [[nodiscard]] Eigen::Vector2d pixel(KeyframeId id, const Eigen::Vector2d& seen) const {
    const sensor::Pinhole& from = cameras_.at(id.robot);
    const sensor::Pinhole& to = bundle_.problem.camera;
    return {(seen.x() - from.cx) * (to.fx / from.fx) + to.cx,
            (seen.y() - from.cy) * (to.fy / from.fy) + to.cy};
  }
  /// Size of one pixel of the keyframe, in pixels of that camera.
  [[nodiscard]] double pixel_size(KeyframeId id) const {
    const sensor::Pinhole& from = cameras_.at(id.robot);
    const sensor::Pinhole& to = bundle_.problem.camera;
    return std::sqrt(to.fx * to.fy / (from.fx * from.fy));
  }

  void add(const maps::MapPoint& point) {
    const int index = static_cast<int>(bundle_.points.size());
    bundle_.points.push_back(point.id);
    bundle_.problem.points.push_back(point.position);
    for (const maps::Observation& o : point.observations) {
      const features::PointFeature& f =
          map_.keyframe(o.keyframe).features->points[static_cast<std::size_t>(o.feature)];
      optimize::BundlePointObservation seen = options_.noise.of(f, o.aligned, motion_factor(o.keyframe));
      seen.pose = index_of(o.keyframe);
      seen.point = index;
      seen.pixel = pixel(o.keyframe, seen.pixel);
      seen.pixel_sigma *= pixel_size(o.keyframe);
      bundle_.problem.point_observations.push_back(seen);
      bundle_.point_seen.push_back(o);
    }
  }
  void add(const maps::MapLine& line) {
    const int index = static_cast<int>(bundle_.lines.size());
    bundle_.lines.push_back(line.id);
    bundle_.problem.lines.push_back(geometry::line_through(line.start, line.end));
    for (const maps::Observation& o : line.observations) {
      const features::LineFeature& f =
          map_.keyframe(o.keyframe).features->lines[static_cast<std::size_t>(o.feature)];
      optimize::BundleLineObservation seen = options_.noise.of(f, motion_factor(o.keyframe));
      seen.pose = index_of(o.keyframe);
      seen.line = index;
      seen.start = pixel(o.keyframe, seen.start);
      seen.end = pixel(o.keyframe, seen.end);
      seen.pixel_sigma *= pixel_size(o.keyframe);
      bundle_.problem.line_observations.push_back(seen);
      bundle_.line_seen.push_back(o);
    }
  }

  const maps::Map& map_;
  const Cameras& cameras_;
  const GlobalAdjustmentOptions& options_;
  MapBundle bundle_;
  maps::IdMap<KeyframeId, int> index_;
  std::vector<double> motion_factor_;  ///< of the problem's poses
};

/// True if the poses may be put into the map; reports it if not.
bool may_move(const maps::Map& map, const KeyframePoses& poses, GlobalAdjustmentSummary& summary) {
  const auto wrong = contradiction(map, poses);
  if (!wrong) return true;
  ++summary.refused;
  summary.refusal = wrong->text();
  return false;
}

KeyframePoses poses_of(const MapBundle& bundle) {
  KeyframePoses poses;
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    poses.emplace_back(bundle.keyframes[i], bundle.problem.poses[i].camera_from_world);
  }
  return poses;
}

void put_back(const MapBundle& bundle, maps::Map& map) {
  move_keyframes(map, poses_of(bundle));  // landmarks left out of the bundle move along
  put_back_landmarks(bundle, map);
  drop_outliers(bundle, map);
}

void run_pose_graph(maps::Map& map, const std::vector<PoseEdge>& extra,
                    const GlobalAdjustmentOptions& options, KeyframeId anchor,
                    GlobalAdjustmentSummary& summary) {
  const MapGraphResult graph = solve_map_graph(map, extra, options.robust, anchor);
  summary.message = graph.summary.message;
  if (!graph.summary.usable) return;
  summary.extra = graph.summary.edges;
  for (const optimize::EdgeVerdict& verdict : summary.extra) summary.rejected += verdict.rejected ? 1 : 0;
  if (!may_move(map, graph.poses, summary)) return;
  move_keyframes(map, graph.poses);
  summary.changed = true;
}

/// Bundle of the whole map with the edges of `extra`. `surface_edges`: number of other edges.
MapBundle bundle_of(const maps::Map& map, const Cameras& cameras, const std::vector<PoseEdge>& extra,
                    const GlobalAdjustmentOptions& options, KeyframeId anchor, int& surface_edges) {
  GlobalBuilder builder(map, cameras, options, anchor);
  builder.add_points();
  builder.add_lines();
  surface_edges = builder.add_surface_edges();
  builder.add_chain();
  for (const PoseEdge& edge : extra) builder.add_edge(edge.a, edge.b, edge.b_from_a, edge.information);
  return builder.take();
}

void run_bundle(maps::Map& map, const Cameras& cameras, const std::vector<PoseEdge>& extra,
                const GlobalAdjustmentOptions& options, KeyframeId anchor, GlobalAdjustmentSummary& summary) {
  const std::vector<PoseEdge> believed = believed_edges(extra, summary.extra);
  MapBundle bundle = bundle_of(map, cameras, believed, options, anchor, summary.surface_edges);
  summary.points = static_cast<int>(bundle.points.size());
  summary.lines = static_cast<int>(bundle.lines.size());
  optimize::BundleOptions bundle_options = options.bundle_options;
  if (!extra.empty()) bundle_options.first_gate = options.first_gate;
  summary.bundle = optimize::adjust_map_bundle(bundle.problem, bundle_options);
  summary.message = summary.bundle.message;
  if (!summary.bundle.usable || !may_move(map, poses_of(bundle), summary)) return;
  put_back(bundle, map);
  summary.changed = true;
}

/// Says how many keyframes nothing relates to the anchor; empty: none.
std::string unknown_text(const std::vector<KeyframeAccuracy>& keyframes) {
  const auto is_unknown = [](const KeyframeAccuracy& k) { return !k.covariance.allFinite(); };
  const auto first = std::find_if(keyframes.begin(), keyframes.end(), is_unknown);
  if (first == keyframes.end()) return {};
  return fmt::format(
      "nothing relates {} of {} keyframes to the first one in all directions, keyframe {} among them",
      std::count_if(first, keyframes.end(), is_unknown), keyframes.size(), first->keyframe.index);
}

/// Standard deviations as large as the factors make them.
void widen(const SigmaFactors& factors, optimize::BundleProblem& problem) {
  for (optimize::BundlePointObservation& o : problem.point_observations) {
    o.pixel_sigma *= factors.points;
    o.depth_sigma *= factors.points;
  }
  for (optimize::BundleLineObservation& o : problem.line_observations) {
    o.pixel_sigma *= factors.lines;
    o.start_sigma *= factors.lines;
    o.end_sigma *= factors.lines;
  }
  for (optimize::BundleEdge& edge : problem.edges) edge.information /= factors.edges * factors.edges;
}

}  // namespace

GlobalAdjustmentOptions::GlobalAdjustmentOptions() {
  // Scatter at true poses. Lines that are off by more are so for a reason, such as a shadow along an edge,
  // and all alike in neighbouring views: small deviations count fully, large ones are held down.
  noise.aligned = 0.15;
  noise.line_sigma_px = 0.1;
  bundle_options.max_iterations = 10;
  bundle_options.rounds = 2;
  // The relative poses of several robots' rooms move last: from a region of 1e4 they are short of the minimum
  // when the iterations end (docs/notes/2026-11-24-merging.md).
  bundle_options.first_radius = 1e7;
  bundle_options.point_loss = 1.0;  // as in bundles while mapping: lone wrong matches count less
  bundle_options.line_loss = 1.0;
  sigma_factors = {0.71, 0.71, 2.0};  // docs/notes/2026-11-24-refinement.md
}

void GlobalAdjustmentOptions::declare(core::OptionTable& table) {
  table.integer("adjust.observations", observations, {10, 100000}, "",
                "Largest number of points, and of lines, per keyframe in the adjustment");
  table.integer("adjust.iterations", bundle_options.max_iterations, {1, 1000}, "",
                "Largest number of iterations in each round of the adjustment");
  table.number(
      "adjust.gate", first_gate, {0.0, 1000.0}, "",
      "Observations off by more than this many standard deviations, and 0.8 px, after the pose graph wait "
      "for the second round, because those that caused a drift would restore it; 0: none");
  table.number("adjust.aligned_sigma", noise.aligned, {0.01, 1.0}, "",
               "Standard deviation of aligned corners relative to others");
  noise.declare(table, "adjust.");
  table.number("adjust.surface_weight", surface_weight, {0.0, 1000.0}, "",
               "Weight of the map's surface edges");
  table.choice<bool>("adjust.robust", robust, {{"none", false}, {"graduated", true}},
                     "Treatment of wrong edges in the pose graph; graduated: graduated non-convexity");
}

std::vector<PoseEdge> believed_edges(const std::vector<PoseEdge>& edges,
                                     const std::vector<optimize::EdgeVerdict>& verdicts) {
  std::vector<PoseEdge> believed;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (verdicts.empty() || !verdicts[i].rejected) believed.push_back(edges[i]);
  }
  return believed;
}

GlobalAdjustmentSummary adjust_map(maps::Map& map, const Cameras& cameras, const std::vector<PoseEdge>& extra,
                                   const GlobalAdjustmentOptions& options, KeyframeId anchor) {
  GlobalAdjustmentSummary summary;
  const std::vector<KeyframeId> ids = map.keyframe_ids();
  summary.keyframes = static_cast<int>(ids.size());

  if (ids.size() < 2) {
    summary.message = "fewer than two keyframes: nothing to adjust";
    return summary;
  }

  if (!anchor.valid()) anchor = ids.front();
  std::vector<Rigid3> before;
  for (const KeyframeId id : ids) before.push_back(map.camera_from_world(id));

  // The pose graph comes first: it removes drift, from which bundle adjustment alone would not
  // recover, and rejects wrong edges.
  if (options.pose_graph && !extra.empty()) run_pose_graph(map, extra, options, anchor, summary);
  if (options.bundle) run_bundle(map, cameras, extra, options, anchor, summary);

  // Shifts are measured between camera centres, because the translation of camera_from_world
  // also changes with the rotation.
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const double shift =
        (before[i].inverse().translation - map.camera_from_world(ids[i]).inverse().translation).norm();
    summary.mean_shift_m += shift / static_cast<double>(ids.size());
    summary.max_shift_m = std::max(summary.max_shift_m, shift);
  }

  return summary;
}

MapAccuracy keyframe_accuracy(const maps::Map& map, const Cameras& cameras,
                              const std::vector<PoseEdge>& extra, const GlobalAdjustmentOptions& options,
                              KeyframeId anchor) {
  const std::vector<KeyframeId> ids = map.keyframe_ids();
  if (ids.empty()) return {{}, "the map has no keyframes"};

  int unused = 0;
  MapBundle bundle = bundle_of(map, cameras, extra, options, anchor.valid() ? anchor : ids.front(), unused);

  // Residuals of neighbouring observations are correlated: taken as independent they would make
  // the covariances far too small.
  widen(options.sigma_factors, bundle.problem);
  const optimize::PoseCovariances covariances =
      optimize::pose_covariances(bundle.problem, options.bundle_options);
  if (covariances.of_pose.empty()) return {{}, covariances.missing};

  MapAccuracy result;
  std::vector<KeyframeAccuracy>& keyframes = result.keyframes;
  keyframes.resize(ids.size());

  for (std::size_t i = 0; i < ids.size(); ++i) {
    keyframes[i].keyframe = ids[i];
    keyframes[i].covariance = covariances.of_pose[i];
    keyframes[i].edges = static_cast<int>(
        map.edges_of(ids[i]).size() +
        static_cast<std::size_t>(std::count_if(
            extra.begin(), extra.end(), [&](const PoseEdge& e) { return e.a == ids[i] || e.b == ids[i]; })));
  }

  // The numbers of observations show on which evidence an accuracy rests.
  for (const auto& o : bundle.problem.point_observations)
    ++keyframes[static_cast<std::size_t>(o.pose)].points;
  for (const auto& o : bundle.problem.line_observations) ++keyframes[static_cast<std::size_t>(o.pose)].lines;
  result.missing = unknown_text(keyframes);
  return result;
}

}  // namespace plumbline::mapping
