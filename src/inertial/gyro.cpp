// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "plumbline/core/numbers.hpp"
#include "plumbline/geometry/alignment.hpp"
#include "plumbline/inertial/body_motion.hpp"

namespace plumbline::inertial {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double kMostGap_s = 0.06;     // between readings
constexpr double kMostDelay_s = 0.1;    // of stamps, either way
constexpr double kDelayStep_s = 0.005;  // of the search

/// Turn rates of camera and sensor during one step.
struct RatePair {
  Vector3d camera;
  Vector3d sensor;
  double dt = 0.0;
};

/// Turn rates of camera and sensor, for each step that the sensor covers.
std::vector<RatePair> rate_pairs(const TurnRates& rates, const std::vector<CameraStep>& steps,
                                 double delay_s) {
  std::vector<RatePair> pairs;
  for (const CameraStep& step : steps) {
    const double dt = step.to - step.from;
    const auto sensor = rates.mean(step.from + delay_s, step.to + delay_s);
    if (sensor) pairs.push_back({-geometry::log_so3(step.moved.rotation) / dt, *sensor, dt});
  }
  return pairs;
}

/// Rotation and bias with camera = R (sensor - bias), in turns; a bias is expected to be small.
GyroCalibration fit_axes(const std::vector<RatePair>& pairs) {
  constexpr int kTurns = 8;
  constexpr double kNoise_s = 0.5;  // weight of the expectation, as of so long a measurement
  GyroCalibration found;

  // In turns, for each is estimated with the other one given.
  for (int i = 0; i < kTurns; ++i) {
    // The rotation of the rates without the bias.
    Matrix3d sum = Matrix3d::Zero();
    for (const RatePair& p : pairs) sum += p.dt * p.camera * (p.sensor - found.bias).transpose();
    found.camera_from_imu = geometry::nearest_rotation(sum);

    // The bias is the mean of the differences left.
    Vector3d off = Vector3d::Zero();
    double time = kNoise_s;
    for (const RatePair& p : pairs) {
      off += p.dt * (p.sensor - found.camera_from_imu.transpose() * p.camera);
      time += p.dt;
    }
    found.bias = off / time;
  }

  // Correlation of both turn rates.
  double both = 0.0, camera = 0.0, sensor = 0.0;
  for (const RatePair& p : pairs) {
    const Vector3d turned = found.camera_from_imu * (p.sensor - found.bias);
    both += p.dt * turned.dot(p.camera);
    camera += p.dt * p.camera.squaredNorm();
    sensor += p.dt * turned.squaredNorm();
  }
  found.correlation = camera > 0.0 && sensor > 0.0 ? both / std::sqrt(camera * sensor) : 0.0;
  return found;
}

GyroCalibration fit_at(const TurnRates& rates, const std::vector<CameraStep>& steps, double delay_s) {
  GyroCalibration found = fit_axes(rate_pairs(rates, steps, delay_s));
  found.delay_s = delay_s;
  return found;
}

/// The delay of the best correlation, between those tried by the parabola through three.
GyroCalibration fit_with_delay(const TurnRates& rates, const std::vector<CameraStep>& steps) {
  const int most = static_cast<int>(std::lround(kMostDelay_s / kDelayStep_s));
  std::vector<double> correlations;
  for (int i = -most; i <= most; ++i)
    correlations.push_back(fit_at(rates, steps, i * kDelayStep_s).correlation);
  const auto best = std::max_element(correlations.begin(), correlations.end()) - correlations.begin();
  double at = static_cast<double>(best - most);

  const auto number = static_cast<std::size_t>(best);
  if (number > 0 && number + 1 < correlations.size()) {
    const double before = correlations[number - 1], here = correlations[number],
                 next = correlations[number + 1];
    const double bend = before - 2.0 * here + next;
    if (bend < 0.0) at += std::clamp(0.5 * (before - next) / bend, -0.5, 0.5);
  }
  return fit_at(rates, steps, at * kDelayStep_s);
}

}  // namespace

void TurnRates::add(const std::vector<dataset::ImuReading>& readings) {
  for (const dataset::ImuReading& r : readings) {
    if (!samples_.empty() && r.stamp <= samples_.back().stamp) continue;
    Sample sample{r.stamp, r.turn_rate, r.acceleration, Vector3d::Zero()};

    // Trapezoidal rule, so that any mean is one difference.
    if (!samples_.empty()) {
      const Sample& last = samples_.back();
      sample.integral = last.integral + 0.5 * (r.stamp - last.stamp) * (last.rate + r.turn_rate);
    }
    samples_.push_back(sample);
  }
}

std::size_t TurnRates::after(double stamp) const {
  const auto next = std::upper_bound(samples_.begin(), samples_.end(), stamp,
                                     [](double at, const Sample& s) { return at < s.stamp; });
  if (next == samples_.begin()) return 0;

  // Past the end only the last stamp itself is covered.
  if (next == samples_.end()) {
    const bool exact = samples_.back().stamp == stamp && samples_.size() > 1;
    return exact ? samples_.size() - 1 : 0;
  }
  return next->stamp - (next - 1)->stamp > kMostGap_s ? 0 : static_cast<std::size_t>(next - samples_.begin());
}

Vector3d TurnRates::integral_at(std::size_t after, double stamp) const {
  const Sample& a = samples_[after - 1];
  const Sample& b = samples_[after];
  const double s = stamp - a.stamp;
  return a.integral + s * a.rate + 0.5 * s * s / (b.stamp - a.stamp) * (b.rate - a.rate);
}

std::optional<Vector3d> TurnRates::mean(double from, double to) const {
  const std::size_t first = after(from), last = after(to);
  if (first == 0 || last == 0 || !(to > from)) return std::nullopt;

  // Readings are missing in a pause.
  for (std::size_t i = first; i < last; ++i) {
    if (samples_[i].stamp - samples_[i - 1].stamp > kMostGap_s) return std::nullopt;
  }
  return (integral_at(last, to) - integral_at(first, from)) / (to - from);
}

std::optional<Matrix3d> TurnRates::turned(double from, double to, const GyroCalibration& how) const {
  const double begin = from + how.delay_s, end = to + how.delay_s;
  if (!mean(begin, end)) return std::nullopt;
  Matrix3d earlier_from_later = Matrix3d::Identity();
  const std::size_t last = after(end);
  std::size_t next = after(begin);

  // Piece by piece, for rotations do not commute.
  for (double at = begin; at < end; ++next) {
    const double until = next < last ? std::min(samples_[next].stamp, end) : end;
    const std::size_t piece = std::min(next, last);
    const Vector3d turn = integral_at(piece, until) - integral_at(piece, at) - (until - at) * how.bias;
    earlier_from_later = earlier_from_later * geometry::exp_so3(how.camera_from_imu * turn);
    at = until;
  }
  return earlier_from_later.transpose();
}

std::optional<Vector3d> TurnRates::acceleration(double from, double to) const {
  Vector3d sum = Vector3d::Zero();
  int count = 0;
  for (std::size_t i = after(from); i > 0 && i < samples_.size() && samples_[i].stamp <= to; ++i) {
    const Vector3d& felt = samples_[i].acceleration;

    // Sensors without an accelerometer report zeros.
    if (!felt.allFinite() || felt.isZero(0.0)) continue;
    sum += felt;
    ++count;
  }
  return count > 0 ? std::optional<Vector3d>(sum / count) : std::nullopt;
}

std::optional<GyroCalibration> calibrate_gyro(const TurnRates& rates, const std::vector<CameraStep>& steps) {
  constexpr std::size_t kFewest = 10;
  constexpr double kOutlier = 5.0;  // times the median
  constexpr double kLeast = 0.02;   // rad/s
  GyroCalibration found = fit_with_delay(rates, steps);

  // Steps that the tracker got wrong are left out, a few at most.
  const auto off = [&](const CameraStep& step) {
    const auto pair = rate_pairs(rates, {step}, found.delay_s);
    return pair.empty() ? std::nan("")
                        : (pair[0].camera - found.camera_from_imu * (pair[0].sensor - found.bias)).norm();
  };
  std::vector<double> offs;
  offs.reserve(steps.size());
  for (const CameraStep& step : steps) offs.push_back(off(step));

  const double limit = std::max(kLeast, kOutlier * core::quantile(offs, 0.5, 0.0));

  // Calibrated again without the worst steps.
  std::vector<CameraStep> good;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (offs[i] <= limit) good.push_back(steps[i]);
  }
  if (good.size() < kFewest) return std::nullopt;
  return good.size() < steps.size() ? fit_with_delay(rates, good) : found;
}

}  // namespace plumbline::inertial
