// SPDX-License-Identifier: BSD-3-Clause
// Walkers that move through a world while it is filmed.
#include <algorithm>
#include <array>
#include <cmath>

#include "render/path.hpp"
#include "render/render.hpp"
#include "scene/builder.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;

Vector3d Walker::at(double t) const {
  const double length = (to - from).norm();
  const double way = std::fmod(std::max(t, 0.0) * speed, 2.0 * length);
  const double share = way < length ? way / length : 2.0 - way / length;
  return from + share * (to - from);
}

FigurePose Walker::pose(double t) const {
  const double at = std::fmod(std::max(t, 0.0) / kFigureStep, static_cast<double>(day.size() - 1));
  const auto i = static_cast<std::size_t>(at);
  const double s = at - std::floor(at);
  const FigurePose &a = day[i], &b = day[i + 1];

  // Between two poses of the day.
  FigurePose out;
  out.hip = a.hip + s * (b.hip - a.hip);
  out.yaw = a.yaw + s * wrap(b.yaw - a.yaw);
  for (const int k : {0, 1}) out.foot[k] = a.foot[k] + s * (b.foot[k] - a.foot[k]);
  return out;
}

namespace {

enum Part { kTrunk, kThigh, kShin = kThigh + 2, kArm = kShin + 2, kParts = kArm + 2 };  // left, then right
constexpr double kLimb = 0.45;  // m from hip to knee and from knee to sole

/// Frames of a person's parts: origin at the upper joint, x forward, z up.
std::array<geometry::Rigid3, kParts> part_frames(const FigurePose& pose, bool carries) {
  const auto turn = [](const Vector3d& axis, double angle) {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  };

  // The trunk defines the frame of all joints.
  std::array<geometry::Rigid3, kParts> out;
  const geometry::Rigid3 trunk = upright(pose.hip, pose.yaw);
  out[kTrunk] = trunk;
  double ahead[2];

  // The leg from hip to foot.
  for (const int side : {0, 1}) {
    const double y = side == 0 ? 1.0 : -1.0;
    const Vector3d joint(0.0, 0.09 * y, 0.0);
    const Vector3d foot = trunk.inverse() * pose.foot[side] - joint;
    ahead[side] = foot.x();

    // Both bones lie in the plane of hip, foot and the way ahead; the knee bends forwards.
    const double down = std::hypot(foot.y(), foot.z());
    const double reach = std::min(std::hypot(foot.x(), down), 1.999 * kLimb);
    const double middle = std::atan2(foot.x(), down), bend = std::acos(0.5 * reach / kLimb);
    const Eigen::Matrix3d roll = turn(Vector3d::UnitX(), std::atan2(foot.y(), -foot.z()));
    const geometry::Rigid3 thigh(Eigen::Matrix3d(roll * turn(Vector3d::UnitY(), -middle - bend)), joint);
    const geometry::Rigid3 shin(Eigen::Matrix3d(roll * turn(Vector3d::UnitY(), bend - middle)),
                                thigh * Vector3d(0.0, 0.0, -kLimb));

    out[std::size_t{kThigh} + static_cast<std::size_t>(side)] = trunk * thigh;
    out[std::size_t{kShin} + static_cast<std::size_t>(side)] = trunk * shin;
  }

  // Each arm swings like the other side's leg.
  for (const int side : {0, 1}) {
    const double y = side == 0 ? 1.0 : -1.0,
                 swing = carries ? 1.1 : 1.1 * std::clamp(ahead[1 - side], -0.4, 0.4);
    out[std::size_t{kArm} + static_cast<std::size_t>(side)] =
        trunk * geometry::Rigid3(turn(Vector3d::UnitY(), -swing), Vector3d(0.0, 0.25 * y, 0.5));
  }

  return out;
}

}  // namespace

int walker_parts(const Walker& walker) { return walker.day.empty() ? 1 : kParts; }

geometry::Rigid3 walker_motion(const Walker& walker, int part, double t) {
  if (walker.day.empty()) return {Eigen::Matrix3d::Identity(), walker.at(t) - walker.from};
  const auto k = static_cast<std::size_t>(part);
  return part_frames(walker.pose(t), walker.carries)[k] *
         part_frames(walker.day.front(), walker.carries)[k].inverse();
}

void add_walker(Builder& b, const Walker& walker, int part) {
  b.begin_object("walker", "", walker.mark);
  const Skin clothes{walker.material}, skin{"terracotta"}, trousers{"fabric"};
  if (walker.day.empty()) {
    // Without a day's poses: a simple figure.
    const Vector3d way = walker.to - walker.from;
    const geometry::Rigid3 frame = upright(walker.from, std::atan2(way.y(), way.x()));
    b.box(frame, {-0.15, -0.25, 0.0}, {0.15, 0.25, 1.42}, clothes);
    b.box(frame, {-0.1, -0.09, 1.42}, {0.12, 0.09, 1.7}, skin);
    return;
  }

  // One part of a figure with limbs.
  const geometry::Rigid3 frame =
      part_frames(walker.day.front(), walker.carries)[static_cast<std::size_t>(part)];

  // Trunk and head, thigh, shin with shoe, or arm.
  if (part == kTrunk) {
    b.box(frame, {-0.11, -0.2, -0.08}, {0.11, 0.2, 0.56}, clothes);
    b.box(frame, {-0.1, -0.08, 0.58}, {0.11, 0.08, 0.86}, skin);
    if (walker.carries) b.box(frame, {0.3, -0.2, 0.08}, {0.6, 0.2, 0.34}, {"cardboard"});
  } else if (part < kShin) {
    b.box(frame, {-0.08, -0.075, -kLimb - 0.03}, {0.08, 0.075, 0.05}, trousers);
  } else if (part < kArm) {
    b.box(frame, {-0.06, -0.06, -kLimb + 0.08}, {0.06, 0.06, 0.0}, trousers);
    b.box(frame, {-0.08, -0.055, -kLimb}, {0.17, 0.055, -kLimb + 0.08}, {"plastic_black"});
  } else {
    b.box(frame, {-0.05, -0.045, -0.6}, {0.05, 0.045, 0.03}, clothes);
  }
}

namespace {

float inverse_depth(const View& view, int face, float x, float y) {
  if (face < 0) return 0.0F;
  const FaceView& f = view.faces[static_cast<std::size_t>(face)];
  return f.c[0] * x + f.c[1] * y + f.c[2];
}

}  // namespace

int MovingFaces::nearer(const View& view, const Spot& spot, int best, float x, float y) const {
  const float here = inverse_depth(view, static_cast<int>(spot.face), x, y);
  if (here <= inverse_depth(view, best, x, y)) return best;

  // The hit, in the frame of the face at rest.
  const Vector3d ray = view.world_from_camera.rotation * view.camera.unproject(x, y, 1.0);
  const Face& face = world_.scene.faces[spot.face];
  const Vector3d d =
      spot.motion.rotation.transpose() *
          (view.world_from_camera.translation + ray / static_cast<double>(here) - spot.motion.translation) -
      face.origin;
  return face.contains({d.dot(face.u_axis), d.dot(face.v_axis)}) ? static_cast<int>(spot.face) : best;
}

int MovingFaces::in_front(const View& view, int fixed, float x, float y) const {
  int best = fixed;
  for (const Spot& spot : spots_) {
    if (spot.reach.contains({static_cast<int>(x), static_cast<int>(y)}))
      best = nearer(view, spot, best, x, y);
  }
  return best;
}

MovingFaces::MovingFaces(const World& world, const View& view, double t) : world_(world) {
  const geometry::Rigid3 camera_from_world = view.world_from_camera.inverse();
  for (const World::Mover& mover : world.movers) {
    const geometry::Rigid3 motion = world.motion(mover, t);
    const Vector3d eye =
        motion.rotation.transpose() * (view.world_from_camera.translation - motion.translation);

    for (std::size_t i = mover.first; i < mover.first + mover.count; ++i) {
      const Face& face = world.scene.faces[i];
      if (face.normal.dot(eye - face.origin) <= 0.0) continue;

      // The pixels about the part of it that is before the camera.
      constexpr double kNear = 0.05;
      cv::Rect box;
      const auto add = [&](const Vector3d& p) {
        const Eigen::Vector2d pixel = view.camera.project(p);
        box |= cv::Rect(static_cast<int>(std::clamp(pixel.x(), -1e6, 1e6)) - 2,
                        static_cast<int>(std::clamp(pixel.y(), -1e6, 1e6)) - 2, 5, 5);
      };

      // Outline clipped at the near plane.
      Vector3d before =
          camera_from_world * (motion * face.at(face.polygon.back().x(), face.polygon.back().y()));
      for (const Eigen::Vector2d& uv : face.polygon) {
        const Vector3d p = camera_from_world * (motion * face.at(uv.x(), uv.y()));
        if ((p.z() < kNear) != (before.z() < kNear))
          add(before + (kNear - before.z()) / (p.z() - before.z()) * (p - before));
        if (p.z() >= kNear) add(p);
        before = p;
      }

      const cv::Rect reach = box & cv::Rect({0, 0}, view.ids.size());
      if (!reach.empty()) spots_.push_back({i, motion, reach});
    }
  }
}

void MovingFaces::draw(View& view) const {
  for (const Spot& spot : spots_) {
    for (int y = spot.reach.y; y < spot.reach.y + spot.reach.height; ++y) {
      int* row = view.ids[y];
      for (int x = spot.reach.x; x < spot.reach.x + spot.reach.width; ++x)
        row[x] = nearer(view, spot, row[x], static_cast<float>(x), static_cast<float>(y));
    }
  }
}

}  // namespace plumbline::synth
