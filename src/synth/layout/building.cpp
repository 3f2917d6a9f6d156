// SPDX-License-Identifier: BSD-3-Clause
// Storeys above each other, and the stairs between them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "layout/layout.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kGoing = 0.27;    // m from step to step
constexpr double kRise = 0.18;     // m, the largest height of a step
constexpr double kEntry = 1.3;     // m of floor before the stairs, on every storey
constexpr double kLanding = 1.25;  // m, the least depth of the landing halfway

int steps_of(double pitch) { return static_cast<int>(std::ceil(0.5 * pitch / kRise)); }

/// The stairwell of all storeys: two flights side by side, with a landing halfway.
struct Stairwell {
  double x0, x1, y0, y1;  // m: inner faces; the corridor is beyond y1
  double pitch;

  explicit Stairwell(const PlanRoom& room, double pitch_m) : pitch(pitch_m) {
    Eigen::AlignedBox2d box;
    for (const Vector2d& p : room.outline()) box.extend(p);
    x0 = box.min().x(), x1 = box.max().x(), y0 = box.min().y(), y1 = box.max().y();
  }

  [[nodiscard]] double middle() const { return 0.5 * (x0 + x1); }
  [[nodiscard]] double top() const { return y1 - kEntry; }  // where the flights begin and end
  [[nodiscard]] double bottom() const { return top() - steps_of(pitch) * kGoing; }
  [[nodiscard]] Vector2d entry() const { return {middle(), y1 - 0.5 * kEntry}; }

  [[nodiscard]] LiftShaft shaft() const { return {{Vector2d(x0, y0), Vector2d(x1, y1)}, top()}; }

  /// The way from the entry up to that of the next storey; z above this floor.
  [[nodiscard]] std::vector<Vector3d> climb() const {
    const double left = 0.5 * (x0 + middle()), right = 0.5 * (x1 + middle());
    std::vector<Vector3d> out = {{0.5 * (left + middle()), y1 - 0.5 * kEntry, 0.0}};
    constexpr int kPieces = 6;
    for (int i = 0; i <= kPieces; ++i) {
      const double s = static_cast<double>(i) / kPieces;
      out.emplace_back(left, top() + s * (bottom() - top()), 0.5 * s * pitch);
    }
    out.emplace_back(left + 0.2, bottom() - 0.5, 0.5 * pitch);
    out.emplace_back(right - 0.2, bottom() - 0.5, 0.5 * pitch);
    for (int i = 0; i <= kPieces; ++i) {
      const double s = static_cast<double>(i) / kPieces;
      out.emplace_back(right, bottom() + s * (top() - bottom()), 0.5 * (1.0 + s) * pitch);
    }
    out.emplace_back(0.5 * (right + middle()), y1 - 0.5 * kEntry, pitch);
    return out;
  }
};

/// Steps, landings, rails and lamps of one storey, whose floor is at 0.
void build_stairs(const Stairwell& well, int index, bool lowest, bool highest, double height, Builder& b) {
  const geometry::Rigid3 here;
  const core::ConfigMark mark = b.scene().objects.front().mark;
  const double m = well.middle(), pitch = well.pitch;
  const auto solid = [&](const Vector3d& lo, const Vector3d& hi, const char* material) {
    b.box(here, lo, hi, {material});
  };

  // A landing only, above the lowest floor.
  b.begin_object("floor", fmt::format("floor of stairs {}", index), mark);
  if (lowest) {
    b.polygon(
        {{well.x0, well.y0, 0.0}, {well.x1, well.y0, 0.0}, {well.x1, well.y1, 0.0}, {well.x0, well.y1, 0.0}},
        Vector3d::UnitX(), {"tiles"});
  } else {
    solid({well.x0, well.top(), -kSlab}, {well.x1, well.y1, 0.0}, "tiles");
  }

  b.begin_object("lamp", "", mark);
  const double ceiling = highest ? height : pitch - kSlab;
  add_ceiling_lamp(b, upright({m, well.y1 - 0.5 * kEntry, ceiling}, 0.0), 0.5, 0.5, 9.0);
  b.begin_object("stairs", "", mark);

  // The highest storey has a ceiling, but no steps.
  if (highest) {
    b.polygon({{well.x0, well.y1, height},
               {well.x1, well.y1, height},
               {well.x1, well.y0, height},
               {well.x0, well.y0, height}},
              Vector3d::UnitX(), {"ceiling"});

    // Rails around the opening.
    if (lowest) return;
    solid({well.x0, well.top() - 0.05, 0.0}, {m - 0.05, well.top(), 1.0}, "paint_grey");
    solid({m - 0.05, well.bottom(), 0.0}, {m + 0.05, well.top(), 1.0}, "paint_grey");
    return;
  }

  // Wall between both flights, and the half landing.
  solid({m - 0.05, well.bottom(), 0.0}, {m + 0.05, well.top(), pitch}, "plaster");
  solid({well.x0, well.y0, 0.5 * pitch - 0.25}, {well.x1, well.bottom(), 0.5 * pitch}, "tiles");
  const int n = steps_of(pitch);

  // Up one flight, back along the other.
  for (int i = 0; i < n; ++i) {
    const double z = 0.5 * pitch * (i + 1) / n, a = well.top() - i * kGoing, c = well.bottom() + i * kGoing;
    solid({well.x0, a - kGoing, std::max(0.0, z - 0.25)}, {m - 0.05, a, z}, "lino");
    solid({m + 0.05, c, 0.5 * pitch + z - 0.25}, {well.x1, c + kGoing, 0.5 * pitch + z}, "lino");
  }
}

BuildingFrame draw_frame(const SynthOptions& options, Rng& rng) {
  BuildingFrame frame;
  frame.height = rng.uniform(2.5, 3.2);
  frame.pitch = frame.height + kSlab;
  frame.outer = rng.uniform(0.3, 0.45);
  frame.corridor = rng.uniform(1.7, 2.6);
  frame.stairs = rng.uniform(2.7, 3.1);
  frame.low =
      kEntry + kLanding + steps_of(frame.pitch) * kGoing + 0.5 * frame.outer + 0.15 + rng.uniform(0.0, 0.6);

  // Long enough for the rooms of any storey.
  const int side = (options.rooms + 1) / 2;
  const double length =
      std::max({side * rng.uniform(3.4, 4.4), (options.rooms - side) * 3.2 + frame.stairs,
                6.5 + 3.2 * std::max(options.like, options.copies), options.hall ? 24.5 : 9.0});
  frame.size = {length, frame.low + frame.corridor + rng.uniform(3.8, 6.0)};
  return frame;
}

/// Nothing but the way from the corridor leads into the stairwell.
void clear_stairs(Plan& plan) {
  const auto kind = [&](int room) {
    return room < 0 ? std::string() : plan.rooms[static_cast<std::size_t>(room)].kind;
  };
  std::vector<PlanOpening> kept;
  for (PlanOpening& o : plan.openings) {
    const bool stairs = kind(o.front) == "stairs" || kind(o.back) == "stairs";
    const bool corridor = kind(o.front) == "corridor" || kind(o.back) == "corridor";
    if (stairs && (!corridor || o.sill > 0.0)) continue;
    if (stairs) o.leaf = Leaf::kNone;
    kept.push_back(o);
  }
  plan.openings = std::move(kept);
}

/// Adds a storey to the whole plan, with the numbers of its rooms, walls and openings moved on.
void append(const Plan& part, double floor, Plan& plan) {
  const int rooms = static_cast<int>(plan.rooms.size()), walls = static_cast<int>(plan.walls.size()),
            openings = static_cast<int>(plan.openings.size()), storey = static_cast<int>(plan.storeys.size());
  plan.storeys.push_back(floor);
  plan.walls.insert(plan.walls.end(), part.walls.begin(), part.walls.end());

  // Rooms refer to walls by number.
  for (PlanRoom room : part.rooms) {
    room.storey = storey;
    for (PlanFace& face : room.faces) face.wall += walls;
    plan.rooms.push_back(room);
  }

  // Openings refer to walls, rooms and each other.
  for (PlanOpening o : part.openings) {
    o.wall += walls;
    o.front += rooms;
    if (o.back >= 0) o.back += rooms;
    if (o.like >= 0) o.like += openings;
    plan.openings.push_back(o);
  }

  // Things refer to rooms.
  for (PlanThing thing : part.things) {
    thing.room += rooms;
    plan.things.push_back(thing);
  }

  for (const int room : part.alike) plan.alike.push_back(room + rooms);
}

/// The rooms, openings and things of one storey; its walls keep their numbers.
Plan storey_of(const Plan& plan, int storey) {
  Plan part;
  part.kind = plan.kind;
  part.walls = plan.walls;
  int first = -1;

  // Rooms of a storey are consecutive.
  for (std::size_t i = 0; i < plan.rooms.size(); ++i) {
    if (plan.rooms[i].storey != storey) continue;
    if (first < 0) first = static_cast<int>(i);
    part.rooms.push_back(plan.rooms[i]);
    part.rooms.back().storey = 0;
  }

  // Openings belong to their front room.
  const int last = first + static_cast<int>(part.rooms.size());
  for (PlanOpening o : plan.openings) {
    if (o.front < first || o.front >= last) continue;
    o.front -= first;
    if (o.back >= 0) o.back -= first;
    part.openings.push_back(o);
  }

  // Things in these rooms.
  for (PlanThing thing : plan.things) {
    if (thing.room < first || thing.room >= last) continue;
    thing.room -= first;
    part.things.push_back(thing);
  }

  return part;
}

const PlanRoom* stairs_of(const Plan& plan) {
  const auto room = std::find_if(plan.rooms.begin(), plan.rooms.end(),
                                 [](const PlanRoom& r) { return r.kind == "stairs" || r.kind == "lift"; });
  return room == plan.rooms.end() ? nullptr : &*room;
}

/// Independent random numbers for the steps of one storey.
struct StoreyRandom {
  explicit StoreyRandom(std::uint64_t own)
      : cells(own, 1), rooms(own, 2), openings(own, 3), shell(own, 4), things(own, 5) {}
  Rng cells, rooms, openings, shell, things;
};

/// Rooms and openings of a storey; false if this attempt failed.
bool plan_storey(const SynthOptions& options, const BuildingFrame& frame, int storey, StoreyRandom& random,
                 Plan& part) {
  const int alike = std::max(options.like, options.copies);
  if (!add_rooms(draw_storey(frame, options.rooms, alike, options.hall && storey == 0, random.cells),
                 random.rooms, part))
    return false;

  // Rooms end at the ceiling; stairs go through it.
  const bool highest = storey + 1 == options.floors;
  for (PlanRoom& room : part.rooms) {
    room.height = std::min(room.height, frame.height);
    if (room.kind == "stairs") room.height = highest ? frame.height : frame.pitch;
  }

  // Openings, with every room reachable.
  if (!add_openings(random.openings, part)) return false;
  clear_stairs(part);
  return stairs_of(part) != nullptr && make_alike(part) && connected(part);
}

/// Walls, the way up and furniture of a storey, with its floor at height 0.
void build_storey(const SynthOptions& options, const BuildingFrame& frame, int storey, StoreyRandom& random,
                  Plan& part, Builder& builder) {
  build_shell(part, random.shell, builder);
  const PlanRoom* stairs = stairs_of(part);
  const Stairwell well(*stairs, frame.pitch);
  const int index = static_cast<int>(stairs - part.rooms.data());

  // One way up: lift or stairs.
  const bool lowest = storey == 0, highest = storey + 1 == options.floors;
  if (options.lift) {
    build_lift_storey(well.shaft(), index, lowest, highest, highest ? frame.height : frame.pitch, builder);
  } else {
    build_stairs(well, index, lowest, highest, frame.height, builder);
  }

  // Furniture keeps off the way up.
  part.things.push_back(
      {options.lift ? "lift" : "stairs", options.lift ? "lift" : "stairs",
       rectangle({0.0, 0.0}, 0.0, {well.x0 + 0.01, well.y0 + 0.01}, {well.x1 - 0.01, well.top()}), 0.0,
       frame.pitch, index});

  // Furniture on the free floor.
  Ground ground(part);
  ground.block(part.things.back().outline, false);
  ground.recompute();
  furnish(part, ground, random.things, builder);
}

/// A path over several storeys, piece by piece.
class BuildingWalk {
 public:
  /// `storeys`: the walk on each; `height`: of the camera over the floor, metres.
  BuildingWalk(const Plan& plan, const Stairwell& well, std::vector<RobotPath> storeys, double height)
      : plan_(plan), well_(well), storeys_(std::move(storeys)), height_(height), path_(storeys_.front()) {
    path_.waypoints.clear();
  }

  /// A storey's walk, at the height of its floor.
  void tour(int k) {
    for (Waypoint w : storeys_[static_cast<std::size_t>(k)].waypoints) {
      const Vector3d lift(0.0, 0.0, plan_.storeys[static_cast<std::size_t>(k)] + height_ - w.position.z());
      w.position += lift;
      if (w.look) *w.look += lift;
      path_.waypoints.push_back(w);
    }
  }

  /// By the lift or on the stairs.
  void change_storey(int from, int to) {
    if (stairs_of(plan_)->kind != "lift") {
      climb(from, to);
    } else if (from != to) {
      ride(from, to);
    }
  }

  [[nodiscard]] const RobotPath& path() const { return path_; }

 private:
  /// The lift takes the camera from storey to storey.
  void ride(int from, int to) {
    const auto z = [&](int storey) { return plan_.storeys[static_cast<std::size_t>(storey)] + height_; };
    for (const Vector3d& p : lift_ride(well_.shaft(), z(from), z(to))) {
      Waypoint w;
      w.position = p;
      if (p.y() < well_.top() - 0.5) w.look = Vector3d(p.x(), well_.top() + 2.0, p.z() - 0.4);
      path_.waypoints.push_back(w);
    }
  }

  /// Storey by storey, up or down the stairs.
  void climb(int from, int to) {
    for (int k = from; k != to; k += to > from ? 1 : -1) {
      std::vector<Vector3d> steps = well_.climb();
      const double floor = plan_.storeys[static_cast<std::size_t>(to > from ? k : k - 1)];
      if (to < from) std::reverse(steps.begin(), steps.end());
      for (const Vector3d& p : steps) {
        Waypoint w;
        w.position = p + Vector3d(0.0, 0.0, floor + height_);
        w.pitch_rad = -0.15;
        path_.waypoints.push_back(w);
      }
    }
  }

  const Plan& plan_;
  const Stairwell& well_;
  std::vector<RobotPath> storeys_;
  double height_;
  RobotPath path_;
};

}  // namespace

bool build_building(const SynthOptions& options, std::uint64_t seed, Scene& scene, Plan& plan) {
  Rng common(seed, 6);
  const BuildingFrame frame = draw_frame(options, common);
  plan.storeys.clear();
  Builder builder(scene);

  for (int storey = 0; storey < options.floors; ++storey) {
    // Each storey has independent random numbers.
    StoreyRandom random(mix(seed, static_cast<std::uint64_t>(storey) + 1));
    Plan part;
    part.kind = plan.kind;
    part.number = plan.number;
    part.copies = plan.copies;
    if (!plan_storey(options, frame, storey, random, part)) return false;

    // Built at height 0, then raised to the storey's height.
    const std::size_t faces = scene.faces.size(), lamps = scene.lamps.size(), leaves = scene.leaves.size();
    build_storey(options, frame, storey, random, part, builder);
    const double floor = storey * frame.pitch;
    for (std::size_t i = faces; i < scene.faces.size(); ++i) scene.faces[i].origin.z() += floor;
    for (std::size_t i = lamps; i < scene.lamps.size(); ++i) scene.lamps[i].center.z() += floor;
    for (std::size_t i = leaves; i < scene.leaves.size(); ++i) scene.leaves[i].hinge.z() += floor;
    append(part, floor, plan);
  }

  // One lift serves all storeys.
  if (options.lift) {
    for (PlanRoom& room : plan.rooms) {
      if (room.kind == "stairs") room.kind = "lift";
    }
    add_lift(Stairwell(*stairs_of(plan), frame.pitch).shaft(), plan.storeys, scene);
  }
  return true;
}

RobotPath plan_building_path(const Plan& plan, Route route, int robot, Rng& rng) {
  const int floors = static_cast<int>(plan.storeys.size()), start = robot % floors;
  const double height = rng.uniform(1.35, 1.6);
  std::vector<RobotPath> storeys;
  std::optional<Stairwell> well;

  // Walks on each storey, which begin and end at the stairs.
  for (int k = 0; k < floors; ++k) {
    const Plan part = storey_of(plan, k);
    const PlanRoom* stairs = stairs_of(part);
    if (stairs == nullptr) return {};

    if (!well) well.emplace(*stairs, floors > 1 ? plan.storeys[1] : 3.0);
    storeys.push_back(plan_path(part, furnished_ground(part, 0), route, robot, rng, well->entry()));

    if (storeys.back().waypoints.empty()) return {};
  }

  // Up from where it starts, then down over those below, and back.
  BuildingWalk walk(plan, *well, std::move(storeys), height);
  int at = start;
  walk.tour(at);

  for (int k = start + 1; k < floors; ++k) {
    walk.change_storey(k - 1, k);
    walk.tour(at = k);
  }

  for (int k = start - 1; k >= 0; --k) {
    walk.change_storey(at, k);
    walk.tour(at = k);
  }
  walk.change_storey(at, start);

  return walk.path();
}

}  // namespace plumbline::synth
