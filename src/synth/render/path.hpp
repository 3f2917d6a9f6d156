// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The motion of one camera: C2 in position and rotation.
#include <cmath>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/synth/scene.hpp"

namespace plumbline::synth {

/// The same angle within half a turn of 0.
inline double wrap(double angle) { return angle - 2.0 * M_PI * std::round(angle / (2.0 * M_PI)); }

/// Camera motion along a robot's waypoints. Centripetal Catmull-Rom through the waypoints gives the shape,
/// speed and turn rate give the time, and a uniform cubic B-spline over knots in time makes position, yaw and
/// pitch C2. Hand-held sway or the tremble of wheels is added as a sum of sines.
class CameraPath {
 public:
  struct Options {
    double speed = 1.0;  ///< times the path's own
    bool wheeled = false;
    std::uint64_t seed = 1;
    double start_share = 0.0;  ///< of a round, where to begin
    double frame_s = 0.0;      ///< > 0: rounds take whole multiples of it and are all the same, sway included
    std::vector<Event> events;  ///< kSpin is motion; others are ignored
  };
  CameraPath(const RobotPath& robot, const Options& options);

  /// Pose t seconds after the start; the path is repeated, as a round (closed) or back and forth (open).
  [[nodiscard]] geometry::Rigid3 world_from_camera(double t) const;
  /// The camera's height without sway, m.
  [[nodiscard]] double height(double t) const { return spline(t).position.z(); }
  /// Seconds of the path once.
  [[nodiscard]] double duration() const { return duration_; }
  /// Index of the waypoint passed last at time t.
  [[nodiscard]] std::size_t waypoint_at(double t) const;

 private:
  struct Knot {
    Eigen::Vector3d position;
    double yaw;
    double pitch;
    std::size_t waypoint;
  };
  struct Sine {
    double amplitude, frequency, phase;
  };
  [[nodiscard]] Knot knot(long index) const;  ///< any index: wraps or mirrors
  [[nodiscard]] Knot spline(double t) const;  ///< without sway and spins
  [[nodiscard]] double path_time(double t) const;
  [[nodiscard]] double pace(double t) const;  ///< 1: moving along the path; 0: standing still for a spin
  [[nodiscard]] double sway(std::size_t axis, double t) const;
  void add_sway(const Options& options);

  std::vector<Knot> knots_;
  bool closed_ = false;
  double winding_ = 0.0;  ///< yaw gained in one round
  double step_ = 0.25;    ///< seconds between knots
  double duration_ = 0.0;
  double start_ = 0.0;
  std::vector<Event> spins_;
  std::vector<Sine> sway_[6];  ///< x y z in metres (world), roll pitch yaw in radians (camera)
};

/// The path of a camera's driver, robot `driver` of a scene: if there are more than paths, the next ones
/// start further along. Spins are those of `events`.
CameraPath camera_path(const Scene& scene, const SynthOptions& options, const std::vector<Event>& events,
                       int driver);

}  // namespace plumbline::synth
