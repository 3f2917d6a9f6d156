// SPDX-License-Identifier: BSD-3-Clause
#include "render/wall_tags.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/path.hpp"
#include "render/world.hpp"
#include "scene/builder.hpp"
#include "scene/rig.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;
using geometry::Rigid3;

namespace {

constexpr double kTag = 0.16;         // m, of the black square
constexpr double kSheet = 0.2;        // m, with its white border
constexpr double kThickness = 0.001;  // m
constexpr double kApart = 0.6;        // m between two middles at least
constexpr double kPixels = 22.0;      // a tag's width in a picture that its number can be read in
constexpr double kFar = 3.0;          // m from the camera at most, for the sake of depth
constexpr double kFacing = 0.5;       // least cosine between the wall's normal and the view
constexpr double kPoseStep_s = 0.1;   // between the poses that look for tags
constexpr std::size_t kLeastViews = 4;

/// A place where a sheet may hang.
struct Spot {
  Vector3d middle;  ///< on the wall
  Vector3d right;   ///< unit, as seen from before the wall
  Vector3d normal;  ///< unit, towards the room
  int object = -1;  ///< the wall
  std::size_t views = 0;
};

std::vector<Vector3d> corners_of(const Spot& spot, double size) {
  const Vector3d u = 0.5 * size * spot.right, v = 0.5 * size * Vector3d::UnitZ();
  return {spot.middle - u + v, spot.middle + u + v, spot.middle + u - v, spot.middle - u - v};
}

/// The poses from which the recordings are filmed.
std::vector<Rigid3> poses_of(const World& world) {
  const SynthOptions& o = world.options;
  const int drivers = o.rig.empty() ? o.robots : 1;
  std::vector<Rigid3> poses;
  for (int driver = 0; driver < drivers; ++driver) {
    const CameraPath path = camera_path(world.scene, o, world.events, driver);
    const double filmed = o.frames > 0 ? (o.frames - 1) / o.fps : path.duration();
    const double end = std::min(filmed, path.duration());
    for (int k = 0; k * kPoseStep_s <= end; ++k) poses.push_back(path.world_from_camera(k * kPoseStep_s));
  }

  return poses;
}

/// Places 20 cm apart on all upright faces of walls, the whole sheet 1 to 1.8 m above the wall's foot.
std::vector<Spot> spots_of(const Scene& scene) {
  std::vector<double> foot(scene.objects.size(), std::numeric_limits<double>::infinity());
  for (const Face& face : scene.faces) {
    for (const Eigen::Vector2d& uv : face.polygon) {
      double& z = foot[static_cast<std::size_t>(face.object)];
      z = std::min(z, face.at(uv.x(), uv.y()).z());
    }
  }

  constexpr double kStep = 0.2;
  const double half = 0.5 * kSheet;
  std::vector<Spot> spots;
  for (const Face& face : scene.faces) {
    const auto object = static_cast<std::size_t>(face.object);
    if (scene.objects[object].type != "wall" || std::abs(face.normal.z()) > 1e-6) continue;
    const Vector3d right = Vector3d::UnitZ().cross(face.normal);
    const Eigen::AlignedBox2d box = face.bounds();
    if (box.sizes().minCoeff() < 2.0 * kSheet) continue;

    // In the frame of the face, whose u axis is level.
    for (double z = foot[object] + 1.0 + half; z <= foot[object] + 1.8 - half + 1e-9; z += kStep) {
      for (double u = box.min().x() + kSheet; u <= box.max().x() - kSheet; u += kStep) {
        Spot spot{face.at(u, 0.0), right, face.normal, face.object, 0};
        spot.middle.z() = z;
        const auto inside = [&](const Vector3d& p) {
          return face.contains({(p - face.origin).dot(face.u_axis), (p - face.origin).dot(face.v_axis)});
        };
        const std::vector<Vector3d> corners = corners_of(spot, kSheet + 0.04);
        if (std::all_of(corners.begin(), corners.end(), inside)) spots.push_back(spot);
      }
    }
  }

  return spots;
}

/// True if a camera sees the whole sheet, large and unhidden.
bool sees(const World& world, const sensor::Pinhole& camera, const Rigid3& world_from_camera,
          const Spot& spot) {
  const Vector3d from = world_from_camera.translation, way = spot.middle - from;
  const double distance = way.norm();
  const double facing = -way.dot(spot.normal) / distance;
  if (distance > kFar || facing < kFacing || camera.fx * kTag * facing / distance < kPixels) return false;

  // In the picture, then free of things that hang or stand before the wall.
  const Rigid3 camera_from_world = world_from_camera.inverse();
  const std::vector<Vector3d> corners = corners_of(spot, kSheet + 0.02);
  for (const Vector3d& corner : corners) {
    const Vector3d p = camera_from_world * corner;
    if (p.z() < 0.3) return false;
    const double x = camera.fx * p.x() / p.z() + camera.cx, y = camera.fy * p.y() / p.z() + camera.cy;
    if (x < 0.0 || y < 0.0 || x > camera.width || y > camera.height) return false;
  }

  const auto on_wall = [&](const Vector3d& point) {
    const Hit hit = world.cast(from, point - from, 1.5);
    return hit.face >= 0 && world.scene.faces[static_cast<std::size_t>(hit.face)].object == spot.object &&
           std::abs(hit.distance - 1.0) * (point - from).norm() < 1e-3;
  };
  return on_wall(spot.middle) && std::all_of(corners.begin(), corners.end(), on_wall);
}

/// `wanted` of the spots: each as far from those before it as there are, among the `share` best seen.
std::vector<Spot> spread(const std::vector<Spot>& spots, std::size_t wanted, double share) {
  std::size_t most = 0;
  for (const Spot& spot : spots) most = std::max(most, spot.views);
  const double least = std::max<double>(kLeastViews, share * static_cast<double>(most));
  std::vector<Spot> chosen;

  while (chosen.size() < wanted) {
    const Spot* best = nullptr;
    double farthest = kApart;
    for (const Spot& spot : spots) {
      if (static_cast<double>(spot.views) < least) continue;
      double nearest = 1e3;
      for (const Spot& other : chosen) nearest = std::min(nearest, (spot.middle - other.middle).norm());

      // The first one is where most frames see it.
      const bool better = chosen.empty() ? best == nullptr || spot.views > best->views : nearest > farthest;
      if (!better) continue;
      farthest = nearest;
      best = &spot;
    }

    if (best == nullptr) break;
    chosen.push_back(*best);
  }
  return chosen;
}

void hang(const Spot& spot, int id, Scene& scene) {
  const std::size_t first = scene.faces.size();
  Builder b(scene);
  b.begin_object("tag", fmt::format("tag {}", id), {});
  const Vector3d& n = spot.normal;
  add_panel(b, upright(spot.middle, std::atan2(n.x(), -n.y())),
            {kSheet, kSheet, kThickness, "tag", "paper", false});
  scene.faces[first].seed = id;  // its front

  WallTag tag;
  tag.id = id;
  tag.middle = spot.middle + kThickness * n;
  const std::vector<Vector3d> corners = corners_of(spot, kTag);
  for (std::size_t i = 0; i < corners.size(); ++i) tag.corners[i] = corners[i] + kThickness * n;
  scene.tags.push_back(tag);
}

}  // namespace

core::Result<void> hang_tags(const SynthOptions& options, Scene& scene) {
  if (options.tags == 0) return {};
  const World world(scene, options);
  const std::vector<Rigid3> poses = poses_of(world);
  const sensor::Pinhole camera =
      make_camera(options.sensor, options.width, options.height, options.fps).color;
  std::vector<Spot> spots = spots_of(scene);
  for (Spot& spot : spots) {
    for (const Rigid3& pose : poses) spot.views += sees(world, camera, pose, spot) ? 1 : 0;
  }

  // Well seen ones first, as long as there are enough of them.
  const auto wanted = static_cast<std::size_t>(options.tags + options.tag_copies);
  std::vector<Spot> chosen;
  for (const double share : {0.5, 0.25, 0.0}) {
    chosen = spread(spots, wanted, share);
    if (chosen.size() == wanted) break;
  }

  if (chosen.size() < wanted) {
    return core::usage_error(
        fmt::format("tags: the cameras come near free wall for {} tags, not for {}; ask for fewer, for more "
                    "frames or for larger pictures",
                    chosen.size(), wanted));
  }

  for (std::size_t i = 0; i < wanted; ++i)
    hang(chosen[i], static_cast<int>(i % static_cast<std::size_t>(options.tags)), scene);
  return {};
}

}  // namespace plumbline::synth
