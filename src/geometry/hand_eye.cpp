// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/geometry/hand_eye.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "plumbline/geometry/alignment.hpp"

namespace plumbline::geometry {
namespace {

constexpr std::array<double, 3> kDurations_s = {0.5, 1.0, 2.0};

// Beyond these standard deviations a direction counts as not determined.
constexpr double kFree_m = 0.03;
constexpr double kFree_rad = 0.02;

// No tracker is better over half a second; motions without noise would claim an accuracy that they have not.
constexpr double kLeast_m = 5e-4;
constexpr double kLeast_rad = 2e-4;

// Errors that a motion may have before anything is known of its noise.
constexpr double kUsual_m = 0.01;
constexpr double kUsual_rad = 0.005;

// Beyond that the axis of a rotation becomes ambiguous.
constexpr double kLargestTurn_rad = 2.5;

/// Errors of one motion at an estimate.
struct Residual {
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
};

/// Standard deviations of a component of the residuals.
struct Noise {
  double m = kUsual_m;
  double rad = kUsual_rad;
};
using NoiseOfDurations = std::array<Noise, kDurations_s.size()>;

/// A motion with its rotations as vectors.
struct Equation {
  const CommonMotion* motion;
  Eigen::Vector3d reference_turn;
  Eigen::Vector3d camera_turn;

  [[nodiscard]] Residual residual(const Rigid3& x) const {
    const Rigid3& a = motion->reference_start_from_end;
    const Rigid3& b = motion->camera_start_from_end;
    return {reference_turn - x.rotation * camera_turn,
            a.rotation * x.translation + a.translation - x.rotation * b.translation - x.translation};
  }
};
using Equations = std::vector<Equation>;

Equations equations_of(const std::vector<CommonMotion>& motions) {
  Equations equations;
  for (const CommonMotion& motion : motions) {
    const Eigen::Vector3d a = log_so3(motion.reference_start_from_end.rotation);
    const Eigen::Vector3d b = log_so3(motion.camera_start_from_end.rotation);
    if (std::max(a.norm(), b.norm()) < kLargestTurn_rad) equations.push_back({&motion, a, b});
  }
  return equations;
}

/// Mean square of the six components, in standard deviations.
double square_of(const Residual& r, const Noise& noise) {
  return (r.shift.squaredNorm() / (noise.m * noise.m) + r.turn.squaredNorm() / (noise.rad * noise.rad)) / 6.0;
}

const Noise& noise_of(const Equation& equation, const NoiseOfDurations& noise) {
  return noise[static_cast<std::size_t>(equation.motion->duration)];
}

/// The position that fits best with a given rotation; where it is free, near zero.
Eigen::Vector3d position_for(const Eigen::Matrix3d& rotation, const Equations& equations) {
  constexpr double kHeld = 1e-9;
  Eigen::Matrix3d h = kHeld * Eigen::Matrix3d::Identity();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  for (const Equation& e : equations) {
    const Rigid3& a = e.motion->reference_start_from_end;
    const Eigen::Matrix3d j = a.rotation - Eigen::Matrix3d::Identity();
    const Eigen::Vector3d b = rotation * e.motion->camera_start_from_end.translation - a.translation;
    h += e.motion->weight * j.transpose() * j;
    g += e.motion->weight * j.transpose() * b;
  }
  return h.ldlt().solve(g);
}

double robust_cost(const Rigid3& x, const Equations& equations) {
  double cost = 0.0;
  for (const Equation& e : equations)
    cost += e.motion->weight * std::log1p(square_of(e.residual(x), Noise{}));
  return cost;
}

/// Rotation by the singular value decomposition of the axes, position by linear least squares.
Rigid3 closed_form(const Equations& equations) {
  constexpr int kTurns = 24;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  for (const Equation& e : equations) axes += e.motion->weight * e.reference_turn * e.camera_turn.transpose();

  // If all axes are alike, as on wheels, they leave the turn about them free: the shifts decide on it.
  const Eigen::Matrix3d base = nearest_rotation(axes);
  const Eigen::Vector3d axis =
      Eigen::JacobiSVD<Eigen::Matrix3d>(axes, Eigen::ComputeFullU).matrixU().col(0).normalized();

  Rigid3 best;
  double least = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < kTurns; ++turn) {
    const Eigen::AngleAxisd about(2.0 * M_PI * turn / kTurns, axis);
    const Eigen::Matrix3d rotation = about.toRotationMatrix() * base;
    const Rigid3 candidate(rotation, position_for(rotation, equations));
    const double cost = robust_cost(candidate, equations);
    if (cost < least) best = candidate;
    least = std::min(least, cost);
  }

  return best;
}

double median_size(std::vector<double>& values) {
  constexpr double kNormal = 1.4826;  // standard deviations per median of the absolute values
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return kNormal * *middle;
}

NoiseOfDurations measured_noise(const Rigid3& x, const Equations& equations) {
  NoiseOfDurations noise;
  for (std::size_t duration = 0; duration < noise.size(); ++duration) {
    std::vector<double> turns, shifts;
    for (const Equation& e : equations) {
      if (e.motion->duration != static_cast<int>(duration)) continue;
      const Residual r = e.residual(x);
      for (Eigen::Index i = 0; i < 3; ++i) {
        turns.push_back(std::abs(r.turn[i]));
        shifts.push_back(std::abs(r.shift[i]));
      }
    }
    noise[duration] = {std::max(kLeast_m, median_size(shifts)), std::max(kLeast_rad, median_size(turns))};
  }
  return noise;
}

/// Normal equations of a step (rho, phi).
struct Normal {
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
};

void add_prior(const HandEyePrior& prior, const Rigid3& x, Normal& normal) {
  Vector6d weights;
  weights << prior.sigma_m.cwiseAbs2().cwiseInverse(), prior.sigma_rad.cwiseAbs2().cwiseInverse();
  Vector6d off;
  off << x.translation - prior.reference_from_camera.translation,
      log_so3(x.rotation * prior.reference_from_camera.rotation.transpose());
  normal.information += Matrix6d(weights.asDiagonal());
  normal.gradient += weights.cwiseProduct(off);
}

Normal linearised(const Rigid3& x, const Equations& equations, const NoiseOfDurations& noise,
                  const HandEyePrior& prior) {
  constexpr double kLarge2 = 4.0;  // two standard deviations, squared: beyond it a motion counts less
  Normal normal;
  for (const Equation& e : equations) {
    const Residual r = e.residual(x);
    const Noise& sigma = noise_of(e, noise);
    const double weight = e.motion->weight / (1.0 + square_of(r, sigma) / kLarge2);

    // x + rho, Exp(phi) * rotation
    Eigen::Matrix<double, 3, 6> turn = Eigen::Matrix<double, 3, 6>::Zero(), shift;
    turn.rightCols<3>() = skew(x.rotation * e.camera_turn);
    shift << e.motion->reference_start_from_end.rotation - Eigen::Matrix3d::Identity(),
        skew(x.rotation * e.motion->camera_start_from_end.translation);

    const double turn_weight = weight / (sigma.rad * sigma.rad), shift_weight = weight / (sigma.m * sigma.m);
    normal.information += turn_weight * turn.transpose() * turn + shift_weight * shift.transpose() * shift;
    normal.gradient += turn_weight * turn.transpose() * r.turn + shift_weight * shift.transpose() * r.shift;
  }

  add_prior(prior, x, normal);
  return normal;
}

/// Metres and radians that count as alike: the limits of a direction that is determined.
Matrix6d limits() {
  Vector6d scale;
  scale << Eigen::Vector3d::Constant(kFree_m), Eigen::Vector3d::Constant(kFree_rad);
  return scale.asDiagonal();
}

/// Directions that are not determined, and the covariance.
void judge(const Matrix6d& information, HandEye& result) {
  const Matrix6d scale = limits();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> parts(scale * information * scale);
  Vector6d variances;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double known = parts.eigenvalues()[i];
    variances[i] = 1.0 / std::max(known, 1e-12);
    if (known >= 1.0) continue;
    const Vector6d direction = parts.eigenvectors().col(i);
    if (direction.tail<3>().squaredNorm() > 0.5) {
      result.free_rotation = true;
    } else {
      result.free_positions.emplace_back(direction.head<3>().normalized());
    }
  }

  const Matrix6d axes = scale * parts.eigenvectors();
  result.covariance = axes * variances.asDiagonal() * axes.transpose();
}

/// Squares of differences between the angles by which both cameras turn, at an offset of their clocks.
struct AngleFit {
  double cost = std::numeric_limits<double>::infinity();  ///< mean
  double independent = 0.0;
};

AngleFit angles_at(const Trajectory& reference, Trajectory camera, double offset_s) {
  constexpr double kLarge_rad = 0.05;  // a difference of this size is an outlier
  for (StampedPose& pose : camera) pose.stamp += offset_s;
  AngleFit fit;
  double sum = 0.0;
  for (const CommonMotion& motion : common_motions(reference, camera)) {
    if (motion.duration != 0) continue;
    const double off = rotation_angle(motion.reference_start_from_end.rotation) -
                       rotation_angle(motion.camera_start_from_end.rotation);
    sum += motion.weight * std::min(off * off, kLarge_rad * kLarge_rad);
    fit.independent += motion.weight;
  }
  if (fit.independent > 0.0) fit.cost = sum / fit.independent;
  return fit;
}

}  // namespace

std::optional<Rigid3> pose_between(const Trajectory& trajectory, double stamp, double longest_s) {
  constexpr double kSame_s = 1e-6;
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), stamp - kSame_s,
                                      [](const StampedPose& pose, double s) { return pose.stamp < s; });
  if (after == trajectory.end()) return std::nullopt;
  if (after->stamp - stamp < kSame_s) return after->world_from_camera;
  if (after == trajectory.begin()) return std::nullopt;

  const StampedPose& a = *(after - 1);
  const double gap = after->stamp - a.stamp;
  if (gap > longest_s) return std::nullopt;
  return interpolate(a.world_from_camera, after->world_from_camera, (stamp - a.stamp) / gap);
}

std::vector<CommonMotion> common_motions(const Trajectory& reference, const Trajectory& camera) {
  constexpr double kStep_s = 0.1, kSame_s = 1e-4;
  std::vector<CommonMotion> motions;
  for (std::size_t duration = 0; duration < kDurations_s.size(); ++duration) {
    const double longest = kDurations_s[duration];
    double begun = -std::numeric_limits<double>::infinity();
    std::size_t end = 0;  // only grows, as the starts do

    for (const StampedPose& start : camera) {
      if (start.stamp - begun < kStep_s - kSame_s) continue;

      // The frame at which the motion ends.
      while (end < camera.size() && camera[end].stamp < start.stamp + longest - kSame_s) ++end;
      if (end == camera.size()) break;
      const StampedPose& stop = camera[end];
      if (stop.stamp - start.stamp > longest + kInterpolated_s) continue;

      // The reference camera at the stamps of the other one.
      const auto from = pose_between(reference, start.stamp, kInterpolated_s);
      const auto to = pose_between(reference, stop.stamp, kInterpolated_s);
      if (!from || !to) continue;

      const double alone = std::min(1.0, (start.stamp - begun) / longest);
      motions.push_back({from->inverse() * *to, start.world_from_camera.inverse() * stop.world_from_camera,
                         static_cast<int>(duration), alone / static_cast<double>(kDurations_s.size())});
      begun = start.stamp;
    }
  }
  return motions;
}

HandEye find_hand_eye(const std::vector<CommonMotion>& motions, const HandEyePrior& prior) {
  constexpr int kSteps = 50;
  HandEye result;
  const Equations equations = equations_of(motions);
  result.motions = equations.size();
  for (const Equation& e : equations) result.independent += e.motion->weight;

  // A prior of the rotation replaces the closed form, which knows nothing of it.
  const bool turn_known = prior.sigma_rad.allFinite();
  Rigid3 x = turn_known ? prior.reference_from_camera : closed_form(equations);
  if (turn_known) x.translation = position_for(x.rotation, equations);
  if (prior.sigma_m.allFinite()) x.translation = prior.reference_from_camera.translation;

  // Directions without information do not move.
  const Matrix6d scale = limits();
  NoiseOfDurations noise;
  Normal normal = linearised(x, equations, noise, prior);
  for (int step = 0; step < kSteps; ++step) {
    const Matrix6d damped = scale * normal.information * scale + 1e-6 * Matrix6d::Identity();
    const Vector6d move = -(scale * damped.ldlt().solve(scale * normal.gradient));
    x = {exp_so3(move.tail<3>()) * x.rotation, x.translation + move.head<3>()};

    // The noise is that of the motions about the present estimate.
    noise = measured_noise(x, equations);
    normal = linearised(x, equations, noise, prior);
    if (move.head<3>().norm() < 1e-9 && move.tail<3>().norm() < 1e-9) break;
  }

  result.reference_from_camera = Rigid3(Eigen::Quaterniond(x.rotation), x.translation);
  result.residual_m = noise[1].m;
  result.residual_rad = noise[1].rad;
  judge(normal.information, result);
  return result;
}

ClockOffset find_clock_offset(const Trajectory& reference, const Trajectory& camera) {
  constexpr double kSearched_s = 0.5, kCoarse_s = 0.02, kLeastIndependent = 5.0;

  // The whole range first, since angles that repeat have several minima.
  double best = 0.0;
  AngleFit least = angles_at(reference, camera, 0.0);
  const auto look = [&](double offset) {
    const AngleFit fit = angles_at(reference, camera, offset);
    if (fit.independent < kLeastIndependent || fit.cost >= least.cost) return;
    best = offset;
    least = fit;
  };

  const int each_side = static_cast<int>(std::lround(kSearched_s / kCoarse_s));
  for (int i = -each_side; i <= each_side; ++i) look(kCoarse_s * i);

  // Eight halvings: from 10 ms to less than 0.1 ms.
  for (int halving = 1; halving <= 8; ++halving) {
    const double middle = best;
    const double step = std::ldexp(kCoarse_s, -halving);
    look(middle - step);
    look(middle + step);
  }

  // A parabola through the minimum: its curvature and height give the standard deviation.
  constexpr double kArm_s = 0.02;
  if (least.independent < kLeastIndependent) return {};
  const double before = angles_at(reference, camera, best - kArm_s).cost;
  const double after = angles_at(reference, camera, best + kArm_s).cost;
  const double curvature = (before + after - 2.0 * least.cost) / (kArm_s * kArm_s);
  if (!(curvature > 0.0)) return {};
  return {best,
          std::sqrt(2.0 * std::max(least.cost, kLeast_rad * kLeast_rad) / (curvature * least.independent))};
}

}  // namespace plumbline::geometry
