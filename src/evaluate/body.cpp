// SPDX-License-Identifier: BSD-3-Clause
#include "body.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "plumbline/core/numbers.hpp"
#include "plumbline/geometry/alignment.hpp"

namespace plumbline::evaluate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Rigid3;

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr int kRounds = 20;  // of least squares with new weights

/// The motion between two matched poses, of the body and of the camera, each in its own first frame.
struct Motion {
  Rigid3 body;
  Rigid3 camera;
  Vector3d body_turn;  ///< axis times angle
  Vector3d camera_turn;
};

/// Motions that turn enough to determine directions, between poses that are 1, 2, 4, 8 ... apart.
std::vector<Motion> turning_motions(const std::vector<MatchedPose>& poses) {
  // Long trajectories are thinned
  constexpr std::size_t kMostPoses = 1000;
  constexpr double kLeastTurn_rad = 5.0 * kDegree;
  constexpr double kMostTurn_rad = 150.0 * kDegree;  // beyond, noise may turn the axis over
  const std::size_t every = (poses.size() + kMostPoses - 1) / kMostPoses;

  // Doubled distances sample slow and fast turns
  std::vector<Motion> motions;
  for (std::size_t apart = every; apart < poses.size(); apart *= 2) {
    for (std::size_t i = 0; i + apart < poses.size(); i += every) {
      Motion motion;
      motion.body = poses[i].truth.inverse() * poses[i + apart].truth;
      motion.camera = poses[i].estimate.inverse() * poses[i + apart].estimate;
      motion.body_turn = geometry::log_so3(motion.body.rotation);
      motion.camera_turn = geometry::log_so3(motion.camera.rotation);

      // Small turns hardly show their axis
      const double turn_rad = motion.camera_turn.norm();
      if (turn_rad >= kLeastTurn_rad && std::max(turn_rad, motion.body_turn.norm()) <= kMostTurn_rad)
        motions.push_back(motion);
    }
  }
  return motions;
}

/// Weights of Cauchy's loss, whose width is the usual size of the residuals.
std::vector<double> cauchy_weights(const std::vector<double>& residuals) {
  const double width = 1.4826 * core::median(residuals) + 1e-9;
  std::vector<double> weights;
  weights.reserve(residuals.size());
  for (const double r : residuals) weights.push_back(1.0 / (1.0 + (r / width) * (r / width)));
  return weights;
}

/// Rotation that turns the axes of the camera's motions into those of the body's.
Matrix3d fit_turn(const std::vector<Motion>& motions) {
  Matrix3d turn = Matrix3d::Identity();
  std::vector<double> weights(motions.size(), 1.0);
  for (int round = 0; round < kRounds; ++round) {
    Matrix3d sum = Matrix3d::Zero();
    for (std::size_t i = 0; i < motions.size(); ++i)
      sum += weights[i] * motions[i].body_turn * motions[i].camera_turn.transpose();

    turn = geometry::nearest_rotation(sum);

    std::vector<double> residuals;
    residuals.reserve(motions.size());
    for (const Motion& m : motions) residuals.push_back((m.body_turn - turn * m.camera_turn).norm());
    weights = cauchy_weights(residuals);
  }
  return turn;
}

/// The camera's place in the body: (R_A - I) x = R_X s t_B - t_A for all motions; s is 1 unless `scaled`.
Vector3d fit_lever(const std::vector<Motion>& motions, const Matrix3d& turn, bool scaled) {
  // Iteratively reweighted least squares
  Eigen::Vector4d solution(0.0, 0.0, 0.0, 1.0);
  std::vector<double> weights(motions.size(), 1.0);
  for (int round = 0; round < kRounds; ++round) {
    // Weighted normal equations
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();

    // Each motion gives three equations
    for (std::size_t i = 0; i < motions.size(); ++i) {
      const Vector3d step = turn * motions[i].camera.translation;
      Eigen::Matrix<double, 3, 4> rows;
      rows << motions[i].body.rotation - Matrix3d::Identity(), scaled ? Vector3d(-step) : Vector3d::Zero();
      const Vector3d wanted = (scaled ? Vector3d::Zero() : step) - motions[i].body.translation;
      normal += weights[i] * rows.transpose() * rows;
      right += weights[i] * rows.transpose() * wanted;
    }

    // Without a scale the fourth unknown is 1
    if (!scaled) {
      normal(3, 3) = 1.0;
      right(3) = 1.0;
    }
    solution = normal.ldlt().solve(right);

    // Outliers lose weight with their residual
    std::vector<double> residuals;
    residuals.reserve(motions.size());

    // Distance that the lever leaves unexplained
    for (const Motion& m : motions) {
      const Vector3d x = solution.head<3>();
      residuals.push_back(
          (m.body.rotation * x - x + m.body.translation - solution(3) * (turn * m.camera.translation))
              .norm());
    }
    weights = cauchy_weights(residuals);
  }
  return solution.head<3>();
}

/// Usual turn about the second of the main axes about which the camera turns, radians.
double second_turn(const std::vector<Motion>& motions) {
  Matrix3d scatter = Matrix3d::Zero();
  for (const Motion& m : motions) scatter += m.camera_turn * m.camera_turn.transpose();
  scatter /= static_cast<double>(motions.size());
  const Vector3d squares = Eigen::SelfAdjointEigenSolver<Matrix3d>(scatter).eigenvalues();
  return std::sqrt(std::max(0.0, squares(1)));
}

/// RMS of the distances and of the angles between poses, metres and degrees.
std::pair<double, double> rms_errors(const std::vector<MatchedPose>& poses, TrajectoryAlignment align,
                                     const Rigid3& body_from_camera) {
  std::vector<MatchedPose> of_camera = poses;
  for (MatchedPose& pose : of_camera) pose.truth = pose.truth * body_from_camera;
  const geometry::ScaledRigid3 alignment = align_path(of_camera, align);

  double squares_m = 0.0;
  double squares_rad = 0.0;
  for (const MatchedPose& pose : of_camera) {
    const Rigid3 estimate = aligned(alignment, pose.estimate);
    const double angle = geometry::rotation_angle(pose.truth.rotation.transpose() * estimate.rotation);
    squares_m += (estimate.translation - pose.truth.translation).squaredNorm();
    squares_rad += angle * angle;
  }
  const auto count = static_cast<double>(poses.size());
  return {std::sqrt(squares_m / count), std::sqrt(squares_rad / count) / kDegree};
}

/// Usual difference of the turns of body and camera that a rotation between them leaves, radians.
double usual_rest(const std::vector<Motion>& motions, const Matrix3d& turn) {
  std::vector<double> rest;
  rest.reserve(motions.size());
  for (const Motion& m : motions) rest.push_back((m.body_turn - turn * m.camera_turn).norm());
  return core::median(rest);
}

}  // namespace

/// The pose of the camera in the body, with a unit quaternion.
core::Result<Rigid3> parse_body(const std::string& text) {
  std::vector<double> numbers;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t to = std::min(text.find(',', from), text.size());
    const auto number = core::to_number(text.substr(from, to - from));
    if (number && std::isfinite(*number)) numbers.push_back(*number);
    from = to + 1;
  }
  if (numbers.size() != 7 || std::count(text.begin(), text.end(), ',') != 6)
    return core::usage_error(fmt::format(
        "--body: '{}' is neither 'fit' nor the pose of the camera in the body, x,y,z,qx,qy,qz,qw", text));

  const Eigen::Quaterniond turn(numbers[6], numbers[3], numbers[4], numbers[5]);
  if (std::abs(turn.norm() - 1.0) > 0.01)
    return core::usage_error("--body: qx,qy,qz,qw are not a rotation: their squares must add up to 1");
  return Rigid3(turn, {numbers[0], numbers[1], numbers[2]});
}

std::string body_text(const Rigid3& body_from_camera) {
  const Vector3d& t = body_from_camera.translation;
  const Eigen::Quaterniond q = body_from_camera.quaternion();
  return fmt::format("{},{},{},{},{},{},{}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

core::Result<Rigid3> fit_body(const std::vector<MatchedPose>& poses, bool scaled) {
  // Limits below which the pose is not observable
  constexpr std::size_t kFewest = 10;
  constexpr double kLeastSecondTurn_rad = 0.5 * kDegree;
  constexpr double kOverNoise = 5.0;

  // Without turns the lever is not observable
  const std::vector<Motion> motions = turning_motions(poses);
  const char* remedy = "; if it is known, give it as --body x,y,z,qx,qy,qz,qw";
  if (motions.size() < kFewest) {
    return core::input_error(fmt::format(
        "--body fit: the camera hardly turns (only {} motions by 5 to 150 degrees between matched "
        "poses), so that its pose in the body is not determined{}",
        motions.size(), remedy));
  }

  // Turns about two axes determine the lever
  const Matrix3d turn = fit_turn(motions);
  const double second = second_turn(motions);
  if (second < std::max(kLeastSecondTurn_rad, kOverNoise * usual_rest(motions, turn))) {
    return core::input_error(fmt::format(
        "--body fit: the camera turns about one axis only ({:.2f} degrees about any other), so that "
        "its pose in the body is not determined{}",
        second / kDegree, remedy));
  }
  return Rigid3(turn, fit_lever(motions, turn, scaled));
}

/// Errors before and after the body's pose is removed.
BodyReport body_report(const std::vector<MatchedPose>& poses, TrajectoryAlignment align,
                       const Rigid3& body_from_camera) {
  BodyReport report;
  report.body_from_camera = body_from_camera;
  report.lever_m = body_from_camera.translation.norm();
  report.turn_deg = geometry::rotation_angle(body_from_camera.rotation) / kDegree;
  std::tie(report.ate_before_m, report.orientation_before_deg) = rms_errors(poses, align, {});
  std::tie(report.ate_after_m, report.orientation_after_deg) = rms_errors(poses, align, body_from_camera);
  return report;
}

/// Reported only if the lever or the turn explains much of the error.
std::optional<BodyReport> notable_body(const std::vector<MatchedPose>& poses, TrajectoryAlignment align) {
  constexpr double kLever_m = 0.01;
  constexpr double kTurn_deg = 0.5;
  constexpr double kMostLeft = 0.7;  // share of the error
  const auto body = fit_body(poses, align == TrajectoryAlignment::kSim3);
  if (!body) return std::nullopt;

  // A large part of the error must vanish
  const BodyReport report = body_report(poses, align, *body);
  const bool lever = report.lever_m >= kLever_m && report.ate_after_m <= kMostLeft * report.ate_before_m;
  const bool turn = report.turn_deg >= kTurn_deg &&
                    report.orientation_after_deg <= kMostLeft * report.orientation_before_deg;
  return lever || turn ? std::optional(report) : std::nullopt;
}

/// Names the lever, the turn and what removing them gains.
std::string body_warning(const BodyReport& body) {
  return fmt::format(
      "the truth seems to hold the poses of a body, such as a marker or an IMU, in which the camera stays "
      "{:.1f} cm away and turned by {:.1f} degrees: with that taken out ATE is {:.4f} m instead of {:.4f} m, "
      "and the orientation error {:.2f} degrees instead of {:.2f}; evaluate trajectory --body fit takes it "
      "out",
      100.0 * body.lever_m, body.turn_deg, body.ate_after_m, body.ate_before_m, body.orientation_after_deg,
      body.orientation_before_deg);
}

}  // namespace plumbline::evaluate
