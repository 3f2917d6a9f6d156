// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Trajectory error against truth: ATE and RPE (Sturm et al., A Benchmark for the Evaluation of RGB-D SLAM
// Systems, IROS 2012). Definitions and formulas: docs/guide/evaluate.md.
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/evaluate/statistics.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::evaluate {

enum class TrajectoryAlignment {
  kNone,   ///< compared as they are
  kSe3,    ///< least squares over all matched positions (Horn 1987)
  kSim3,   ///< the same with a scale (Umeyama 1991)
  kStart,  ///< the first matched pose of the estimate is moved onto the truth
};

struct TrajectoryOptions {
  TrajectoryAlignment align = TrajectoryAlignment::kSe3;
  /// Pose of the camera in the body whose poses the truth holds, "x,y,z,qx,qy,qz,qw"; "fit": found from the
  /// motion; empty: the truth is the camera's.
  std::string body;
  double max_dt_s = 0.02;    ///< truth is interpolated; gaps over 2*max_dt_s are not bridged
  int rpe_frames = 1;        ///< frames between the two poses of an RPE pair
  double rpe_seconds = 1.0;  ///< seconds between the two poses of an RPE pair
  void declare(core::OptionTable& table);
};

/// One matched pose, in the frame of the truth.
struct PoseError {
  double stamp = 0.0;                                 ///< seconds
  geometry::Rigid3 estimate;                          ///< after alignment
  geometry::Rigid3 truth;                             ///< interpolated at `stamp`
  Eigen::Vector3d error_m = Eigen::Vector3d::Zero();  ///< estimate - truth, axes of the truth's frame
  double distance_m = 0.0;                            ///< |error_m|
  double rotation_deg = 0.0;                          ///< angle between the orientations, [0, 180]
};

/// Relative pose error over a fixed step: E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j), Q truth, P estimate.
struct RelativeError {
  std::size_t pairs = 0;
  Statistics translation_m;  ///< |trans E|
  Statistics rotation_deg;   ///< angle of rot E
};

/// A component of a result that is not part of its main trajectory: aligned with the truth by itself.
struct ComponentReport {
  std::string name;
  std::size_t poses = 0;
  std::optional<double> percent;  ///< percentage of all frames; none: their number is not known
  Statistics ate_m;               ///< zero when too few poses have truth
};

/// Factor on the lengths of an estimate, such as one of wrong depth units.
struct ScaleReport {
  double value = 1.0;    ///< true length / estimated length
  double sigma = 0.0;    ///< standard deviation, from leaving out a tenth of the path at a time
  bool doubtful = true;  ///< true: it does not differ from 1 by more than chance may do
};

/// The constant pose of the camera in a body whose poses the truth holds.
struct BodyReport {
  geometry::Rigid3 body_from_camera;
  double lever_m = 0.0;
  double turn_deg = 0.0;
  bool removed = false;  ///< true: the errors of the report are those without it; false: it was only found
  double ate_before_m = 0.0;  ///< RMS before it is removed
  double ate_after_m = 0.0;   ///< RMS after it is removed
  double orientation_before_deg = 0.0;
  double orientation_after_deg = 0.0;
};

struct TrajectoryReport {
  TrajectoryAlignment align = TrajectoryAlignment::kSe3;
  geometry::Rigid3 truth_from_estimate;  ///< without the scale
  std::optional<ScaleReport> scale;      ///< with kSim3
  std::optional<BodyReport> body;        ///< if it was given, fitted, or found to matter
  std::size_t estimated = 0;             ///< poses in the estimate
  std::size_t matched = 0;               ///< number of these with truth at their stamp
  Statistics ate_m;
  Statistics rotation_deg;              ///< orientation error after the alignment
  std::array<Statistics, 3> axis_m;     ///< |error| along x, y, z
  std::array<double, 3> axis_bias_m{};  ///< mean signed error along x, y, z
  RelativeError rpe_frame;              ///< over TrajectoryOptions::rpe_frames
  RelativeError rpe_second;             ///< over TrajectoryOptions::rpe_seconds
  int rpe_frames = 1;
  double rpe_seconds = 1.0;
  double path_m = 0.0;                    ///< length of the truth over the matched poses
  double duration_s = 0.0;                ///< first to last matched pose
  std::optional<std::size_t> frames;      ///< distinct stamps of the frames list, when one was given
  std::optional<double> tracked_percent;  ///< share of them with a pose of their own stamp (to 0.1 ms)
  /// From the first listed frame (without a list: from the first truth pose) to the first pose, >= 0. None
  /// when a list was given and none of its frames has a pose.
  std::optional<double> first_pose_s;
  std::vector<ComponentReport> components;  ///< components of a result folder that has any, by name
  std::vector<PoseError> poses;             ///< matched poses, by time
  geometry::Trajectory truth;               ///< the whole truth, for drawing
  std::vector<std::string> warnings;        ///< one sentence each
};

/// `frame_stamps`: stamps of the recording's colour frames (seconds), empty when unknown.
/// Errors (kInput): an empty side, a value that is not finite, no overlap in time (both ranges are reported),
/// fewer than 3 matched poses (1 with kNone and kStart), a body that the motion does not determine. kUsage:
/// an option out of range.
core::Result<TrajectoryReport> evaluate_trajectory(const geometry::Trajectory& estimate,
                                                   const geometry::Trajectory& truth,
                                                   const TrajectoryOptions& options = {},
                                                   const std::vector<double>& frame_stamps = {});

/// A pose as the text of TrajectoryOptions::body, without loss.
std::string body_text(const geometry::Rigid3& body_from_camera);

/// Stamps of a list such as TUM's rgb.txt: the first column of every line that is not a comment; sorted.
core::Result<std::vector<double>> read_frame_stamps(const std::filesystem::path& list);

/// One JSON object: ate_m {rmse, mean, median, min, max, sse, std}, rpe {per_frame, per_second}, matched, ...
std::string to_json(const TrajectoryReport& report);
/// A table for people, several lines.
std::string to_text(const TrajectoryReport& report);

/// One of several estimates of the same truth.
struct NamedReport {
  std::string name;
  TrajectoryReport report;
};
/// {"estimates": [{"name": ..., then as above}, ...]}, in the order given.
std::string to_json(const std::vector<NamedReport>& reports);
/// One line per estimate: ATE, RPE, share tracked.
std::string to_text(const std::vector<NamedReport>& reports);

}  // namespace plumbline::evaluate
