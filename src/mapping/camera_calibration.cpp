// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/camera_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "plumbline/geometry/velocity.hpp"
#include "plumbline/mapping/observation_noise.hpp"

namespace plumbline::mapping {
namespace {

using optimize::CalibrationObservation;
using optimize::CalibrationProblem;
using optimize::CameraChange;
using optimize::CameraEvidence;
using optimize::CameraUnknown;
using optimize::FreeUnknowns;
using optimize::kCameraUnknowns;

constexpr int kParts = 4;
constexpr int kRounds = 3;  // of linearising where the last one led
constexpr int kLeastKeyframes = 8;
constexpr int kLeastViews = 2;
constexpr int kLeastObservations = 300;

using Parts = std::array<CalibrationProblem, kParts>;

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

/// As the lens showed it.
CalibrationObservation observation_of(const features::PointFeature& feature, bool aligned,
                                      const sensor::Camera& camera) {
  static const ObservationNoise noise;
  const optimize::BundlePointObservation in_bundle = noise.of(feature, aligned);
  CalibrationObservation seen;
  seen.pixel = optimize::distorted_pixel(camera, in_bundle.pixel);
  seen.pixel_sigma = in_bundle.pixel_sigma;
  seen.depth = in_bundle.depth;
  seen.depth_sigma = in_bundle.depth_sigma;
  const Eigen::Vector2d pixel = feature.pixel.cast<double>();
  seen.ray = camera.color.unproject(pixel.x(), pixel.y(), 1.0).head<2>();
  return seen;
}

/// How fast the depth on the ray to a point changes, m/s: the surface that it lies on is carried along by the
/// camera's motion. 0 where that surface is not known, or the ray grazes it.
double depth_rate(const maps::MapPoint& point, const optimize::CalibrationPose& pose) {
  constexpr double kLeastCosine = 0.3;  // between ray and normal
  const Eigen::Vector3d p = pose.camera_from_world * point.position;
  const Eigen::Vector3d normal = pose.camera_from_world.rotation * point.normal;
  const double along = normal.dot(p);
  if (!(std::abs(along) > kLeastCosine * p.norm())) return 0.0;
  return p.z() * normal.dot(pose.velocity.head<3>() + pose.velocity.tail<3>().cross(p)) / along;
}

/// Each part has the keyframes of its stretch, and what two of them see.
void add_run(const CalibrationRun& run, int wanted, const sensor::Camera& camera, Parts& parts) {
  const geometry::Trajectory path = maps::trajectory(*run.frames, *run.map);
  std::map<core::KeyframeId, std::pair<std::size_t, int>> index;  // part, pose
  std::array<bool, kParts> anchored{};
  for (const auto& [id, part] : chosen(*run.map, wanted)) {
    const auto p = static_cast<std::size_t>(part);
    index[id] = {p, static_cast<int>(parts[p].poses.size())};
    optimize::CalibrationPose pose;
    pose.camera_from_world = run.map->camera_from_world(id);
    pose.velocity = geometry::velocity_at(path, run.map->keyframe(id).stamp);
    pose.undone_s = run.undone_s;
    pose.fixed = !std::exchange(anchored[p], true);
    parts[p].poses.push_back(pose);
  }
  for (const core::PointId id : run.map->point_ids()) {
    const maps::MapPoint& point = run.map->point(id);
    std::array<std::vector<CalibrationObservation>, kParts> seen;
    for (const maps::Observation& o : point.observations) {
      const auto place = index.find(o.keyframe);
      if (place == index.end()) continue;
      const auto& [part, pose] = place->second;
      const auto& features = *run.map->keyframe(o.keyframe).features;
      seen[part].push_back(
          observation_of(features.points[static_cast<std::size_t>(o.feature)], o.aligned, camera));
      seen[part].back().pose = pose;
      seen[part].back().point = static_cast<int>(parts[part].points.size());
      seen[part].back().depth_rate = depth_rate(point, parts[part].poses[static_cast<std::size_t>(pose)]);
    }
    for (std::size_t p = 0; p < kParts; ++p) {
      if (static_cast<int>(seen[p].size()) < kLeastViews) continue;
      parts[p].points.push_back(point.position);
      parts[p].observations.insert(parts[p].observations.end(), seen[p].begin(), seen[p].end());
    }
  }
}

CameraChange nothing(const sensor::Camera& camera) {
  CameraChange change = CameraChange::Zero();
  change[optimize::kReadout] = camera.readout_s.value_or(0.0);
  return change;
}

/// What some unknowns, found from the rest of the runs, are worth in each part.
struct Trial {
  std::array<double, kParts> held_out{};  ///< costs
  std::array<CameraChange, kParts> found;
  [[nodiscard]] double cost() const { return std::accumulate(held_out.begin(), held_out.end(), 0.0); }
  [[nodiscard]] CameraChange mean() const {
    CameraChange sum = CameraChange::Zero();
    for (const CameraChange& f : found) sum += f;
    return sum / kParts;
  }
  [[nodiscard]] CameraChange sigma() const {
    CameraChange squares = CameraChange::Zero();
    for (const CameraChange& f : found) squares += (f - mean()).cwiseAbs2();
    return ((kParts - 1.0) / kParts * squares).cwiseSqrt();
  }
};

using Group = std::vector<CameraUnknown>;
/// What matters most first; each has to explain what those before it leave.
const std::vector<Group>& groups() {
  static const std::vector<Group> all = {
      {optimize::kReadout},          {optimize::kDelay}, {optimize::kSlopeX},
      {optimize::kSlopeY},           {optimize::kFocal}, {optimize::kCentreX, optimize::kCentreY},
      {optimize::kK1, optimize::kK2}};
  return all;
}

/// The numbers of camera.yaml that are looked for, and what each hangs on.
struct CameraNumber {
  const char* name;
  CameraUnknown unknown;
  double value;
};
std::vector<CameraNumber> numbers_of(const sensor::Camera& camera) {
  return {{"readout", optimize::kReadout, camera.readout_s.value_or(0.0)},
          {"depth_delay", optimize::kDelay, camera.depth_delay_s},
          {"depth_slope x", optimize::kSlopeX, camera.depth_slope[0]},
          {"depth_slope y", optimize::kSlopeY, camera.depth_slope[1]},
          {"fx", optimize::kFocal, camera.color.fx},
          {"fy", optimize::kFocal, camera.color.fy},
          {"cx", optimize::kCentreX, camera.color.cx},
          {"cy", optimize::kCentreY, camera.color.cy},
          {"k1", optimize::kK1, camera.distortion[0]},
          {"k2", optimize::kK2, camera.distortion[1]}};
}

class Calibrator {
 public:
  Calibrator(const sensor::Camera& given, const CalibrationOptions& options)
      : given_(given), options_(options), none_(nothing(given)) {
    prior_.mean = none_;
    prior_.sigma = CameraChange{{options.focal_prior, options.readout_prior_s, options.slope_prior,
                                 options.slope_prior, options.centre_prior_px, options.centre_prior_px,
                                 options.distortion_prior, options.distortion_prior, options.delay_prior_s}};
  }

  /// What is believed, by the evidence of each part. What one unknown hides of another (a wrong distortion
  /// hides a wrong focal length) shows when the others are tried again after it was found.
  CameraChange choose(const std::vector<CameraEvidence>& evidence, CameraCalibration& result) const {
    FreeUnknowns believed{};
    const Trial before = try_out(evidence, believed);
    Trial best = believed_again(evidence, before, believed);
    result.findings.clear();
    for (const CameraNumber& n : numbers_of(given_)) result.findings.push_back({n.name, n.value, n.value});
    std::size_t in_vain = 0;  // tried since something was believed
    for (std::size_t g = 0; in_vain < groups().size(); g = (g + 1) % groups().size()) {
      ++in_vain;
      const Group& group = groups()[g];
      if (believed[group.front()]) continue;
      FreeUnknowns free = believed;
      for (const CameraUnknown u : group) free[u] = true;
      const Trial trial = try_out(evidence, free);
      const bool used = is_believed(best, trial, group, options_.least_gain);
      const CameraChange found = most_likely(evidence, free, prior_);
      const double gain = (best.cost() - trial.cost()) / before.cost();
      note(group, found, trial.sigma(), gain, used, result.findings);
      if (!used) continue;
      believed = free;
      best = trial;
      in_vain = 0;
    }
    result.gain = 1.0 - best.cost() / before.cost();
    const CameraChange change = most_likely(evidence, believed, prior_);
    for (const Group& group : groups()) {  // those found first, with what was found after them
      if (believed[group.front()]) note(group, change, best.sigma(), {}, true, result.findings);
    }
    return change;
  }

 private:
  /// What was believed earlier, all of it at once; `believed` stays none when it says nothing new.
  [[nodiscard]] Trial believed_again(const std::vector<CameraEvidence>& evidence, const Trial& before,
                                     FreeUnknowns& believed) const {
    FreeUnknowns free{};
    Group all;
    for (const CameraNumber& n : numbers_of(given_)) {
      const auto was_used = [&](const CameraFinding& f) { return f.used && f.name == n.name; };
      if (std::none_of(options_.earlier.begin(), options_.earlier.end(), was_used)) continue;
      free[n.unknown] = true;
      all.push_back(n.unknown);
    }
    if (all.empty()) return before;
    Trial trial = try_out(evidence, free);
    if (!is_believed(before, trial, all, options_.earlier_least_gain)) return before;
    believed = free;
    return trial;
  }
  [[nodiscard]] Trial try_out(const std::vector<CameraEvidence>& evidence, const FreeUnknowns& free) const {
    Trial trial;
    for (std::size_t i = 0; i < kParts; ++i) {
      std::vector<CameraEvidence> others = evidence;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      trial.found[i] = most_likely(others, free, prior_);
      trial.held_out[i] = evidence[i].cost_of(trial.found[i]);
    }
    return trial;
  }

  [[nodiscard]] bool is_believed(const Trial& before, const Trial& with, const Group& group,
                                 double least_gain) const {
    int better = 0;
    for (std::size_t i = 0; i < kParts; ++i) better += with.held_out[i] < before.held_out[i] ? 1 : 0;
    if (better < kParts - 1 || !(with.cost() < (1.0 - least_gain) * before.cost())) return false;
    if (group.front() == optimize::kReadout && with.mean()[optimize::kReadout] < 0.0)
      return false;  // no camera reads a picture before it is taken
    return std::any_of(group.begin(), group.end(), [&](CameraUnknown u) {
      return std::abs(with.mean()[u] - none_[u]) > options_.least_sigmas * with.sigma()[u];
    });
  }

  /// Without a gain: that of before stays.
  void note(const Group& group, const CameraChange& change, const CameraChange& sigma,
            std::optional<double> gain, bool used, std::vector<CameraFinding>& findings) const {
    const std::vector<CameraNumber> found = numbers_of(optimize::changed_camera(given_, change));
    for (std::size_t i = 0; i < found.size(); ++i) {
      const CameraUnknown u = found[i].unknown;
      CameraFinding& f = findings[i];
      if (std::find(group.begin(), group.end(), u) == group.end()) continue;
      f.found = found[i].value;
      f.sigma = (u == optimize::kFocal ? f.given : 1.0) * sigma[u];
      f.gain = gain.value_or(f.gain);
      f.used = used;
    }
  }

  const sensor::Camera& given_;
  const CalibrationOptions& options_;
  CameraChange none_;
  optimize::CameraPrior prior_;
};

/// None: some part tells nothing.
std::optional<std::vector<CameraEvidence>> evidence_of(const Parts& parts, const CameraChange& change,
                                                       const core::Executor& executor) {
  std::array<std::optional<CameraEvidence>, kParts> each;
  executor.parallel_for(kParts, [&](std::size_t i) { each[i] = camera_evidence(parts[i], change); });
  std::vector<CameraEvidence> all;
  for (const auto& one : each) {
    if (!one) return std::nullopt;
    all.push_back(*one);
  }
  return all;
}

}  // namespace

core::Result<CameraCalibration> calibrate_camera(const std::vector<CalibrationRun>& runs,
                                                 const sensor::Camera& given,
                                                 const CalibrationOptions& options,
                                                 const core::Executor& executor) {
  Parts parts;
  for (CalibrationProblem& part : parts) part.camera = given;
  for (const CalibrationRun& run : runs)
    add_run(run, options.keyframes / static_cast<int>(runs.size()), given, parts);
  CameraCalibration result;
  for (const CalibrationProblem& part : parts) {
    result.keyframes += static_cast<int>(part.poses.size());
    result.observations += static_cast<int>(part.observations.size());
  }
  const Calibrator calibrator(given, options);
  CameraChange change = nothing(given);
  for (int round = 0; round < kRounds; ++round) {
    const auto evidence = evidence_of(parts, change, executor);
    if (!evidence || result.keyframes < kLeastKeyframes || result.observations < kLeastObservations) {
      return core::input_error(fmt::format(
          "{} keyframes with {} observations of shared points are too few to estimate the camera from; "
          "film a place with texture for 10 s or more while turning and moving the camera",
          result.keyframes, result.observations));
    }
    const CameraChange before = std::exchange(change, calibrator.choose(*evidence, result));
    if (change == before) break;
  }
  result.camera = optimize::changed_camera(given, change);
  return result;
}

}  // namespace plumbline::mapping
