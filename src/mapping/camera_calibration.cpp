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

#include "plumbline/features/measurement.hpp"
#include "plumbline/geometry/velocity.hpp"
#include "plumbline/mapping/adjustment/observation_noise.hpp"
#include "plumbline/maps/components.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;
using optimize::CalibrationObservation;
using optimize::CalibrationProblem;
using optimize::CameraChange;
using optimize::CameraEvidence;
using optimize::CameraUnknown;

constexpr int kParts = 4;
constexpr int kRounds = 3;        // of linearising where the last one led
constexpr double kSame = 0.01;    // change, in standard deviations of a wrong file, that needs no other round
constexpr double kBlock_s = 1.0;  // whose errors are taken as independent of other blocks
constexpr std::size_t kLeastKeyframes = 8;
constexpr int kLeastViewsInAll = 24;  // including frames: fewer show the same view again and again
constexpr int kLeastViews = 2;
constexpr int kLeastObservations = 300;

using Parts = std::array<CalibrationProblem, kParts>;

/// A picture used for calibration: a keyframe, or a frame with stored observations.
struct View {
  double stamp = 0.0;
  Rigid3 camera_from_world;
  core::KeyframeId root;  ///< root of its component
  std::vector<std::pair<core::PointId, CalibrationObservation>> seen;
  /// Present estimate of the depth's delay minus the one with which the picture was read, seconds.
  double late_s = 0.0;
};

/// A subset of a list, spread evenly.
template <typename Thing>
std::vector<Thing> thinned(const std::vector<Thing>& all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<Thing> some;
  for (std::size_t i = 0; i < most; ++i) some.push_back(all[i * all.size() / most]);
  return some;
}

/// The views of one run, as the lens showed them: keyframes, and where there are few of them frames between.
class RunViews {
 public:
  RunViews(const CalibrationRun& run, const sensor::Camera& camera, std::size_t most)
      : run_(run), model_(run.image, camera) {
    const std::vector<core::KeyframeId> keyframes = thinned(run.map->keyframe_ids(), most);
    add_keyframes(keyframes);
    add_frames(most - keyframes.size());
    std::sort(views_.begin(), views_.end(), [](const View& a, const View& b) { return a.stamp < b.stamp; });
  }
  [[nodiscard]] const std::vector<View>& views() const { return views_; }

 private:
  void add_keyframes(const std::vector<core::KeyframeId>& keyframes) {
    std::map<core::KeyframeId, std::size_t> index;
    for (const core::KeyframeId id : keyframes) {
      index[id] = views_.size();
      views_.push_back({run_.map->keyframe(id).stamp,
                        run_.map->camera_from_world(id),
                        maps::root_of(*run_.map, id),
                        {},
                        0.0});
    }

    // Features are corrected for lens and rolling shutter, with the camera that is in question here. The
    // calibration needs the measurements in the raw image.
    static const ObservationNoise noise;
    for (const core::PointId id : run_.map->point_ids()) {
      for (const maps::Observation& o : run_.map->point(id).observations) {
        const auto view = index.find(o.keyframe);
        if (view == index.end()) continue;

        const features::FrameFeatures& picture = *run_.map->keyframe(o.keyframe).features;
        const features::PointFeature& f = picture.points[static_cast<std::size_t>(o.feature)];
        const auto measured = features::measurement_of({f.pixel.cast<double>(), static_cast<double>(f.depth)},
                                                       picture.shutter_motion, model_);
        views_[view->second].seen.emplace_back(id,
                                               observation_of(measured, noise.of(f, o.aligned).pixel_sigma));
      }
    }
  }

  void add_frames(std::size_t most) {
    // Keyframes are views already; frames between them can be used only if their observations were kept.
    std::vector<const maps::FramePose*> frames;
    for (const maps::FramePose& frame : *run_.frames) {
      if (frame.seen != nullptr && maps::is_between_keyframes(frame, *run_.map)) frames.push_back(&frame);
    }

    for (const maps::FramePose* chosen : thinned(frames, most)) {
      const maps::FramePose& frame = *chosen;
      View view{frame.stamp,
                frame.camera_from_reference * run_.map->camera_from_world(frame.reference),
                maps::root_of(*run_.map, frame.reference),
                {},
                0.0};

      // Depths are corrected for the delay that was assumed when the frame was
      // read; only its change is missing.
      view.late_s = model_.camera().depth_delay_s - frame.seen->depth_delay_s;

      for (const maps::SeenPoint& s : frame.seen->points) {
        if (run_.map->find(s.point) == nullptr) continue;
        view.seen.emplace_back(s.point, observation_of({s.pixel.cast<double>(), static_cast<double>(s.depth)},
                                                       static_cast<double>(s.sigma_px)));
      }

      views_.push_back(std::move(view));
    }
  }

  [[nodiscard]] CalibrationObservation observation_of(const features::PixelDepth& measured,
                                                      double sigma_px) const {
    static const ObservationNoise noise;
    CalibrationObservation seen;
    seen.pixel = measured.pixel;
    seen.pixel_sigma = sigma_px;
    const Eigen::Vector2d rectified = model_.rectified_pixel(measured.pixel);
    seen.ray = run_.image.unproject(rectified.x(), rectified.y(), 1.0).head<2>();
    if (!(measured.depth > 0.0)) return seen;
    seen.depth = model_.true_depth(rectified, measured.depth);
    seen.depth_sigma = noise.depth_factor * sensor::depth_sigma(seen.depth);
    return seen;
  }

  const CalibrationRun& run_;
  sensor::ImageModel model_;
  std::vector<View> views_;  ///< by time
};

double depth_rate(const maps::MapPoint& point, const optimize::CalibrationPose& pose) {
  return features::depth_rate(pose.camera_from_world * point.position,
                              pose.camera_from_world.rotation * point.normal, pose.velocity);
}

/// Some neighbouring views, with all that at least two of them see.
void add_stretch(const CalibrationRun& run, const geometry::Trajectory& path, const View* begin,
                 const View* end, CalibrationProblem& part) {
  const int first_block = part.poses.empty() ? 0 : part.poses.back().block + 1;
  std::map<core::PointId, std::vector<CalibrationObservation>> by_point;
  for (const View* view = begin; view != end; ++view) {
    optimize::CalibrationPose pose;
    pose.camera_from_world = view->camera_from_world;
    pose.velocity = geometry::velocity_at(path, view->stamp);

    // The relative poses of components are unknown: one pose of each is held.
    pose.fixed = view == begin || view->root != (view - 1)->root;
    pose.block = first_block + static_cast<int>((view->stamp - begin->stamp) / kBlock_s);

    for (const auto& [id, observation] : view->seen) {
      by_point[id].push_back(observation);
      CalibrationObservation& seen = by_point[id].back();
      seen.pose = static_cast<int>(part.poses.size());
      seen.depth_rate = depth_rate(run.map->point(id), pose);
      if (seen.depth > 0.0) seen.depth -= view->late_s * seen.depth_rate;
    }

    part.poses.push_back(pose);
  }

  for (auto& [id, seen] : by_point) {
    if (static_cast<int>(seen.size()) < kLeastViews) continue;
    for (CalibrationObservation& o : seen) o.point = static_cast<int>(part.points.size());
    part.points.push_back(run.map->point(id).position);
    part.observations.insert(part.observations.end(), seen.begin(), seen.end());
  }
}

/// Each part gets a quarter of the run.
void add_run(const CalibrationRun& run, int wanted, const sensor::Camera& camera, Parts& parts) {
  const geometry::Trajectory path = maps::trajectory(*run.frames, *run.map);
  const RunViews views(run, camera, static_cast<std::size_t>(wanted));
  const std::size_t count = views.views().size();
  for (std::size_t p = 0; p < kParts; ++p) {
    const View* first = views.views().data();
    add_stretch(run, path, first + count * p / kParts, first + count * (p + 1) / kParts, parts[p]);
  }
}

/// Numbers of camera.yaml that are estimated, and the unknown that each depends on.
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

/// The options', but where the file tells a standard deviation that one.
optimize::CameraPrior prior_of(const sensor::Camera& given, const CalibrationOptions& options) {
  optimize::CameraPrior prior;
  const sensor::Camera& file = options.file ? *options.file : given;

  // The unknowns are changes of the camera that the maps were made with, but the prior is about the camera's
  // file: its mean is the difference of the two.
  prior.mean = optimize::change_between(given, file);

  // A standard deviation given in the file replaces the default, but is never
  // larger than that of a wrong file.
  const auto set = [&prior](CameraUnknown unknown, const NumberPrior& sigma, double told) {
    prior.right_sigma[unknown] = told > 0.0 ? std::min(told, sigma.wrong) : sigma.right;
    prior.wrong_sigma[unknown] = sigma.wrong;
  };

  set(optimize::kFocal, options.focal, file.sigma.fx / file.color.fx);
  set(optimize::kReadout, options.readout_s, file.sigma.readout_s);
  set(optimize::kSlopeX, options.slope, file.sigma.depth_slope);
  set(optimize::kSlopeY, options.slope, file.sigma.depth_slope);
  set(optimize::kCentreX, options.centre_px, file.sigma.centre);
  set(optimize::kCentreY, options.centre_px, file.sigma.centre);
  set(optimize::kK1, options.distortion, file.sigma.distortion);
  set(optimize::kK2, options.distortion, file.sigma.distortion);
  set(optimize::kDelay, options.delay_s, file.sigma.depth_delay_s);

  prior.wrong.fill(options.wrong);
  return prior;
}

sensor::CameraSigma sigma_of(const optimize::CameraPosterior& known, const sensor::Camera& camera) {
  const CameraChange sigma = known.covariance.diagonal().cwiseSqrt();
  return {camera.color.fx * sigma[optimize::kFocal],
          std::max(sigma[optimize::kCentreX], sigma[optimize::kCentreY]),
          std::max(sigma[optimize::kK1], sigma[optimize::kK2]),
          sigma[optimize::kReadout],
          std::max(sigma[optimize::kSlopeX], sigma[optimize::kSlopeY]),
          sigma[optimize::kDelay]};
}

/// Evidence of each part; none if some part has none.
std::optional<std::vector<CameraEvidence>> evidence_of(Parts& parts, const CameraChange& change,
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
  std::size_t keyframes = 0;
  for (const CalibrationRun& run : runs) keyframes += run.map->keyframe_count();

  // Every run gets the same number of views, so that a long one does not outweigh the others.
  for (const CalibrationRun& run : runs)
    add_run(run, options.views / static_cast<int>(runs.size()), given, parts);
  CameraCalibration result;
  for (const CalibrationProblem& part : parts) {
    result.views += static_cast<int>(part.poses.size());
    result.observations += static_cast<int>(part.observations.size());
  }

  const optimize::CameraPrior prior = prior_of(given, options);
  const CameraChange none = optimize::change_between(given, given);
  CameraChange change = none;
  optimize::CameraPosterior known;

  for (int round = 0; round < kRounds; ++round) {
    const auto evidence = evidence_of(parts, change, executor);
    const bool few = keyframes < kLeastKeyframes && result.views < kLeastViewsInAll;
    if (!evidence || few || result.observations < kLeastObservations) {
      return core::input_error(
          fmt::format("{} views with {} observations of shared points are too few to estimate the camera; "
                      "film a place with texture for 10 s or more while turning and moving the camera",
                      result.views, result.observations));
    }

    known = optimize::camera_posterior(*evidence, prior);
    double before = 0.0, after = 0.0;
    for (const CameraEvidence& e : *evidence) {
      before += e.cost_of(prior.mean);
      after += e.cost_of(known.mean);
    }
    result.gain = 1.0 - after / before;

    // A change far below the standard deviation of a wrong file needs no new linearisation.
    const CameraChange step =
        (known.mean - std::exchange(change, known.mean)).cwiseQuotient(prior.wrong_sigma);
    if (step.cwiseAbs().maxCoeff() < kSame) break;
  }

  result.camera = optimize::changed_camera(given, change);
  result.sigma = sigma_of(known, result.camera);
  result.known = known;
  result.findings = findings_of(options.file.value_or(given), result.camera, known);
  result.news = (change - none).cwiseAbs().cwiseQuotient(known.covariance.diagonal().cwiseSqrt()).maxCoeff();
  return result;
}

std::vector<CameraFinding> findings_of(const sensor::Camera& file, const sensor::Camera& found,
                                       const optimize::CameraPosterior& known) {
  std::vector<CameraFinding> findings;
  const std::vector<CameraNumber> numbers = numbers_of(found);
  for (const CameraNumber& n : numbers_of(file)) {
    const auto u = static_cast<Eigen::Index>(n.unknown);
    CameraFinding f{n.name, n.value, numbers[findings.size()].value};
    f.sigma = (n.unknown == optimize::kFocal ? n.value : 1.0) * std::sqrt(known.covariance(u, u));
    f.wrong = known.wrong[optimize::group_of(n.unknown)];
    f.used = std::abs(f.found - f.given) > f.sigma;
    findings.push_back(f);
  }
  return findings;
}

}  // namespace plumbline::mapping
