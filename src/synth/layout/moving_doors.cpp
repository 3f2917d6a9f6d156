// SPDX-License-Identifier: BSD-3-Clause
// Doors that no way depends on swing while cameras film, and drawers slide, as far as nothing is in their
// way.
#include <algorithm>
#include <cmath>

#include "layout/layout.hpp"
#include "plumbline/synth/layout.hpp"
#include "render/path.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;

double MovingDoor::angle(double t) const {
  // Sampled values are interpolated.
  if (!shares.empty()) {
    const double at = std::clamp(t / kShareStep, 0.0, static_cast<double>(shares.size() - 1));
    const auto i = std::min(static_cast<std::size_t>(at), shares.size() - 2);
    const double s = at - static_cast<double>(i);
    return (1.0 - s) * shares[i] + s * shares[i + 1];
  }

  // Otherwise smoothly there, held, and back.
  const auto next = std::upper_bound(starts.begin(), starts.end(), t);
  if (next == starts.begin()) return rest_rad;
  const double since = t - *std::prev(next);
  const double x = std::clamp(std::min(since, 2.0 * swing + hold - since) / swing, 0.0, 1.0);
  return rest_rad + x * x * (3.0 - 2.0 * x) * (other_rad - rest_rad);
}

namespace {

constexpr double kAngleStep = M_PI / 36.0;
constexpr double kLeafRoom = 0.06;   // m about a leaf that nothing else takes
constexpr double kCameraRoom = 0.5;  // m between a camera and what the leaf sweeps over
constexpr double kLookStep = 0.1;    // s

double distance(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d d = b - a;
  const double s = std::clamp(d.dot(p - a) / std::max(d.squaredNorm(), 1e-12), 0.0, 1.0);
  return (a + s * d - p).norm();
}

/// From the hinge to the far end of a leaf, as it was made.
Vector2d reach_of(const Scene& scene, const DoorLeaf& leaf) {
  Vector2d best = Vector2d::Zero();
  for (std::size_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
    for (const Vector2d& uv : scene.faces[i].polygon) {
      const Vector2d d = (scene.faces[i].at(uv.x(), uv.y()) - leaf.hinge).head<2>();
      if (d.norm() > best.norm()) best = d;
    }
  }
  return best;
}

/// Nothing is at a place that a leaf of an opening sweeps over.
bool free_for_leaf(const Plan& plan, const PlanOpening& opening, const Vector2d& p) {
  for (const PlanThing& thing : plan.things) {
    if (thing.room != opening.front || thing.bottom > opening.head || thing.top < 0.01) continue;
    PlanRoom inside;
    for (std::size_t i = 0; i < thing.outline.size(); ++i) {
      const Vector2d &a = thing.outline[i], &b = thing.outline[(i + 1) % thing.outline.size()];
      if (distance(p, a, b) < kLeafRoom) return false;
      inside.faces.push_back({a, b, 0});
    }
    if (inside.contains(p)) return false;
  }
  return true;
}

/// The largest angle to which a leaf can swing from shut.
double free_angle(const Scene& scene, std::size_t index, const PlanOpening& opening) {
  const PlanRoom& room = scene.plan->rooms[static_cast<std::size_t>(opening.front)];
  const DoorLeaf& leaf = scene.leaves[index];
  const Vector2d hinge = leaf.hinge.head<2>(), reach = reach_of(scene, leaf);

  // No two leaves meet, whichever of them swing.
  for (std::size_t i = 0; i < scene.leaves.size(); ++i) {
    const DoorLeaf& other = scene.leaves[i];
    if (i == index || std::abs(other.hinge.z() - leaf.hinge.z()) > 1.0) continue;
    const double both = reach.norm() + reach_of(scene, other).norm() + kLeafRoom;
    if ((other.hinge.head<2>() - hinge).norm() < both) return 0.0;
  }

  // In tenths of the leaf, angle by angle.
  for (int step = 0; step <= 20; ++step) {
    const double angle = step * kAngleStep;
    const Vector2d along = Eigen::Rotation2Dd(leaf.open_rad - angle) * reach;
    for (int k = 1; k <= 10; ++k) {
      const Vector2d p = hinge + 0.1 * k * along;
      const bool in_room = step < 3 || k < 3 || room.contains(p);
      if (!in_room || !free_for_leaf(*scene.plan, opening, p)) return angle - kAngleStep;
    }
  }
  return 20 * kAngleStep;
}

/// Cameras at steps of kLookStep from the first frame to the last, or through one round.
std::vector<std::vector<Eigen::Vector3d>> cameras(const SynthOptions& options, const Scene& scene) {
  std::vector<Event> events = scene.events;
  if (auto more = parse_events(options.events)) events.insert(events.end(), more->begin(), more->end());
  std::vector<std::vector<Eigen::Vector3d>> out;
  for (int robot = 0; robot < (options.rig.empty() ? options.robots : 1); ++robot) {
    const CameraPath path = camera_path(scene, options, events, robot);
    const bool once = options.frames < 0 || options.repeat > 1;
    const double end = once ? path.duration() : options.frames / options.fps;
    auto& places = out.emplace_back();
    for (int i = 0; i * kLookStep < end; ++i)
      places.push_back(path.world_from_camera(i * kLookStep).translation);
  }
  return out;
}

/// Chooses how long a door at a place on the floor takes, and the times at which it begins to swing, with no
/// camera near until it is back; none after the last camera's end.
void plan_swings(const std::vector<std::vector<Eigen::Vector3d>>& all, const Eigen::Vector3d& foot,
                 double reach, MovingDoor& door, Rng& rng) {
  door.swing = rng.uniform(1.0, 2.2);
  door.hold = rng.uniform(1.0, 5.0);

  // Times with a camera near the door.
  std::vector<char> near;
  for (const auto& places : all) {
    near.resize(std::max(near.size(), places.size()), 0);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Eigen::Vector3d d = places[i] - foot;
      if (d.z() > 0.0 && d.z() < 2.5 && d.head<2>().norm() < reach + kCameraRoom) near[i] = 1;
    }
  }

  // Swings begin in gaps that are long enough.
  const auto length = static_cast<std::size_t>((2.0 * door.swing + door.hold) / kLookStep) + 2;
  auto at = static_cast<std::size_t>(rng.uniform(0.5, 6.0) / kLookStep);
  while (at + length <= near.size()) {
    const auto first = near.begin() + static_cast<long>(at), last = first + static_cast<long>(length);
    if (std::find(first, last, 1) != last) {
      at += 5;
      continue;
    }

    // The next swing comes after a pause.
    door.starts.push_back(static_cast<double>(at) * kLookStep);
    at += length + static_cast<std::size_t>(rng.uniform(2.0, 12.0) / kLookStep);
  }
}

/// The middle of faces [first, first + count).
Eigen::Vector3d middle_of(const Scene& scene, std::size_t first, std::size_t count) {
  Eigen::AlignedBox3d box;
  for (std::size_t i = first; i < first + count; ++i) {
    for (const Vector2d& uv : scene.faces[i].polygon) box.extend(scene.faces[i].at(uv.x(), uv.y()));
  }
  return box.center();
}

/// No face of another object is in a box, m, in a frame.
bool is_free(const Scene& scene, int object, const geometry::Rigid3& frame, const Eigen::AlignedBox3d& box) {
  const geometry::Rigid3 to_frame = frame.inverse();
  return std::none_of(scene.faces.begin(), scene.faces.end(), [&](const Face& face) {
    Eigen::AlignedBox3d bounds;
    for (const Vector2d& uv : face.polygon) bounds.extend(to_frame * face.at(uv.x(), uv.y()));
    return face.object != object && bounds.intersects(box);
  });
}

/// Drawers of all desks that can be pulled out; add_desk() makes the six boxes of their fronts and handles
/// last.
std::vector<MovingDoor> drawers(const std::vector<std::vector<Eigen::Vector3d>>& places, Scene& scene,
                                Rng& rng) {
  constexpr std::size_t kBox = 6, kDesk = 10 * kBox;
  std::vector<MovingDoor> able;
  for (std::size_t i = 0; i + kDesk <= scene.faces.size(); ++i) {
    const int object = scene.faces[i].object;
    const std::string& type = scene.objects[static_cast<std::size_t>(object)].type;
    if (type != "desk" || (i > 0 && scene.faces[i - 1].object == object)) continue;
    const auto drawer = static_cast<std::size_t>(rng.integer(0, 2));
    MovingDoor door;

    const DoorLeaf front{i + 4 * kBox + 2 * drawer * kBox, 2 * kBox,
                         middle_of(scene, i + (4 + 2 * drawer) * kBox, kBox), 0.0};
    if (scene.faces[front.first + front.count - 1].object != object) continue;

    // The frame of the front: x along it, y inwards, z up.
    Eigen::Vector3d in = middle_of(scene, i + 3 * kBox, kBox) - front.hinge;
    in.z() = 0.0;
    in.normalize();
    geometry::Rigid3 frame;
    frame.rotation << in.cross(Eigen::Vector3d::UnitZ()), in, Eigen::Vector3d::UnitZ();
    frame.translation = front.hinge;
    const double out = rng.uniform(0.15, 0.3);
    if (!is_free(scene, object, frame,
                 {Eigen::Vector3d(-0.2, -out - 0.08, -0.1), Eigen::Vector3d(0.2, 0.0, 0.1)}))
      continue;

    // The drawer slides out of the desk.
    door.drawer = "drawer of " + scene.objects[static_cast<std::size_t>(object)].name;
    door.leaf = scene.leaves.size();
    door.opening = -1;
    door.other_rad = 1.0;
    door.slide = -out * in;
    frame.translation += door.slide;

    // Its box, which is hidden while it is shut.
    Scene box;
    Builder(box).box(frame, {-0.19, 0.01, -0.08}, {0.19, 0.34, 0.06}, {"cardboard"});
    for (Face& face : box.faces) face.object = object;
    door.body = box.faces;
    plan_swings(places, front.hinge - Eigen::Vector3d(0.0, 0.0, 0.5), 0.4, door, rng);
    if (door.starts.empty()) continue;
    scene.leaves.push_back(front);
    able.push_back(std::move(door));
  }
  return able;
}

/// Some of those that can move.
void choose(std::vector<MovingDoor> able, int count, Scene& scene, Rng& rng) {
  for (; !able.empty() && count > 0; --count) {
    const int k = rng.integer(0, static_cast<int>(able.size()) - 1);
    scene.moving_doors.push_back(std::move(able[static_cast<std::size_t>(k)]));
    able.erase(able.begin() + k);
  }
}

}  // namespace

void choose_moving_doors(const SynthOptions& options, Scene& scene) {
  if (options.lift && scene.plan) run_lift(options, camera_path(scene, options, {}, 0), scene);
  if (options.moving_drawers < 1 && (options.moving_doors < 1 || !scene.plan)) return;
  Rng rng(static_cast<std::uint64_t>(options.seed), 0xd005);
  const auto places = cameras(options, scene);
  if (options.moving_drawers > 0) {
    Rng own(static_cast<std::uint64_t>(options.seed), 0xd4a3);
    choose(drawers(places, scene, own), options.moving_drawers, scene, own);
  }
  if (options.moving_doors < 1 || !scene.plan) return;

  // Leaves are in the order of the openings that have one.
  std::vector<MovingDoor> able;
  std::size_t next = 0;
  for (std::size_t i = 0; i < scene.plan->openings.size(); ++i) {
    const PlanOpening& o = scene.plan->openings[i];
    if (o.leaf != Leaf::kShut && o.leaf != Leaf::kAjar && o.leaf != Leaf::kOpen) continue;
    MovingDoor door;
    door.leaf = next++;
    door.opening = static_cast<int>(i);
    if (o.back < 0 || door.leaf >= scene.leaves.size()) continue;

    // From rest to nearly shut, or to wide open.
    const DoorLeaf& leaf = scene.leaves[door.leaf];
    const double most = free_angle(scene, door.leaf, o);
    door.rest_rad = leaf.open_rad;
    door.other_rad = o.leaf == Leaf::kOpen ? rng.uniform(0.0, 0.4) : std::min(most, rng.uniform(1.2, 1.6));
    if (std::max(door.rest_rad, door.other_rad) > most + kAngleStep ||
        std::abs(door.other_rad - door.rest_rad) < 0.4)
      continue;
    plan_swings(places, leaf.hinge, reach_of(scene, leaf).norm(), door, rng);
    if (!door.starts.empty()) able.push_back(std::move(door));
  }

  choose(std::move(able), options.moving_doors, scene, rng);
}

}  // namespace plumbline::synth
