// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/loop_closing/place_verification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "loop_closing/place_bundle.hpp"
#include "loop_closing/place_matches.hpp"
#include "loop_closing/place_pose.hpp"
#include "loop_closing/place_surface.hpp"
#include "plumbline/features/line_match.hpp"
#include "plumbline/mapping/registration/local_map_alignment.hpp"
#include "plumbline/optimize/pose_solver.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "plumbline/tracking/association.hpp"
#include "plumbline/tracking/pose_terms.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using features::FrameFeatures;
using geometry::Matrix6d;
using geometry::Rigid3;

constexpr double kPointGate = 7.8;
constexpr double kLineGate = 9.2;
constexpr double kLineSigma_px = 1.0;
constexpr std::size_t kSurfaceKeyframes = 5;
constexpr double kSimilarFocals = 0.2;  // logarithm of their ratio: images of one scale

const FrameFeatures& features_of(const PlaceView& view) {
  static const FrameFeatures kNone;
  const auto& features = view.map->keyframe(view.keyframe).features;
  return features != nullptr ? *features : kNone;
}

/// Position of a feature of the match in its camera frame: that of its landmark, or else from its own depth.
/// False if neither is known.
bool point_in_space(const PlaceView& view, std::size_t feature, Eigen::Vector3d& point) {
  const core::PointId id = view.map->point_of(view.keyframe, static_cast<int>(feature));
  const features::PointFeature& f = features_of(view).points[feature];
  if (id.valid()) {
    point = view.map->camera_from_world(view.keyframe) * view.map->point(id).position;
    return true;
  }
  if (!(f.depth > 0.0F)) return false;
  point = view.camera.unproject(static_cast<double>(f.pixel.x()), static_cast<double>(f.pixel.y()),
                                static_cast<double>(f.depth));
  return true;
}

PosePairs pairs_by_descriptor(const PlaceView& query, const PlaceView& match,
                              const VerificationOptions& how) {
  const FrameFeatures& q = features_of(query);
  const FrameFeatures& m = features_of(match);
  PosePairs pairs;

  // Cameras with different focal lengths show the same corner in different octaves, so its
  // size in space is compared instead.
  const bool differ = std::abs(std::log(query.camera.fx / match.camera.fx)) > kSimilarFocals;
  std::optional<SizeGate> gate;
  if (differ) gate = size_gate(m, match.camera.fx, q, query.camera.fx, how.orb_scale_factor);

  for (const auto& [i, best] : alike_both_ways(m, q, gate ? &*gate : nullptr)) {
    PointPair pair;
    if (!point_in_space(match, i, pair.match)) continue;
    const features::PointFeature& f = q.points[best];
    pair.query = f.pixel.cast<double>();
    pair.sigma = std::pow(how.orb_scale_factor, f.octave);
    if (how.depth_rows) pair.depth = static_cast<double>(f.depth);
    pairs.points.push_back(pair);
  }

  // The limits are wide, because a place may be seen again from another distance and with a rolled camera.
  features::LineMatchOptions options;
  options.max_angle_rad = 1.0;
  options.min_length_ratio = 0.3;

  for (const features::LineMatch& l : features::match_lines(m.lines, q.lines, options)) {
    const features::LineFeature& from = m.lines[static_cast<std::size_t>(l.a)];
    const features::LineFeature& to = q.lines[static_cast<std::size_t>(l.b)];
    if (!from.line3) continue;

    LinePair pair;
    pair.match_start = from.line3->start;
    pair.match_end = from.line3->end;
    pair.query = to.segment;

    if (to.line3) {
      pair.in_space = true;
      pair.query_start = to.line3->start;
      pair.query_end = to.line3->end;
    }

    pairs.lines.push_back(pair);
  }

  return pairs;
}

/// The match first, then those that share most with it.
std::vector<KeyframeId> surroundings(const PlaceView& match, int neighbours) {
  std::vector<KeyframeId> result{match.keyframe};
  const auto add = [&](KeyframeId id) {
    if (static_cast<int>(result.size()) <= neighbours &&
        std::find(result.begin(), result.end(), id) == result.end()) {
      result.push_back(id);
    }
  };
  for (const KeyframeId id : match.map->neighbours(match.keyframe, static_cast<std::size_t>(neighbours)))
    add(id);
  for (const maps::SurfaceEdge& e : match.map->edges_of(match.keyframe))
    add(e.a == match.keyframe ? e.b : e.a);
  return result;
}

/// Landmarks of the surroundings found in the query's image, and the pose that follows.
class Growth {
 public:
  Growth(const PlaceView& query, const PlaceView& match, const VerificationOptions& options,
         const std::vector<KeyframeId>& around)
      : query_(query), match_(match) {
    points_ = match.map->points_seen_by(around);
    lines_ = match.map->lines_seen_by(around);
    problem.camera = query.camera;
    association_.scale_factor = options.orb_scale_factor;
    if (match.camera.fx != query.camera.fx) {
      const auto robots = static_cast<std::size_t>(match.keyframe.robot) + 1;
      association_.focals_px.assign(robots, match.camera.fx);
    }
    solver_.depth_rows = options.depth_rows;
  }

  /// Poses are of the query's camera in the match's world.
  void grow(Rigid3& camera_from_world, double radius) {
    const FrameFeatures& features = features_of(query_);
    visible_points.clear();
    visible_lines.clear();
    points = tracking::match_points(*match_.map, points_, {features, query_.camera, camera_from_world},
                                    radius, association_, &visible_points);
    lines = tracking::match_lines(*match_.map, lines_, {features, query_.camera, camera_from_world}, radius,
                                  association_, &visible_lines);
    problem.points = tracking::point_terms(*match_.map, points, features, association_);
    problem.lines = tracking::line_terms(*match_.map, lines, features, kLineSigma_px);

    // Outliers still affect the first pose by which they are judged, so they are removed in two rounds.
    for (int round = 0; round < 2; ++round) {
      summary = optimize::solve_pose(problem, camera_from_world, solver_);
      camera_from_world = summary.camera_from_world;
      tracking::keep_inliers(optimize::point_errors(problem, camera_from_world), kPointGate, points,
                             problem.points);
      tracking::keep_inliers(optimize::line_errors(problem, camera_from_world), kLineGate, lines,
                             problem.lines);
    }

    // The final pose and its information rest on the inliers alone.
    summary = optimize::solve_pose(problem, camera_from_world, solver_);
    camera_from_world = summary.camera_from_world;
  }

  [[nodiscard]] int cells() const {
    std::array<bool, 16> used{};
    const auto mark = [&](const Eigen::Vector2d& p) {
      const int x = std::clamp(static_cast<int>(4.0 * p.x() / query_.camera.width), 0, 3);
      const int y = std::clamp(static_cast<int>(4.0 * p.y() / query_.camera.height), 0, 3);
      used[static_cast<std::size_t>(4 * y + x)] = true;
    };
    for (const optimize::PointTerm& t : problem.points) mark(t.pixel);
    for (const optimize::LineTerm& t : problem.lines) {
      mark(t.start);
      mark(0.5 * (t.start + t.end));
      mark(t.end);
    }
    return static_cast<int>(std::count(used.begin(), used.end(), true));
  }

  optimize::PoseProblem problem;
  optimize::PoseSummary summary;
  std::vector<tracking::PointMatch> points;  ///< of problem
  std::vector<tracking::LineMatch> lines;    ///< of problem
  std::vector<core::PointId> visible_points;
  std::vector<core::LineId> visible_lines;

 private:
  const PlaceView& query_;
  const PlaceView& match_;
  tracking::AssociationOptions association_;
  optimize::PoseSolverOptions solver_;
  std::vector<core::PointId> points_;
  std::vector<core::LineId> lines_;
};

/// Bounds the information: errors that neighbouring features and samples share do not average out.
Matrix6d with_floor(const Matrix6d& information) {
  constexpr double kMetres = 0.006;
  constexpr double kRadians = 0.003;
  Matrix6d covariance = (information + 1e-3 * Matrix6d::Identity()).inverse();
  covariance.diagonal().head<3>().array() += kMetres * kMetres;
  covariance.diagonal().tail<3>().array() += kRadians * kRadians;
  const Matrix6d result = covariance.inverse();
  return 0.5 * (result + result.transpose());
}

/// Compares the surfaces of query and match with each other's depth. `near`: the match and the keyframes
/// around it.
void compare_surfaces(const PlaceView& query, const PlaceView& match, const std::vector<KeyframeId>& near,
                      PlaceVerification& result) {
  const maps::Keyframe& q = query.map->keyframe(query.keyframe);
  SurfaceVotes votes;
  const Rigid3& match_from_world = match.map->camera_from_world(match.keyframe);
  for (const KeyframeId id : near) {
    const Rigid3 query_from_id =
        result.query_from_match * match_from_world * match.map->camera_from_world(id).inverse();
    const maps::Keyframe& other = match.map->keyframe(id);
    if (other.features != nullptr && q.features != nullptr) {
      votes +=
          vote_surface(q.surface, query_from_id.inverse(), other.features->thumbnail_depth, match.camera);
      votes += vote_surface(other.surface, query_from_id, q.features->thumbnail_depth, query.camera);
    }
  }
  result.overlap = votes.overlap();
  result.contradiction = votes.contradiction();
}

/// Refines the pose by aligning the surfaces, too.
void align(const PlaceView& query, const PlaceView& match, const std::vector<KeyframeId>& near,
           PlaceVerification& result) {
  const maps::Keyframe& q = query.map->keyframe(query.keyframe);
  if (q.surface.empty()) return;

  const AlignmentOptions options;
  const cloud::SurfaceSearch theirs = search_of(gather_surface(*match.map, near, match.keyframe));
  const cloud::SurfaceSearch ours = search_of(q.surface);
  const SurfaceAlignment aligned = align_surfaces(theirs, ours, result.query_from_match, options);
  result.surface_shift_m = aligned.shift_m;
  result.surface_rms = aligned.rms;
  result.surface_aligned = aligned.refused.empty();
  if (!result.surface_aligned) return;

  // Both estimates together: first order about the features' one.
  const geometry::Vector6d xi = geometry::log_se3(aligned.b_from_a * result.query_from_match.inverse());
  const Matrix6d sum = result.information + aligned.information;
  result.query_from_match =
      geometry::exp_se3((sum + 1e-3 * Matrix6d::Identity()).ldlt().solve(aligned.information * xi)) *
      result.query_from_match;
  result.information = sum;
}

std::string judge(const PlaceVerification& v, const VerificationOptions& options) {
  if (v.points + 2 * v.lines < options.min_inliers) {
    return fmt::format("{} points and {} lines agree", v.points, v.lines);
  }
  const double evidence = (v.points + 2 * v.lines) * v.found;
  if (v.found < options.min_found || evidence < options.min_evidence)
    return fmt::format("{:.0f} % of the landmarks found", 100.0 * v.found);
  if (v.cells < options.min_cells) return fmt::format("matches in {} of 16 parts of the image", v.cells);
  if (v.contradiction > options.max_contradiction) {
    return fmt::format("{:.0f} % of the surface seen through", 100.0 * v.contradiction);
  }
  if (v.overlap < options.min_overlap)
    return fmt::format("{:.0f} % of the surface confirmed", 100.0 * v.overlap);
  return {};
}

}  // namespace

void VerificationOptions::declare(core::OptionTable& table) {
  table.integer("verify.min_inliers", min_inliers, {4, 10000}, "",
                "Smallest number of points that agree with a recognised place; lines count twice");
  table.number("verify.min_found", min_found, {0.0, 1.0}, "",
               "Smallest share of a place's landmarks in view that must be found");
  table.number("verify.min_evidence", min_evidence, {0.0, 1e6}, "",
               "Smallest product of agreeing points (lines twice) and the share found");
  table.integer("verify.min_cells", min_cells, {1, 16}, "",
                "Smallest number of parts of the image, of 16, with matches");
  table.number("verify.min_overlap", min_overlap, {0.0, 1.0}, "",
               "Smallest share of a place's surface in view that is confirmed");
  table.number("verify.max_contradiction", max_contradiction, {0.0, 1.0}, "",
               "Largest share of it in space that was seen to be free");
  table.integer("verify.rounds", rounds, {10, 100000}, "", "Largest number of RANSAC samples");
  table.boolean("verify.depth_rows", depth_rows, "Use the depth of points, too");
  table.boolean("verify.joint", joint, "Adjust landmarks together with the pose between two keyframes");
  table.boolean("verify.align", align, "Refine that pose by aligning surfaces");
}

PlaceVerification verify_place(const PlaceView& query, const PlaceView& match,
                               const VerificationOptions& options, std::uint64_t seed) {
  PlaceVerification result;
  const PosePairs pairs = pairs_by_descriptor(query, match, options);
  result.matched_points = static_cast<int>(pairs.points.size());
  result.matched_lines = static_cast<int>(pairs.lines.size());

  constexpr int kMinRansac = 10;
  const auto start = ransac_pose(pairs, query.camera, options.rounds, kMinRansac, seed);
  if (!start) {
    result.refused =
        fmt::format("no pose from {} points and {} lines", pairs.points.size(), pairs.lines.size());
    return result;
  }

  result.ransac_inliers = static_cast<int>(start->points.size() + start->lines.size());
  const std::vector<KeyframeId> around = surroundings(match, options.neighbours);
  Growth growth(query, match, options, around);
  const Rigid3& match_from_world = match.map->camera_from_world(match.keyframe);
  Rigid3 camera_from_world = start->query_from_match * match_from_world;
  for (const double radius : {15.0, 8.0, 5.0}) growth.grow(camera_from_world, radius);

  if (options.joint) {
    ObservationNoise noise;
    noise.orb_scale_factor = options.orb_scale_factor;
    noise.depth_rows = options.depth_rows;
    camera_from_world =
        adjust_pair(query, match, around, growth.points, growth.lines, noise, camera_from_world);
  }

  result.query_from_match = camera_from_world * match_from_world.inverse();
  result.points = static_cast<int>(growth.problem.points.size());
  result.lines = static_cast<int>(growth.problem.lines.size());
  result.visible_points = static_cast<int>(growth.visible_points.size());
  result.visible_lines = static_cast<int>(growth.visible_lines.size());

  const int visible = result.visible_points + 2 * result.visible_lines;
  result.found = visible > 0 ? static_cast<double>(result.points + 2 * result.lines) / visible : 0.0;
  result.cells = growth.cells();
  result.rms_px = growth.summary.points.rms;

  // The information of xi at the left of camera_from_world is that of query_from_match.
  result.information = growth.summary.information;
  const std::vector<KeyframeId> near(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(std::min(
                                                                          around.size(), kSurfaceKeyframes)));
  compare_surfaces(query, match, near, result);

  result.refused = judge(result, options);
  result.accepted = result.refused.empty();
  if (result.accepted && options.align) align(query, match, near, result);
  result.information = with_floor(result.information);
  return result;
}

}  // namespace plumbline::mapping
