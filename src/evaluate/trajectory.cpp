// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/evaluate/trajectory.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "body.hpp"

namespace plumbline::evaluate {
namespace {

using geometry::Rigid3;
using geometry::StampedPose;
using geometry::Trajectory;

constexpr double kDegrees = 180.0 / 3.14159265358979323846;

/// Stamps that agree to 0.1 ms have the same key. The product is exact in 64 bits of mantissa, so that the
/// key is that of the stamp rounded to four decimals.
long long stamp_key(double stamp) { return std::llrint(static_cast<long double>(stamp) * 10000.0L); }

/// Tolerances must be positive.
core::Result<void> check_options(const TrajectoryOptions& options) {
  if (!(options.max_dt_s > 0.0) || !std::isfinite(options.max_dt_s)) {
    return core::usage_error(fmt::format("max_dt is {} s; it must be above 0", options.max_dt_s));
  }
  if (options.rpe_frames < 1) {
    return core::usage_error(fmt::format("rpe_frames is {}; it must be at least 1", options.rpe_frames));
  }
  if (!(options.rpe_seconds > 0.0) || !std::isfinite(options.rpe_seconds)) {
    return core::usage_error(fmt::format("rpe_seconds is {}; it must be above 0", options.rpe_seconds));
  }
  return {};
}

bool fits_positions(TrajectoryAlignment align) {
  return align == TrajectoryAlignment::kSe3 || align == TrajectoryAlignment::kSim3;
}

/// All poses finite, sorted by time.
core::Result<Trajectory> checked(const char* which, const Trajectory& given) {
  if (given.empty()) return core::input_error(fmt::format("the {} trajectory has no poses", which));
  for (std::size_t i = 0; i < given.size(); ++i) {
    const Rigid3& pose = given[i].world_from_camera;
    if (!std::isfinite(given[i].stamp) || !pose.translation.allFinite() || !pose.rotation.allFinite()) {
      return core::input_error(
          fmt::format("the {} trajectory: pose {} of {} is not finite", which, i + 1, given.size()));
    }
  }

  // Writers may store poses out of order
  Trajectory sorted = given;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.stamp < b.stamp; });
  return sorted;
}

struct Matches {
  std::vector<MatchedPose> pairs;
  std::size_t ambiguous = 0;  ///< poses with a common stamp that the truth has more or less often
};

/// The poses of the truth with this stamp: the first of them and their number.
std::pair<Trajectory::const_iterator, std::size_t> truth_at(const Trajectory& truth, double stamp) {
  constexpr double kSame = 1e-6;  // seconds since 1970 as a double are good to 2e-7
  const auto first = std::lower_bound(truth.begin(), truth.end(), stamp - kSame,
                                      [](const StampedPose& pose, double s) { return pose.stamp < s; });
  auto last = first;
  while (last != truth.end() && last->stamp <= stamp + kSame) ++last;
  return {first, static_cast<std::size_t>(last - first)};
}

/// A pose whose stamp is unique gets the interpolated truth; poses with a common stamp are paired with as
/// many of the truth, in the order of both files.
Matches match(const Trajectory& estimate, const Trajectory& truth, double max_dt_s) {
  // A group of poses with one stamp
  Matches matches;
  for (std::size_t i = 0; i < estimate.size();) {
    std::size_t end = i + 1;
    while (end < estimate.size() && estimate[end].stamp == estimate[i].stamp) ++end;
    const auto [first, there] = truth_at(truth, estimate[i].stamp);

    // Equal stamps match by order, if their counts agree
    if (end - i > 1 || there > 1) {
      if (there != end - i) matches.ambiguous += end - i;
      for (std::size_t k = i; k < end && there == end - i; ++k) {
        const StampedPose& partner = *(first + static_cast<std::ptrdiff_t>(k - i));
        matches.pairs.push_back(
            {estimate[k].stamp, estimate[k].world_from_camera, partner.world_from_camera});
      }

    } else if (const auto at = geometry::pose_at(truth, estimate[i].stamp, max_dt_s)) {
      matches.pairs.push_back({estimate[i].stamp, estimate[i].world_from_camera, *at});
    }

    i = end;
  }

  return matches;
}

std::string too_few_message(std::size_t matched, std::size_t needed, const Trajectory& estimate,
                            const Trajectory& truth, double max_dt_s) {
  // Time ranges help to recognise another clock
  const bool apart =
      estimate.back().stamp < truth.front().stamp || estimate.front().stamp > truth.back().stamp;
  const std::string ranges =
      fmt::format("estimate {:.4f} to {:.4f} s, truth {:.4f} to {:.4f} s", estimate.front().stamp,
                  estimate.back().stamp, truth.front().stamp, truth.back().stamp);

  // Another recording, or another clock
  if (apart) {
    return fmt::format("estimate and truth do not overlap in time ({}): are they of the same recording?",
                       ranges);
  }

  // Too few poses in a file
  if (estimate.size() < needed || truth.size() < needed) {
    return fmt::format("too few poses: the estimate has {}, the truth {}, and {} are needed{}",
                       estimate.size(), truth.size(), needed,
                       needed > 1 ? "; --align start or none takes one" : "");
  }

  // Too few of them match
  return fmt::format(
      "only {} of {} poses have truth within {} s of their stamp, {} are needed ({}): is the truth complete, "
      "or --max-dt too small?",
      matched, estimate.size(), max_dt_s, needed, ranges);
}

/// "" when there are none.
std::string ambiguous_message(std::size_t ambiguous) {
  if (ambiguous == 0) return "";
  return fmt::format(
      "; {} poses are left out because they share a stamp with others, and the truth has another number "
      "there",
      ambiguous);
}

/// The rotation about a path along one line, or at one place, is not determined by its positions.
bool positions_fix_rotation(const std::vector<MatchedPose>& matches) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const MatchedPose& m : matches) mean += m.truth.translation;
  mean /= static_cast<double>(matches.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const MatchedPose& m : matches) {
    const Eigen::Vector3d d = m.truth.translation - mean;
    scatter += d * d.transpose();
  }
  scatter /= static_cast<double>(matches.size());
  const Eigen::Vector3d variance = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues();
  return variance(1) > 1e-6;  // 1 mm across the main direction
}

/// Finds the body whose poses the truth holds, and takes it out of the truth if the options say so.
core::Result<std::optional<BodyReport>> take_body_out(const TrajectoryOptions& options,
                                                      std::vector<MatchedPose>& matches, Trajectory& truth) {
  if (options.body.empty()) return notable_body(matches, options.align);
  const auto body = options.body == "fit" ? fit_body(matches, options.align == TrajectoryAlignment::kSim3)
                                          : parse_body(options.body);
  if (!body) return tl::unexpected(body.error());

  BodyReport report = body_report(matches, options.align, *body);
  report.removed = true;
  for (MatchedPose& m : matches) m.truth = m.truth * *body;
  for (StampedPose& pose : truth) pose.world_from_camera = pose.world_from_camera * *body;
  return report;
}

/// Errors of one pose after alignment.
PoseError pose_error(const MatchedPose& m, const geometry::ScaledRigid3& truth_from_estimate) {
  PoseError e;
  e.stamp = m.stamp;
  e.estimate = aligned(truth_from_estimate, m.estimate);
  e.truth = m.truth;
  e.error_m = e.estimate.translation - e.truth.translation;
  e.distance_m = e.error_m.norm();
  e.rotation_deg = kDegrees * geometry::rotation_angle(e.truth.rotation.transpose() * e.estimate.rotation);
  return e;
}

/// ATE, orientation errors and errors along each axis.
void add_absolute_errors(TrajectoryReport& report) {
  std::vector<double> distance;
  std::vector<double> rotation;
  std::array<std::vector<double>, 3> axis;
  for (const PoseError& e : report.poses) {
    distance.push_back(e.distance_m);
    rotation.push_back(e.rotation_deg);
    for (std::size_t k = 0; k < 3; ++k) {
      const double signed_error = e.error_m(static_cast<Eigen::Index>(k));
      axis[k].push_back(std::abs(signed_error));
      report.axis_bias_m[k] += signed_error / static_cast<double>(report.poses.size());
    }
  }
  report.ate_m = summarize(distance);
  report.rotation_deg = summarize(rotation);
  for (std::size_t k = 0; k < 3; ++k) report.axis_m[k] = summarize(axis[k]);
}

using IndexPairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// RPE: the estimated motion of each pair against the true one.
RelativeError relative_error(const std::vector<PoseError>& poses, const IndexPairs& pairs) {
  std::vector<double> translation;
  std::vector<double> rotation;
  for (const auto& [i, j] : pairs) {
    const Rigid3 true_step = poses[i].truth.inverse() * poses[j].truth;
    const Rigid3 step = poses[i].estimate.inverse() * poses[j].estimate;
    const Rigid3 error = true_step.inverse() * step;
    translation.push_back(error.translation.norm());
    rotation.push_back(kDegrees * geometry::rotation_angle(error.rotation));
  }
  return {pairs.size(), summarize(translation), summarize(rotation)};
}

/// With a frames list: listed frames k and k + step that both have a pose; else matched poses i and i + step.
IndexPairs frame_pairs(const std::vector<PoseError>& poses, const std::vector<long long>& frame_keys,
                       std::size_t step) {
  IndexPairs pairs;
  if (frame_keys.empty()) {
    for (std::size_t i = 0; i + step < poses.size(); ++i) pairs.emplace_back(i, i + step);
    return pairs;
  }
  std::map<long long, std::size_t> pose_of;
  for (std::size_t i = 0; i < poses.size(); ++i) pose_of.emplace(stamp_key(poses[i].stamp), i);
  for (std::size_t k = 0; k + step < frame_keys.size(); ++k) {
    const auto a = pose_of.find(frame_keys[k]);
    const auto b = pose_of.find(frame_keys[k + step]);
    if (a != pose_of.end() && b != pose_of.end()) pairs.emplace_back(a->second, b->second);
  }
  return pairs;
}

/// For each pose the one whose stamp is nearest to `seconds` later, if it is no more than max_dt or half the
/// usual time between poses off.
IndexPairs time_pairs(const std::vector<PoseError>& poses, double seconds, double max_dt_s) {
  IndexPairs pairs;
  if (poses.size() < 2) return pairs;
  std::vector<double> steps;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) steps.push_back(poses[i + 1].stamp - poses[i].stamp);
  const double tolerance = std::min(std::max(max_dt_s, 0.5 * summarize(steps).median), 0.5 * seconds);
  std::size_t j = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double wanted = poses[i].stamp + seconds;
    while (j + 1 < poses.size() && std::abs(poses[j + 1].stamp - wanted) <= std::abs(poses[j].stamp - wanted))
      ++j;
    if (j > i && std::abs(poses[j].stamp - wanted) <= tolerance) pairs.emplace_back(i, j);
  }
  return pairs;
}

/// Stamps as integers, sorted, without duplicates.
std::vector<long long> sorted_keys(const std::vector<double>& stamps) {
  std::vector<long long> keys;
  keys.reserve(stamps.size());
  for (const double s : stamps) keys.push_back(stamp_key(s));
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

/// Share of the recording's frames that have a pose.
void add_tracked_share(const Trajectory& estimate, const std::vector<long long>& frame_keys,
                       TrajectoryReport& report) {
  // Without frames only the start is known
  if (frame_keys.empty()) {
    report.first_pose_s = std::max(0.0, estimate.front().stamp - report.truth.front().stamp);
    return;
  }

  // Stamps are compared as integers
  std::vector<double> stamps;
  for (const StampedPose& pose : estimate) stamps.push_back(pose.stamp);
  const std::vector<long long> pose_keys = sorted_keys(stamps);
  std::vector<long long> tracked;
  std::set_intersection(frame_keys.begin(), frame_keys.end(), pose_keys.begin(), pose_keys.end(),
                        std::back_inserter(tracked));

  // Time until tracking began
  report.frames = frame_keys.size();
  report.tracked_percent =
      100.0 * static_cast<double>(tracked.size()) / static_cast<double>(frame_keys.size());
  if (!tracked.empty())
    report.first_pose_s = 1e-4 * static_cast<double>(tracked.front() - frame_keys.front());
}

std::string scale_warning(const ScaleReport& scale) {
  return fmt::format(
      "the estimate is {:.2f} % too {}: it fits the truth at {:.4f} of its size, standard deviation {:.4f}; "
      "its depth unit or focal length may be wrong",
      100.0 * std::abs(1.0 / scale.value - 1.0), scale.value < 1.0 ? "large" : "small", scale.value,
      scale.sigma);
}

void add_warnings(const std::vector<MatchedPose>& matches, TrajectoryReport& report) {
  // Alignment that the positions do not determine
  if (fits_positions(report.align) && !positions_fix_rotation(matches)) {
    report.warnings.push_back(
        "the matched positions lie on one line or at one place: the alignment's rotation is not determined, "
        "and ATE says little");
  }

  // Scale and lever that the truth suggests
  if (report.scale && !report.scale->doubtful) report.warnings.push_back(scale_warning(*report.scale));
  if (report.body && !report.body->removed) report.warnings.push_back(body_warning(*report.body));

  // Poses that were left out
  if (2 * report.matched < report.estimated) {
    report.warnings.push_back(
        fmt::format("only {} of {} poses have truth at their stamp", report.matched, report.estimated));
  }

  // Frames that were lost
  if (report.tracked_percent && *report.tracked_percent < 90.0) {
    report.warnings.push_back(
        fmt::format("only {:.1f} % of the frames have a pose: the errors are those of the "
                    "frames that were tracked",
                    *report.tracked_percent));
  }

  // Poses too sparse for RPE
  if (report.rpe_second.pairs == 0) {
    report.warnings.push_back(
        fmt::format("no two matched poses are {} s apart: RPE over time is left out", report.rpe_seconds));
  }
}

}  // namespace

/// The options of evaluate trajectory.
void TrajectoryOptions::declare(core::OptionTable& table) {
  table.choice(
      "align", align,
      {{"none", TrajectoryAlignment::kNone},
       {"se3", TrajectoryAlignment::kSe3},
       {"sim3", TrajectoryAlignment::kSim3},
       {"start", TrajectoryAlignment::kStart}},
      "Alignment of the estimate with the truth: none, least squares over all positions (sim3: with a "
      "scale), or first pose");
  table.text("body", body,
             "Pose of the camera in the body whose poses the truth holds, x,y,z,qx,qy,qz,qw, to take it out; "
             "fit: find it from the motion");
  table.number("max_dt", max_dt_s, {1e-4, 10.0}, "s",
               "The truth is interpolated, but not over gaps longer than twice this");
  table.integer("rpe_frames", rpe_frames, {1, 100000}, "",
                "Frames between the two poses of a relative error");
  table.number("rpe_seconds", rpe_seconds, {1e-3, 1e5}, "s",
               "Seconds between the two poses of a relative error");
}

core::Result<TrajectoryReport> evaluate_trajectory(const Trajectory& estimate, const Trajectory& truth,
                                                   const TrajectoryOptions& options,
                                                   const std::vector<double>& frame_stamps) {
  // Options, poses and stamps must be valid
  if (const auto ok = check_options(options); !ok) return tl::unexpected(ok.error());
  auto sorted_estimate = checked("estimated", estimate);
  if (!sorted_estimate) return tl::unexpected(sorted_estimate.error());
  auto sorted_truth = checked("true", truth);
  if (!sorted_truth) return tl::unexpected(sorted_truth.error());
  for (const double s : frame_stamps) {
    if (!std::isfinite(s)) return core::input_error("the list of frames has a stamp that is not finite");
  }

  // A rotation needs three positions
  auto [matches, ambiguous] = match(*sorted_estimate, *sorted_truth, options.max_dt_s);
  const std::size_t needed = fits_positions(options.align) ? 3 : 1;
  if (matches.size() < needed) {
    return core::input_error(
        too_few_message(matches.size(), needed, *sorted_estimate, *sorted_truth, options.max_dt_s) +
        ambiguous_message(ambiguous));
  }

  // The report repeats the options that matter
  TrajectoryReport report;
  report.align = options.align;
  report.rpe_frames = options.rpe_frames;
  report.rpe_seconds = options.rpe_seconds;
  report.estimated = sorted_estimate->size();
  report.matched = matches.size();

  // The body's pose is removed before the alignment
  auto body = take_body_out(options, matches, *sorted_truth);
  if (!body) return tl::unexpected(body.error());
  report.body = *body;
  report.truth = std::move(*sorted_truth);
  const geometry::ScaledRigid3 alignment = align_path(matches, options.align);
  report.truth_from_estimate = alignment.rigid;
  if (options.align == TrajectoryAlignment::kSim3) report.scale = scale_report(matches, alignment.scale);

  // Absolute errors
  for (const MatchedPose& m : matches) report.poses.push_back(pose_error(m, alignment));
  for (std::size_t i = 0; i + 1 < matches.size(); ++i) {
    report.path_m += (matches[i + 1].truth.translation - matches[i].truth.translation).norm();
  }

  // Tracked share, by stamps of frames
  report.duration_s = matches.back().stamp - matches.front().stamp;
  add_absolute_errors(report);
  const std::vector<long long> frame_keys = sorted_keys(frame_stamps);
  add_tracked_share(*sorted_estimate, frame_keys, report);

  // Relative errors over frames and over time
  report.rpe_frame = relative_error(
      report.poses, frame_pairs(report.poses, frame_keys, static_cast<std::size_t>(options.rpe_frames)));
  report.rpe_second =
      relative_error(report.poses, time_pairs(report.poses, options.rpe_seconds, options.max_dt_s));
  add_warnings(matches, report);
  if (ambiguous > 0) report.warnings.push_back(ambiguous_message(ambiguous).substr(2));
  return report;
}

}  // namespace plumbline::evaluate
