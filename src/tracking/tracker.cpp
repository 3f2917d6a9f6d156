// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/tracker.hpp"

#include <algorithm>
#include <cmath>

#include "held_directions.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "plumbline/tracking/align_points.hpp"

namespace plumbline::tracking {

using geometry::Rigid3;
using geometry::Vector6d;

namespace {

constexpr double kPointGate = 7.8;  // chi-square, 2 degrees of freedom, 98 %
constexpr double kLineGate = 9.2;   // 99 %: line ends are less exact than corners
constexpr double kDoubt = 0.75;     // of a change of motion in directions that hardly anything else holds

std::vector<optimize::PointTerm> point_terms(const maps::Map& map, const std::vector<PointMatch>& matches,
                                             const features::FrameFeatures& features,
                                             const AssociationOptions& options) {
  std::vector<optimize::PointTerm> terms;
  terms.reserve(matches.size());
  for (const PointMatch& match : matches) {
    const features::PointFeature& f = features.points[static_cast<std::size_t>(match.feature)];
    optimize::PointTerm term;
    term.world = map.point(match.point).position;
    term.pixel = (f.pixel + match.shift).cast<double>();
    term.pixel_sigma =
        std::pow(options.scale_factor, f.octave) * (match.aligned ? options.aligned_sigma : 1.0);
    const float depth = features.depth_beside(static_cast<std::size_t>(match.feature), match.shift);
    if (depth > 0.0F) {
      term.depth = static_cast<double>(depth);
      // The landmark's own depth is no better than the measurement.
      term.depth_sigma = std::sqrt(2.0) * sensor::depth_sigma(term.depth);
    }
    terms.push_back(term);
  }
  return terms;
}

std::vector<optimize::LineTerm> line_terms(const maps::Map& map, const std::vector<LineMatch>& matches,
                                           const features::FrameFeatures& features) {
  std::vector<optimize::LineTerm> terms;
  terms.reserve(matches.size());
  for (const LineMatch& match : matches) {
    const maps::MapLine& line = map.line(match.line);
    const features::LineSegment& s = features.lines[static_cast<std::size_t>(match.feature)].segment;
    optimize::LineTerm term;
    term.world = geometry::line_through(line.start, line.end);
    term.start = s.start.cast<double>();
    term.end = s.end.cast<double>();
    term.pixel_sigma = 0.6;
    terms.push_back(term);
  }
  return terms;
}

/// Keeps what fits at the estimated pose.
template <typename Match, typename Term>
void drop_outliers(const std::vector<double>& errors, double gate, std::vector<Match>& matches,
                   std::vector<Term>& terms) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!(errors[i] <= gate)) continue;
    matches[kept] = matches[i];
    terms[kept] = terms[i];
    ++kept;
  }
  matches.resize(kept);
  terms.resize(kept);
}

/// What is left of a frame's features once it is tracked: corners lie where they were aligned.
Tracker::Features without_picture(const features::FrameFeatures& features,
                                  const std::vector<PointMatch>& matches, const sensor::Pinhole& camera) {
  auto kept = std::make_shared<features::FrameFeatures>(features);
  kept->levels.clear();
  kept->photometric.reset();
  for (const PointMatch& m : matches) {
    if (m.aligned) kept->move_point(static_cast<std::size_t>(m.feature), m.shift);
  }
  kept->grid = features::PointGrid(kept->points, camera.width, camera.height);
  return kept;
}

}  // namespace

const char* to_string(TrackState state) {
  switch (state) {
    case TrackState::kInitialising:
      return "initialising";
    case TrackState::kTracked:
      return "tracked";
    case TrackState::kLost:
      return "lost";
  }
  return "";
}

void TrackerOptions::declare(core::OptionTable& table) {
  table.boolean("points", points, "Track ORB points, and look for a lost place by them");
  table.boolean("lines", lines, "Track lines");
  table.boolean("depth", depth, "Align depth with the surfaces of the local map");
  table.boolean("photometric", photometric, "Align grey values with keyframes directly");
  table.boolean("align_stamps", align_stamps,
                "Bring colour and depth stamped apart together with the motion model");
  table.boolean("thumbnails", thumbnails, "Small pictures tell where the camera may be");
  table.boolean("motion_prior", motion_prior, "The motion model holds what measurements leave open");
  table.boolean(
      "pnp_start", pnp_start,
      "Every frame begins with PnP over descriptors, where these are enough, not with the motion model");
  table.number(
      "readout", readout_s, {0.0, 0.1}, "s",
      "Rolling shutter: time from the first to the last row of a picture; 0: as the camera's file says");
  table.integer("min_inliers", min_inliers, {3, 1000}, "", "Features that a pose must explain to be trusted");
  table.integer("min_surface", min_surface, {10, 100000}, "",
                "Depth samples that a pose without enough features must explain");
  association.declare(table);
  local_map.declare(table);
  solver.declare(table);
}

Tracker::Tracker(const TrackerOptions& options, const sensor::Pinhole& camera)
    : options_(options), camera_(camera) {}

Rigid3 Tracker::predict(double stamp) const {
  const double dt = std::clamp(stamp - last_.stamp, 0.0, 0.2);
  return geometry::exp_se3(velocity_ * dt) * last_.camera_from_world;
}

Rigid3 Tracker::depth_from_camera(const sensor::RgbdFrame& frame) const {
  const double dt = frame.depth_stamp - frame.stamp;
  if (!options_.align_stamps || std::abs(dt) > 0.05) return {};
  return geometry::exp_se3(velocity_ * dt);
}

TrackResult Tracker::estimate(const maps::Map& map, const sensor::RgbdFrame& frame,
                              const features::FrameFeatures& features, const Rigid3& guess,
                              double radius) const {
  TrackResult result;
  Rigid3 pose = guess;
  const Rigid3 depth_from_colour = depth_from_camera(frame);
  result.depth_from_camera = depth_from_colour;
  // After a relocalisation the past says nothing.
  const Rigid3 predicted = last_.valid && lost_frames_ == 0 ? predict(frame.stamp) : guess;
  optimize::PoseProblem problem;
  problem.camera = camera_;
  SurfaceAssociationOptions surface;
  optimize::PoseSolverOptions solver = options_.solver;

  // Coarse: features within the radius, few surface samples, wide gates; then fine.
  struct Round {
    double radius;
    double surface_distance;
    int surface_samples;
    std::size_t photometric_level;
    bool rematch;
    bool gate;
  };
  const Round rounds[] = {{radius, 0.15, 500, 1, true, false},
                          {radius, 0.08, 700, 1, false, false},
                          {kFineRadius_px, 0.05, 1200, 0, true, true},
                          {kFineRadius_px, 0.03, 2400, 0, false, true},
                          {kFineRadius_px, 0.03, 2400, 0, false, false}};
  constexpr std::size_t kFine = 2;  // the first of the fine rounds
  const PhotometricView view{features.photometric.get(), &frame.depth, depth_from_colour, camera_};
  bool stiff = !motion_refuted_;
  bool surface_alone = false;
  std::optional<std::size_t> level_of_grey;  // what problem.photometric was made for
  const auto see_grey = [&](std::size_t level) {
    const bool again =
        level_of_grey == level && problem.photometric && settle_photometric(*problem.photometric, pose);
    if (!again) problem.photometric = photometric_family(map, view, level, pose);
    level_of_grey = level;
  };
  const auto run = [&](const Round& round) {
    if (round.rematch) {
      result.visible_points.clear();
      result.visible_lines.clear();
      if (options_.points) {
        result.points = match_points(map, local_map_.points, features, camera_, pose, round.radius,
                                     options_.association, &result.visible_points);
        if (options_.association.align && round.gate)
          align_points(map, features, camera_, pose, options_.association.scale_factor, result.points);
        problem.points = point_terms(map, result.points, features, options_.association);
      }
      if (options_.lines) {
        result.lines = match_lines(map, local_map_.lines, features, camera_, pose, round.radius,
                                   options_.association, &result.visible_lines);
        problem.lines = line_terms(map, result.lines, features);
      }
    }
    if (options_.depth) {
      surface.max_distance_m = round.surface_distance;
      surface.max_samples = round.surface_samples;
      problem.planes = associate_surface(local_map_.surface, frame.depth, camera_, pose, depth_from_colour,
                                         surface, &result.surface_in_view);
    }
    if (options_.photometric) see_grey(round.photometric_level);
    solver.max_iterations = 4;
    result.estimate = optimize::solve_pose(problem, pose, solver);
    if (problem.photometric && !photometric_agrees(*problem.photometric, result.estimate.camera_from_world)) {
      problem.photometric.reset();
      result.estimate = optimize::solve_pose(problem, pose, solver);
    }
    pose = result.estimate.camera_from_world;
    surface_alone = uses_features() && !problem.photometric &&
                    result.estimate.points.inliers + 2 * result.estimate.lines.inliers < options_.min_inliers;
    const Motion motion = !stiff                      ? Motion::kUnknown
                          : surface_alone             ? Motion::kAlone
                          : knows_motion(frame.stamp) ? Motion::kLikely
                                                      : Motion::kUnknown;
    if (options_.motion_prior) problem.prior = motion_prior(result.estimate.information, predicted, motion);
    if (round.gate) {
      drop_outliers(optimize::point_errors(problem, pose), kPointGate, result.points, problem.points);
      drop_outliers(optimize::line_errors(problem, pose), kLineGate, result.lines, problem.lines);
    }
  };
  for (std::size_t i = radius > 0.0 ? 0 : kFine; i < std::size(rounds); ++i) run(rounds[i]);
  if (stiff && surface_alone && problem.prior && refutes_motion(problem, result.estimate, predicted, pose)) {
    stiff = false;
    for (std::size_t i = kFine; i < std::size(rounds); ++i) run(rounds[i]);
  }
  result.motion_refuted =
      surface_alone && !stiff && !motion_prior(result.estimate.information, predicted, Motion::kUnknown);
  result.camera_from_world = pose;
  judge(std::move(problem), result);
  return result;
}

TrackResult Tracker::track(const maps::Map& map, const sensor::RgbdFrame& frame, const Features& features) {
  TrackResult result;
  if (map.keyframe_count() == 0) {
    result.state = TrackState::kInitialising;
    result.features = without_picture(*features, {}, camera_);
    result.photometric = features->photometric;
    remember(frame, *features, result);
    return result;
  }
  const Features still = at_one_moment(frame, features, turning());
  std::optional<TrackResult> found = stale() ? by_picture(map, frame, *still) : by_motion(map, frame, *still);
  if (!found) found = stale() ? by_motion(map, frame, *still) : by_picture(map, frame, *still);
  if (!found) {
    result.state = TrackState::kLost;
    result.camera_from_world = predict(frame.stamp);
    ++lost_frames_;
    velocity_ *= 0.8;
    return result;
  }
  found->features = still;
  settle_shutter(map, frame, features, *found);
  found->continuous = knows_motion(frame.stamp);
  found->photometric = found->features->photometric;
  found->features = without_picture(*found->features, found->points, camera_);
  remember(frame, *found->features, *found);
  return *std::move(found);
}

/// The motion model lags behind a turn that changes. Now that the pose is known, so is the turn: where the
/// difference can be seen, the pose is estimated once more.
void Tracker::settle_shutter(const maps::Map& map, const sensor::RgbdFrame& frame, const Features& features,
                             TrackResult& found) const {
  constexpr double kVisible_px = 1.0;  // at the first and the last row
  const double dt = frame.stamp - last_.stamp;
  if (options_.readout_s == 0.0 || !last_.valid || lost_frames_ > 0 || dt < 1e-4 || dt > 0.5) return;
  const Eigen::Vector3d mean =
      geometry::log_so3((found.camera_from_world * last_.camera_from_world.inverse()).rotation) / dt;
  // Both are means of their steps: half a step on.
  const Eigen::Vector3d before = turning();
  const Eigen::Vector3d now = before.isZero(0.0) ? mean : Eigen::Vector3d(mean + 0.5 * (mean - before));
  if ((now - before).norm() * 0.5 * options_.readout_s * camera_.fx < kVisible_px) return;
  const Features still = at_one_moment(frame, features, now);
  TrackResult again = estimate(map, frame, *still, found.camera_from_world, kFineRadius_px);
  if (again.state != TrackState::kTracked) return;
  again.relocalised = found.relocalised;
  again.features = still;
  found = std::move(again);
}

void Tracker::remember(const sensor::RgbdFrame& frame, const features::FrameFeatures& features,
                       const TrackResult& result) {
  const double dt = frame.stamp - last_.stamp;
  if (last_.valid && lost_frames_ == 0 && dt > 1e-4 && dt < 0.5) {
    const bool known = knows_motion(frame.stamp);
    const Vector6d before = velocity_;
    velocity_ = geometry::log_se3(result.camera_from_world * last_.camera_from_world.inverse()) / dt;
    // Where little but the motion model holds the camera, steps are noise above all, and would run away with
    // it.
    if (known && !result.motion_refuted) velocity_ -= kDoubt * (result.unheld * (velocity_ - before));
    ++steps_;
    step_s_ = dt;
  } else {
    stand();
  }
  coasting_s_ = result.held_by_motion && last_.valid ? coasting_s_ + dt : 0.0;
  motion_refuted_ = result.motion_refuted;
  lost_frames_ = 0;
  last_.stamp = frame.stamp;
  last_.camera_from_world = result.camera_from_world;
  last_.thumbnail = features.thumbnail;
  last_.thumbnail_depth = features.thumbnail_depth;
  last_.valid = true;
}

void Tracker::restore(const maps::Map& map, core::KeyframeId reference, const Rigid3& camera_from_world,
                      const Vector6d& velocity) {
  map_changed(map, reference, camera_from_world);
  const maps::Keyframe& keyframe = map.keyframe(reference);
  last_.stamp = keyframe.stamp;
  if (keyframe.features != nullptr) {
    last_.thumbnail = keyframe.features->thumbnail;
    last_.thumbnail_depth = keyframe.features->thumbnail_depth;
  }
  last_.valid = keyframe.features != nullptr;
  velocity_ = velocity;
  steps_ = 2;
  step_s_ = 0.2;  // not known: any that predict() looks ahead
  lost_frames_ = 0;
}

void Tracker::map_changed(const maps::Map& map, core::KeyframeId reference,
                          const Rigid3& last_camera_from_world) {
  local_map_ = build_local_map(map, reference, options_.local_map);
  last_.camera_from_world = last_camera_from_world;
}

}  // namespace plumbline::tracking
