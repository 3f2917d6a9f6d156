// SPDX-License-Identifier: BSD-3-Clause
#include "render/path.hpp"

#include <algorithm>
#include <cmath>

#include "scene/random.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;
using geometry::Rigid3;

namespace {

constexpr double kRamp = 0.6;  // seconds to stop before a spin and to start after it

/// 0 -> 1 with first and second derivative 0 at both ends, and its integral from 0.
double smoother(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (x * (6.0 * x - 15.0) + 10.0);
}
double smoother_integral(double x) {
  if (x <= 0.0) return 0.0;
  if (x >= 1.0) return 0.5 + (x - 1.0);
  return x * x * x * x * (x * x - 3.0 * x + 2.5);
}

/// Centripetal Catmull-Rom between b and c (Barry-Goldman pyramid).
Vector3d catmull_rom(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d, double s) {
  const auto knot = [](const Vector3d& p, const Vector3d& q) {
    return std::max(1e-4, std::sqrt((q - p).norm()));
  };
  const double t1 = knot(a, b), t2 = t1 + knot(b, c), t3 = t2 + knot(c, d), t = t1 + s * (t2 - t1);
  const Vector3d a1 = (t1 - t) / t1 * a + t / t1 * b;
  const Vector3d a2 = (t2 - t) / (t2 - t1) * b + (t - t1) / (t2 - t1) * c;
  const Vector3d a3 = (t3 - t) / (t3 - t2) * c + (t - t2) / (t3 - t2) * d;
  const Vector3d b1 = (t2 - t) / t2 * a1 + t / t2 * a2;
  const Vector3d b2 = (t3 - t) / (t3 - t1) * a2 + (t - t1) / (t3 - t1) * a3;
  return (t2 - t) / (t2 - t1) * b1 + (t - t1) / (t2 - t1) * b2;
}

struct Direction {
  double yaw, pitch;
};
Direction direction(const Vector3d& d) {
  return {std::atan2(d.y(), d.x()), std::atan2(d.z(), d.head<2>().norm())};
}

/// Direction in which a waypoint makes the camera look at `position`, moving along `tangent`.
Direction wish(const Waypoint& w, const Vector3d& position, const Vector3d& tangent) {
  Direction d = w.look ? direction(*w.look - position) : direction({tangent.x(), tangent.y(), 0.0});
  d.yaw += w.yaw_rad;
  d.pitch += w.pitch_rad;
  return d;
}

struct Sample {
  double time;
  Vector3d position;
  double yaw, pitch;
  std::size_t waypoint;
};

/// The path in fine steps, with the time at which each is reached.
std::vector<Sample> sample_path(const RobotPath& robot, double speed_factor) {
  constexpr int kSteps = 96;
  const auto& w = robot.waypoints;
  const long n = static_cast<long>(w.size()), segments = robot.closed ? n : n - 1;

  // Open paths continue straight at their ends.
  const auto at = [&](long i) -> Vector3d {
    if (robot.closed) return w[static_cast<std::size_t>((i % n + n) % n)].position;
    if (i < 0) return 2.0 * w[0].position - w[1].position;
    if (i >= n)
      return 2.0 * w[static_cast<std::size_t>(n - 1)].position - w[static_cast<std::size_t>(n - 2)].position;
    return w[static_cast<std::size_t>(i)].position;
  };

  std::vector<Sample> out;
  Vector3d tangent = Vector3d::UnitX();
  for (long k = 0; k < segments; ++k) {
    const Waypoint& a = w[static_cast<std::size_t>(k)];
    const Waypoint& b = w[static_cast<std::size_t>((k + 1) % n)];
    for (int i = 0; i <= kSteps; ++i) {
      if (i == kSteps && k + 1 < segments) break;  // the next segment begins there
      const double s = static_cast<double>(i) / kSteps;
      Sample p;
      p.position = catmull_rom(at(k - 1), at(k), at(k + 1), at(k + 2), s);

      // Direction of travel, by differences.
      const double e = 0.5 / kSteps;
      const Vector3d ahead = catmull_rom(at(k - 1), at(k), at(k + 1), at(k + 2), std::min(1.0, s + e)) -
                             catmull_rom(at(k - 1), at(k), at(k + 1), at(k + 2), std::max(0.0, s - e));
      if (ahead.head<2>().norm() > 1e-6) tangent = ahead;

      // Gaze turns smoothly between waypoints.
      const Direction from = wish(a, p.position, tangent), to = wish(b, p.position, tangent);
      const double blend = smoother(s);
      p.yaw = from.yaw + blend * wrap(to.yaw - from.yaw);
      p.pitch = std::clamp(from.pitch + blend * (to.pitch - from.pitch), -1.45, 1.45);
      p.waypoint = static_cast<std::size_t>(k);
      p.time = 0.0;

      // Translation or rotation, the slower one, limits the speed.
      if (!out.empty()) {
        const Sample& last = out.back();
        p.yaw = last.yaw + wrap(p.yaw - last.yaw);
        const double turn = std::hypot(p.yaw - last.yaw, p.pitch - last.pitch);
        const double dt = std::max((p.position - last.position).norm() / robot.speed, turn / robot.turn_rate);
        p.time = last.time + std::max(dt, 1e-6) / speed_factor;
      }

      out.push_back(p);
    }
  }

  return out;
}

}  // namespace

CameraPath::CameraPath(const RobotPath& robot, const Options& options) : closed_(robot.closed) {
  const std::vector<Sample> samples = sample_path(robot, options.speed);
  duration_ = samples.back().time;
  const long count = std::max(4L, std::lround(duration_ / 0.25));
  step_ = duration_ / static_cast<double>(count);
  if (closed_) winding_ = samples.back().yaw - samples.front().yaw;

  // Knots at equal steps of time.
  std::size_t k = 0;
  const long last = closed_ ? count - 1 : count;
  for (long i = 0; i <= last; ++i) {
    const double t = step_ * static_cast<double>(i);
    while (k + 2 < samples.size() && samples[k + 1].time < t) ++k;

    // Interpolated between two samples.
    const Sample &a = samples[k], &b = samples[k + 1];
    const double s = std::clamp((t - a.time) / std::max(b.time - a.time, 1e-12), 0.0, 1.0);
    knots_.push_back({a.position + s * (b.position - a.position), a.yaw + s * (b.yaw - a.yaw),
                      a.pitch + s * (b.pitch - a.pitch), a.waypoint});
  }

  // A round of whole frames, to repeat exactly.
  if (options.frame_s > 0.0) {
    duration_ = options.frame_s * std::max(1.0, std::round(duration_ / options.frame_s));
    step_ = duration_ / static_cast<double>(count);
  }
  start_ = options.start_share * duration_;
  for (const Event& e : options.events) {
    if (e.kind == EventKind::kSpin) spins_.push_back(e);
  }

  add_sway(options);
  if (options.frame_s <= 0.0) return;

  // Sway repeats with the round.
  const double once = 2.0 * M_PI / duration_;
  for (auto& axis : sway_) {
    for (Sine& s : axis) s.frequency = once * std::max(1.0, std::round(s.frequency / once));
  }
}

void CameraPath::add_sway(const Options& options) {
  Rng rng(options.seed, 0x5a11);
  const auto add = [&](std::size_t axis, double amplitude, double lo, double hi, int count) {
    for (int i = 0; i < count; ++i) {
      sway_[axis].push_back({amplitude * rng.uniform(0.6, 1.2) / std::sqrt(static_cast<double>(count)),
                             2.0 * M_PI * rng.uniform(lo, hi), rng.uniform(0.0, 2.0 * M_PI)});
    }
  };

  // Wheels: small, fast vibration.
  if (options.wheeled) {
    for (std::size_t axis = 0; axis < 3; ++axis) add(axis, 0.0004, 5.0, 9.0, 2);
    for (std::size_t axis = 3; axis < 6; ++axis) add(axis, 0.0008, 3.0, 8.0, 3);
    return;
  }

  // Held by hand: drift and steps.
  for (std::size_t axis = 0; axis < 3; ++axis) {
    add(axis, 0.018, 0.12, 0.45, 3);  // the arm drifts
    add(axis, 0.004, 1.4, 2.0, 2);    // steps
  }

  // Held by hand: turns and tremor.
  for (std::size_t axis = 3; axis < 6; ++axis) {
    add(axis, axis == 3 ? 0.022 : 0.018, 0.12, 0.5, 3);
    add(axis, 0.0035, 1.2, 2.4, 2);
    add(axis, 0.0008, 4.0, 8.0, 2);  // muscles tremble
  }
}

CameraPath::Knot CameraPath::knot(long index) const {
  const long n = static_cast<long>(knots_.size());
  if (closed_) {
    // Each round adds the turns of a whole one.
    const long round = index >= 0 ? index / n : -((-index + n - 1) / n);
    Knot k = knots_[static_cast<std::size_t>(index - round * n)];
    k.yaw += winding_ * static_cast<double>(round);
    return k;
  }

  // Open paths run back and forth.
  const long period = 2 * (n - 1);
  long i = (index % period + period) % period;
  if (i >= n) i = period - i;
  return knots_[static_cast<std::size_t>(i)];
}

double CameraPath::pace(double t) const {
  double pace = 1.0;
  for (const Event& e : spins_) {
    const double end = e.start_s + e.duration_s;

    // Slowed down before a spin, at rest during it.
    pace *= 1.0 - smoother((t - e.start_s + kRamp) / kRamp) * (1.0 - smoother((t - end) / kRamp));
  }
  return pace;
}

double CameraPath::path_time(double t) const {
  double lost = 0.0;  // integral of 1 - pace, spins apart from each other

  // Spins hold the camera on its path.
  for (const Event& e : spins_) {
    lost += kRamp * (smoother_integral((t - e.start_s + kRamp) / kRamp) -
                     smoother_integral((t - e.start_s - e.duration_s) / kRamp));
  }
  return start_ + t - lost;
}

std::size_t CameraPath::waypoint_at(double t) const {
  return knot(static_cast<long>(std::floor(path_time(t) / step_))).waypoint;
}

double CameraPath::sway(std::size_t axis, double t) const {
  double sum = 0.0;
  for (const Sine& s : sway_[axis]) sum += s.amplitude * std::sin(s.frequency * t + s.phase);
  return sum;
}

CameraPath::Knot CameraPath::spline(double t) const {
  const double u = path_time(t) / step_, floor = std::floor(u), x = u - floor;
  const long i = static_cast<long>(floor);
  const double weights[4] = {(1 - x) * (1 - x) * (1 - x) / 6.0, (3 * x * x * x - 6 * x * x + 4) / 6.0,
                             (-3 * x * x * x + 3 * x * x + 3 * x + 1) / 6.0, x * x * x / 6.0};

  // A cubic B-spline smooths the knots.
  Knot sum{Vector3d::Zero(), 0.0, 0.0, 0};
  for (int k = 0; k < 4; ++k) {
    const Knot at = knot(i - 1 + k);
    sum.position += weights[k] * at.position;
    sum.yaw += weights[k] * at.yaw;
    sum.pitch += weights[k] * at.pitch;
  }
  return sum;
}

Rigid3 CameraPath::world_from_camera(double t) const {
  auto [position, yaw, pitch, waypoint] = spline(t);
  for (const Event& e : spins_) yaw += 2.0 * M_PI * e.value * smoother((t - e.start_s) / e.duration_s);
  const double p = pace(t);
  position += p * Vector3d(sway(0, t), sway(1, t), sway(2, t));
  pitch += p * sway(4, t);
  yaw += p * sway(5, t);

  // Camera axes: x right, y down, z forward; forward is (cos yaw cos pitch, sin yaw cos pitch, sin pitch).
  const Vector3d forward(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch));
  const Vector3d right(std::sin(yaw), -std::cos(yaw), 0.0);

  Rigid3 pose;
  pose.rotation.col(0) = right;
  pose.rotation.col(1) = forward.cross(right);
  pose.rotation.col(2) = forward;
  pose.rotation = pose.rotation * Eigen::AngleAxisd(p * sway(3, t), Vector3d::UnitZ()).toRotationMatrix();
  pose.translation = position;
  return pose;
}

CameraPath camera_path(const Scene& scene, const SynthOptions& options, const std::vector<Event>& events,
                       int driver) {
  CameraPath::Options motion;
  motion.speed = options.speed;
  motion.wheeled = (options.motion == Motion::kScene ? scene.motion : options.motion) == Motion::kWheeled;
  motion.seed = mix(static_cast<std::uint64_t>(options.seed), static_cast<std::uint64_t>(driver) + 1);

  // Further robots start elsewhere on the same paths.
  const auto index = static_cast<std::size_t>(driver), paths = scene.robots.size(), rounds = index / paths;
  motion.start_share = 0.381966 * static_cast<double>(rounds);
  motion.events = events;
  motion.frame_s = options.repeat > 1 ? 1.0 / options.fps : 0.0;
  return {scene.robots[index % paths], motion};
}

}  // namespace plumbline::synth
