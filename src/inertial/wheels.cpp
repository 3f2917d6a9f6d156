// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "plumbline/inertial/body_motion.hpp"

namespace plumbline::inertial {

using Eigen::Vector3d;
using geometry::Rigid3;
using geometry::Vector6d;

namespace {

constexpr int kUnknowns = 8;  // log of scale, log of turn scale, pose of the camera on the body (6)
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;

constexpr double kAgrees = 16.8;  // chi-square, 6 degrees of freedom, 99 %

/// The calibration after a step of the unknowns.
WheelCalibration changed(const WheelCalibration& how, const Unknowns& by) {
  WheelCalibration result = how;
  result.scale *= std::exp(by[0]);
  result.turn_scale *= std::exp(by[1]);
  const Vector3d phi = by.segment<3>(2), shift = by.tail<3>();
  result.body_from_camera = {how.body_from_camera.rotation * geometry::exp_so3(phi),
                             how.body_from_camera.translation + shift};
  return result;
}

/// Standard deviations beforehand: wheels are right to 10 %, the camera is mounted as given, if that is
/// known.
Unknowns expected_sigma(bool known) {
  const double turn = known ? 0.03 : 0.3, place = known ? 0.02 : 0.5;
  return (Unknowns() << 0.1, 0.1, turn, turn, turn, place, place, place).finished();
}

/// Difference of a stretch by wheels and by the camera, in standard deviations.
Vector6d difference(const WheelStretch& stretch, const WheelCalibration& how) {
  const double length = stretch.camera.translation.norm();
  const double angle = geometry::rotation_angle(stretch.camera.rotation);
  const double sigma_m = 0.003 + 0.01 * length + 0.02 * angle, sigma_rad = 0.006 + 0.02 * angle;
  Vector6d off = geometry::log_se3(camera_motion(stretch.body, how) * stretch.camera.inverse());
  off.head<3>() /= sigma_m;
  off.tail<3>() /= sigma_rad;
  return off;
}

struct WheelFit {
  WheelCalibration how;
  double cost = 0.0;
};

/// Robust least squares, in which slip loses its weight: Gauss-Newton with numeric derivatives.
WheelFit fit_wheels(const std::vector<WheelStretch>& stretches, const WheelCalibration& start, bool known) {
  constexpr int kRounds = 8;
  constexpr double kStep = 1e-5;
  const Unknowns sigma = expected_sigma(known);
  WheelFit fit{start, 0.0};
  Unknowns moved = Unknowns::Zero();
  Normal information = Normal::Identity();
  double worth = 1.0;

  // The expectation counts as an observation.
  for (int round = 0; round < kRounds; ++round) {
    information = sigma.cwiseInverse().cwiseAbs2().asDiagonal();
    Unknowns gradient = sigma.cwiseInverse().cwiseAbs2().asDiagonal() * moved;
    fit.cost = 0.0;
    std::size_t agreeing = 0;
    double squares = 0.0;

    // Cauchy cost of each stretch.
    for (const WheelStretch& stretch : stretches) {
      const Vector6d off = difference(stretch, fit.how);
      const double square = off.squaredNorm();
      fit.cost += std::log1p(square / kAgrees);
      const bool agrees = square < kAgrees;
      if (agrees) ++agreeing;
      if (agrees) squares += square;

      // Slip has no weight in the end.
      const double weight = round + 3 < kRounds ? 1.0 / (1.0 + square / kAgrees) : agrees ? 1.0 : 0.0;
      Eigen::Matrix<double, 6, kUnknowns> by;
      for (int k = 0; k < kUnknowns; ++k)
        by.col(k) = (difference(stretch, changed(fit.how, kStep * Unknowns::Unit(k))) - off) / kStep;
      information += weight * by.transpose() * by;
      gradient += weight * by.transpose() * off;
    }

    const Unknowns step = -information.ldlt().solve(gradient);

    // Noise is estimated from stretches that agree.
    moved += step;
    fit.how = changed(fit.how, step);
    fit.how.agreeing =
        static_cast<double>(agreeing) / static_cast<double>(std::max<std::size_t>(1, stretches.size()));
    worth = std::max(0.3, squares / std::max(1.0, 6.0 * static_cast<double>(agreeing)));
  }
  fit.how.scale_sigma = std::sqrt(worth * information.inverse()(0, 0));
  return fit;
}

}  // namespace

Rigid3 camera_motion(const Rigid3& body, const WheelCalibration& how) {
  // Translation in the first frame of the body, for the distance travelled is scaled.
  const Vector3d way = how.scale * (body.rotation.transpose() * body.translation);
  const Eigen::Matrix3d turn = geometry::exp_so3(how.turn_scale * geometry::log_so3(body.rotation));
  return how.body_from_camera.inverse() * Rigid3(turn, turn * way) * how.body_from_camera;
}

std::optional<Rigid3> wheels_at(const std::vector<dataset::OdometryReading>& readings, double stamp) {
  constexpr double kMostPause_s = 0.25;
  const auto next = std::upper_bound(readings.begin(), readings.end(), stamp,
                                     [](double at, const auto& reading) { return at < reading.stamp; });
  if (next == readings.begin()) return std::nullopt;
  const auto& before = *(next - 1);

  // Nothing is extrapolated past the last reading.
  if (next == readings.end())
    return before.stamp == stamp ? std::optional<Rigid3>(before.odom_from_body) : std::nullopt;
  const double gap = next->stamp - before.stamp;
  if (gap > kMostPause_s) return std::nullopt;
  return geometry::interpolate(before.odom_from_body, next->odom_from_body, (stamp - before.stamp) / gap);
}

WheelCalibration calibrate_wheels(const std::vector<WheelStretch>& stretches, const Rigid3& start,
                                  bool known) {
  // Without a known mounting the camera's heading may be any.
  WheelFit best;
  best.cost = 1e300;
  for (int quarter = 0; quarter < (known ? 1 : 4); ++quarter) {
    WheelCalibration from;
    const Eigen::AngleAxisd turn(0.5 * M_PI * quarter, Vector3d::UnitZ());
    from.body_from_camera = Rigid3(turn.toRotationMatrix(), Vector3d::Zero()) * start;
    const WheelFit fit = fit_wheels(stretches, from, known);
    if (fit.cost < best.cost) best = fit;
  }
  return best.how;
}

}  // namespace plumbline::inertial
