// SPDX-License-Identifier: BSD-3-Clause
#include "recording/truth_files.hpp"

#include <fmt/format.h>

namespace plumbline::synth {

std::string describe_truth(const SynthSource& source, const std::vector<double>& moving) {
  std::string text = "stamp,x,y,z,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz,moving,covered,events\n";
  for (std::size_t i = 0; i < moving.size(); ++i) {
    const double stamp = source.info(i).stamp;
    const geometry::Rigid3 pose = source.world_from_camera(stamp);
    const Eigen::Quaterniond q = pose.quaternion();
    const PathMotion motion = source.motion(stamp);
    bool covered = false;
    std::string active;

    // Events at that time.
    for (const Event& event : source.events()) {
      if (!event.active(stamp - source.start())) continue;
      covered = covered || event.kind == EventKind::kCover;
      active += (active.empty() ? "" : " ") + std::string(to_string(event.kind));
    }

    // Pose, velocity, turn rate.
    text += fmt::format("{:.6f}", stamp);
    for (const double v : {pose.translation.x(), pose.translation.y(), pose.translation.z()})
      text += fmt::format(",{:.6f}", v);
    for (const double v : {q.x(), q.y(), q.z(), q.w()}) text += fmt::format(",{:.9f}", v);
    for (const double v : motion.velocity) text += fmt::format(",{:.6f}", v);
    for (const double v : motion.turn_rate) text += fmt::format(",{:.6f}", v);
    text += fmt::format(",{:.6f},{},{}\n", moving[i], covered ? 1 : 0, active);
  }
  return text;
}

std::string describe_events(const SynthSource& source) {
  std::string text = "kind,from_stamp,to_stamp,value\n";
  for (const Event& e : source.events()) {
    text += fmt::format("{},{:.6f},{:.6f},{}\n", to_string(e.kind), source.start() + e.start_s,
                        source.start() + e.start_s + e.duration_s, e.value);
  }

  // Doors in degrees, drawers in metres.
  for (const DoorSwing& s : source.swings()) {
    const bool door = s.drawer.empty();
    text += fmt::format("{},{:.6f},{:.6f},{:.3f}\n", door ? fmt::format("door {}", s.opening) : s.drawer,
                        s.from, s.to, door ? s.open * 180.0 / M_PI : s.open);
  }
  return text;
}

std::string describe_rig(const std::vector<std::unique_ptr<SynthSource>>& cameras,
                         const std::vector<std::string>& folders) {
  std::string text = fmt::format("cameras:\n  {}: {{}}\n", folders.front());
  const geometry::Rigid3 first_from_body = cameras.front()->body_from_camera().inverse();
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    const geometry::Rigid3 pose = first_from_body * cameras[i]->body_from_camera();
    const Eigen::Vector3d& t = pose.translation;
    const Eigen::Quaterniond q = pose.quaternion();
    text += fmt::format("  {}:\n    position: [{:.6f}, {:.6f}, {:.6f}]\n", folders[i], t.x(), t.y(), t.z());
    text += fmt::format("    rotation: [{:.9f}, {:.9f}, {:.9f}, {:.9f}]\n", q.x(), q.y(), q.z(), q.w());

    // Exact, but an edge of a graph needs a width.
    text += "    sigma: {position: 0.5 mm, rotation: 0.02 deg}\n    time_offset: 0 s\n";
  }
  return text;
}

}  // namespace plumbline::synth
