// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/camera_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "plumbline/geometry/velocity.hpp"
#include "plumbline/mapping/observation_noise.hpp"

namespace plumbline::mapping {
namespace {

using optimize::CalibrationObservation;
using optimize::CalibrationProblem;
using optimize::CameraChange;
using optimize::CameraUnknown;
using optimize::kCameraUnknowns;
using FreeUnknowns = std::array<bool, kCameraUnknowns>;

constexpr int kParts = 4;
constexpr int kLeastKeyframes = 8;
constexpr int kLeastViews = 3;
constexpr int kLeastObservations = 300;

/// Everything that was seen; problems are made of parts of it.
struct Observations {
  struct Point {
    Eigen::Vector3d position;
    std::vector<CalibrationObservation> seen;  ///< `pose` counts the keyframes here; `point` is not set
  };
  std::vector<optimize::CalibrationPose> poses;
  std::vector<int> part;  ///< of each pose
  std::vector<int> run;   ///< whose it is
  std::vector<Point> points;
};

/// Stretches of neighbouring keyframes, one of each part, where there are more than are wanted.
std::vector<std::pair<core::KeyframeId, int>> chosen(const maps::Map& map, int wanted) {
  const std::vector<core::KeyframeId> ids = map.keyframe_ids();
  const int count = static_cast<int>(ids.size());
  std::vector<std::pair<core::KeyframeId, int>> result;
  for (int part = 0; part < kParts; ++part) {
    const int begin = count * part / kParts;
    const int end = count * (part + 1) / kParts;
    const int few = std::min(end - begin, std::max(1, wanted / kParts));
    for (int i = begin; i < begin + few; ++i) result.emplace_back(ids[static_cast<std::size_t>(i)], part);
  }
  return result;
}

void add_run(const CalibrationRun& run, int number, int wanted, const sensor::Camera& camera,
             Observations& to) {
  const geometry::Trajectory path = maps::trajectory(*run.frames, *run.map);
  const ObservationNoise noise;
  std::map<core::KeyframeId, int> index;
  for (const auto& [id, part] : chosen(*run.map, wanted)) {
    index[id] = static_cast<int>(to.poses.size());
    optimize::CalibrationPose pose;
    pose.camera_from_world = run.map->camera_from_world(id);
    pose.velocity = geometry::velocity_at(path, run.map->keyframe(id).stamp);
    to.poses.push_back(pose);
    to.part.push_back(part);
    to.run.push_back(number);
  }
  for (const core::PointId id : run.map->point_ids()) {
    const maps::MapPoint& point = run.map->point(id);
    Observations::Point observation{point.position, {}};
    for (const maps::Observation& o : point.observations) {
      const auto pose = index.find(o.keyframe);
      if (pose == index.end()) continue;
      const features::PointFeature& f =
          run.map->keyframe(o.keyframe).features->points[static_cast<std::size_t>(o.feature)];
      const optimize::BundlePointObservation in_bundle = noise.of(f, o.aligned);
      CalibrationObservation seen;
      seen.pose = pose->second;
      seen.pixel = optimize::distorted_pixel(camera, in_bundle.pixel);
      seen.pixel_sigma = in_bundle.pixel_sigma;
      seen.depth = in_bundle.depth;
      seen.depth_sigma = in_bundle.depth_sigma;
      seen.ray =
          camera.color.unproject(static_cast<double>(f.pixel.x()), static_cast<double>(f.pixel.y()), 1.0)
              .head<2>();
      observation.seen.push_back(seen);
    }
    if (static_cast<int>(observation.seen.size()) >= kLeastViews) to.points.push_back(std::move(observation));
  }
}

/// Keeps one part only, or all but one; -1: all.
struct Share {
  int only = -1;
  int without = -1;
  [[nodiscard]] bool has(int part) const { return (only < 0 || part == only) && part != without; }
};

CalibrationProblem make_problem(const Observations& all, const Share& share, const sensor::Camera& camera,
                                const CameraChange& change, const CalibrationOptions& options) {
  CalibrationProblem problem;
  problem.camera = camera;
  problem.change = change;
  problem.prior_mean[optimize::kReadout] = camera.readout_s.value_or(0.0);
  problem.prior_sigma = {options.focal_prior,      options.readout_prior_s, options.slope_prior,
                         options.slope_prior,      options.centre_prior_px, options.centre_prior_px,
                         options.distortion_prior, options.distortion_prior};
  std::vector<int> index(all.poses.size(), -1);
  std::vector<char> anchored(all.poses.size(), 0);  // by run
  for (const Observations::Point& point : all.points) {
    const auto in_share = [&](const CalibrationObservation& o) {
      return share.has(all.part[static_cast<std::size_t>(o.pose)]);
    };
    if (std::count_if(point.seen.begin(), point.seen.end(), in_share) < kLeastViews) continue;
    for (const CalibrationObservation& o : point.seen) {
      if (!in_share(o)) continue;
      const auto pose = static_cast<std::size_t>(o.pose);
      if (index[pose] < 0) {
        index[pose] = static_cast<int>(problem.poses.size());
        problem.poses.push_back(all.poses[pose]);
        char& has_anchor = anchored[static_cast<std::size_t>(all.run[pose])];
        problem.poses.back().fixed = has_anchor == 0;
        has_anchor = 1;
      }
      problem.observations.push_back(o);
      problem.observations.back().pose = index[pose];
      problem.observations.back().point = static_cast<int>(problem.points.size());
    }
    problem.points.push_back(point.position);
  }
  return problem;
}

CameraChange nothing(const sensor::Camera& camera) {
  CameraChange change{};
  change[optimize::kReadout] = camera.readout_s.value_or(0.0);
  return change;
}

/// What some unknowns, found from the rest of the runs, are worth in each part.
struct Trial {
  std::array<double, kParts> held_out{};  ///< costs; NaN: nothing could be told
  std::array<CameraChange, kParts> found{};
  [[nodiscard]] double cost() const { return std::accumulate(held_out.begin(), held_out.end(), 0.0); }
  [[nodiscard]] double sigma(std::size_t unknown) const {
    double mean = 0.0;
    for (const CameraChange& f : found) mean += f[unknown] / kParts;
    double squares = 0.0;
    for (const CameraChange& f : found) squares += (f[unknown] - mean) * (f[unknown] - mean);
    return std::sqrt((kParts - 1.0) / kParts * squares);
  }
};

class Calibrator {
 public:
  Calibrator(const Observations& all, const sensor::Camera& given, const CalibrationOptions& options,
             const core::Executor& executor)
      : all_(all), given_(given), options_(options), executor_(executor) {}

  [[nodiscard]] Trial try_out(const FreeUnknowns& free) const {
    Trial trial;
    executor_.parallel_for(kParts, [&](std::size_t i) {
      const int part = static_cast<int>(i);
      CameraChange change = nothing(given_);
      if (std::find(free.begin(), free.end(), true) != free.end()) change = find(free, {-1, part});
      trial.found[i] = change;
      CalibrationProblem rest = make_problem(all_, {part, -1}, given_, change, options_);
      trial.held_out[i] = optimize::adjust_with_camera(rest);
    });
    return trial;
  }
  [[nodiscard]] CameraChange find(const FreeUnknowns& free, const Share& share) const {
    CalibrationProblem problem = make_problem(all_, share, given_, nothing(given_), options_);
    problem.free = free;
    optimize::adjust_with_camera(problem);
    return problem.change;
  }
  [[nodiscard]] bool believed(const Trial& before, const Trial& with,
                              const std::vector<CameraUnknown>& group) const {
    int better = 0;
    for (std::size_t i = 0; i < kParts; ++i) better += with.held_out[i] < before.held_out[i] ? 1 : 0;
    if (better < kParts - 1 || !(with.cost() < (1.0 - options_.least_gain) * before.cost())) return false;
    const CameraChange none = nothing(given_);
    bool differs = false;
    for (const CameraUnknown u : group) {
      double mean = 0.0;
      for (const CameraChange& f : with.found) mean += f[u] / kParts;
      if (u == optimize::kReadout && mean < 0.0) return false;  // no camera reads an image before it is taken
      differs = differs || std::abs(mean - none[u]) > options_.least_sigmas * with.sigma(u);
    }
    return differs;
  }

 private:
  const Observations& all_;
  const sensor::Camera& given_;
  const CalibrationOptions& options_;
  const core::Executor& executor_;
};

/// The numbers of camera.yaml that an unknown stands for.
std::vector<CameraFinding> findings_of(CameraUnknown unknown, const sensor::Camera& given,
                                       const CameraChange& change, double sigma) {
  const sensor::Camera found = optimize::changed_camera(given, change);
  const auto one = [&](const char* name, double a, double b, double s) {
    return std::vector<CameraFinding>{{name, a, b, s, 0.0, false}};
  };
  switch (unknown) {
    case optimize::kFocal:
      return {{"fx", given.color.fx, found.color.fx, sigma * given.color.fx, 0.0, false},
              {"fy", given.color.fy, found.color.fy, sigma * given.color.fy, 0.0, false}};
    case optimize::kReadout:
      return one("readout", given.readout_s.value_or(0.0), change[unknown], sigma);
    case optimize::kSlopeX:
      return one("depth_slope x", given.depth_slope[0], found.depth_slope[0], sigma);
    case optimize::kSlopeY:
      return one("depth_slope y", given.depth_slope[1], found.depth_slope[1], sigma);
    case optimize::kCentreX:
      return one("cx", given.color.cx, found.color.cx, sigma);
    case optimize::kCentreY:
      return one("cy", given.color.cy, found.color.cy, sigma);
    case optimize::kK1:
      return one("k1", given.distortion[0], found.distortion[0], sigma);
    case optimize::kK2:
      return one("k2", given.distortion[1], found.distortion[1], sigma);
    default:
      return {};
  }
}

/// In the place of what an earlier trial said of the same number.
void note(const CameraFinding& finding, std::vector<CameraFinding>& findings) {
  const auto same = [&](const CameraFinding& f) { return f.name == finding.name; };
  const auto place = std::find_if(findings.begin(), findings.end(), same);
  if (place != findings.end()) {
    *place = finding;
  } else {
    findings.push_back(finding);
  }
}

}  // namespace

core::Result<CameraCalibration> calibrate_camera(const std::vector<CalibrationRun>& runs,
                                                 const sensor::Camera& given,
                                                 const CalibrationOptions& options,
                                                 const core::Executor& executor) {
  Observations all;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    add_run(runs[i], static_cast<int>(i), options.keyframes / static_cast<int>(runs.size()), given, all);
  }
  CameraCalibration result;
  result.keyframes = static_cast<int>(all.poses.size());
  for (const Observations::Point& p : all.points) result.observations += static_cast<int>(p.seen.size());
  const Calibrator calibrator(all, given, options, executor);
  Trial best = calibrator.try_out({});
  if (result.keyframes < kLeastKeyframes || result.observations < kLeastObservations ||
      !std::isfinite(best.cost())) {
    return core::input_error(fmt::format(
        "{} keyframes with {} observations of points that three or more of them share are too little "
        "to tell the camera by; film a place with texture for 10 s or more, turning and moving",
        result.keyframes, result.observations));
  }
  // What matters most first; each has to explain what those before it leave. What one hides of another (a
  // wrong distortion hides a wrong focal length) shows when the others are tried again after it was found.
  const std::vector<std::vector<CameraUnknown>> groups = {{optimize::kReadout},
                                                          {optimize::kSlopeX},
                                                          {optimize::kSlopeY},
                                                          {optimize::kFocal},
                                                          {optimize::kCentreX, optimize::kCentreY},
                                                          {optimize::kK1, optimize::kK2}};
  const double at_first = best.cost();
  FreeUnknowns believed{};
  std::size_t in_vain = 0;  // tried since something was believed
  for (std::size_t g = 0; in_vain < groups.size(); g = (g + 1) % groups.size()) {
    ++in_vain;
    const std::vector<CameraUnknown>& group = groups[g];
    if (believed[group.front()]) continue;
    FreeUnknowns free = believed;
    for (const CameraUnknown u : group) free[u] = true;
    const Trial trial = calibrator.try_out(free);
    const bool used = calibrator.believed(best, trial, group);
    const CameraChange found = calibrator.find(free, {});
    for (const CameraUnknown u : group) {
      for (CameraFinding& f : findings_of(u, given, found, trial.sigma(u))) {
        f.gain = (best.cost() - trial.cost()) / at_first;
        f.used = used;
        note(f, result.findings);
      }
    }
    if (!used) continue;
    believed = free;
    best = trial;
    in_vain = 0;
  }
  const CameraChange change = calibrator.find(believed, {});
  result.camera = optimize::changed_camera(given, change);
  result.gain = 1.0 - best.cost() / at_first;
  for (CameraFinding& f : result.findings) {  // those found first, with what was found after them
    if (!f.used) continue;
    for (std::size_t u = 0; u < kCameraUnknowns; ++u) {
      for (const CameraFinding& last :
           findings_of(static_cast<CameraUnknown>(u), given, change, best.sigma(u))) {
        if (last.name != f.name) continue;
        f.found = last.found;
        f.sigma = last.sigma;
      }
    }
  }
  return result;
}

}  // namespace plumbline::mapping
