// SPDX-License-Identifier: BSD-3-Clause
// Which changes: those of a file, or those that a seed draws.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "changes/edit.hpp"
#include "layout/layout.hpp"
#include "plumbline/core/numbers.hpp"
#include "plumbline/core/options.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

core::Result<std::vector<Edit>> read_edits(const std::string& file) {
  auto root = core::read_yaml(file);
  if (!root) return tl::unexpected<core::Error>(root.error());
  core::ConfigProblems problems;
  std::vector<Edit> edits;

  // Problems are collected, to report all at once.
  if (root->kind != core::ConfigNode::Kind::kSequence)
    problems.push_back({root->mark, "", "a file of edits is a list: '- {move: desk 14, by: [0.3, 0]}'"});

  for (std::size_t i = 0; i < root->items.size(); ++i) {
    Edit edit;
    edit.mark = root->items[i].mark;
    core::OptionTable table;

    // Kinds of edits.
    table.text("move", edit.move, "Name of the thing to move by `by` and to turn by `turn`");
    table.text("remove", edit.remove, "Name of the thing to take away");
    table.text("add", edit.add, "Kind of thing to add at `at`");
    table.text("wall", edit.wall, "Wall to move sideways by `shift`");
    table.integer("door", edit.door, {0, 10000}, "", "Door to open to `open`");
    table.number("light", edit.light, {0.01, 100.0}, "", "Factor on all light");

    // Arguments of the edits.
    table.numbers("by", edit.by, 2, {-100.0, 100.0}, "m", "Way");
    table.numbers("at", edit.at, 0, {-1000.0, 1000.0}, "m", "Place");
    table.numbers("size", edit.size, 3, {0.01, 20.0}, "m", "Size");
    table.number("turn", edit.turn_rad, {-7.0, 7.0}, "rad", "Angle to turn by");
    table.number("yaw", edit.yaw_rad, {-7.0, 7.0}, "rad", "Direction");
    table.number("shift", edit.shift, {-1.0, 1.0}, "m", "Way to the left of the wall's direction");
    table.number("open", edit.open_rad, {0.0, 3.1}, "rad", "Angle of the leaf; 0: shut");
    table.choice("material", edit.material, material_names(), "Material of what is added");

    // Unknown keys and wrong values are problems.
    table.set_all(root->items[i], fmt::format("[{}]", i), problems);
    edits.push_back(std::move(edit));
  }

  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));
  return edits;
}

/// Draws changes that leave all ways and paths free.
class Draw {
 public:
  Draw(std::uint64_t seed, Scene& scene, Editor& editor)
      : rng_(seed, 0xc4a9), scene_(scene), editor_(editor) {}

  void things() {
    static const std::vector<std::string> kTypes = {"desk",  "table", "chair",      "sofa", "cabinet",
                                                    "shelf", "plant", "floor_lamp", "box",  "bed"};

    // Things on the floor with unique names.
    std::vector<int> all;
    for (std::size_t k = 0; k < scene_.objects.size(); ++k) {
      const bool thing = std::find(kTypes.begin(), kTypes.end(), scene_.objects[k].type) != kTypes.end();
      const auto named = std::count_if(scene_.objects.begin(), scene_.objects.end(),
                                       [&](const Object& o) { return o.name == scene_.objects[k].name; });
      if (thing && named == 1 && on_floor(static_cast<int>(k))) all.push_back(static_cast<int>(k));
    }

    // A sixth of them, 4 to 20.
    const std::size_t count = std::clamp<std::size_t>(all.size() / 6, 4, 20);
    for (std::size_t done = 0, tries = 0; done < count && tries < 20 * count && !all.empty(); ++tries) {
      const std::size_t at = static_cast<std::size_t>(rng_.integer(0, static_cast<int>(all.size()) - 1));
      if (!change(all[at])) continue;
      all.erase(all.begin() + static_cast<long>(at));
      ++done;
    }
  }

  /// Opens or shuts a door that no path or room depends on.
  void door() {
    for (int tries = 0; tries < 20; ++tries) {
      const int doors = static_cast<int>(scene_.plan ? scene_.plan->openings.size() : scene_.leaves.size());
      if (doors == 0) return;
      Edit edit;
      edit.door = rng_.integer(0, doors - 1);
      const DoorLeaf* leaf = editor_.leaf(edit.door);
      if (leaf == nullptr || (scene_.plan && !may_turn(edit.door))) continue;
      edit.open_rad = leaf->open_rad > 0.05 ? 0.0 : rng_.uniform(0.2, 0.8);
      if (!scene_.plan) edit.open_rad = leaf->open_rad + rng_.uniform(0.05, 0.15);  // out of the way
      if (editor_.apply(edit)) return;
    }
  }

  /// Moves a wall by 5 mm.
  void wall() {
    for (int tries = 0; tries < 30; ++tries) {
      Edit edit;
      edit.shift = rng_.chance(0.5) ? 0.005 : -0.005;
      if (scene_.plan) {
        edit.wall = std::to_string(rng_.integer(0, static_cast<int>(scene_.plan->walls.size()) - 1));
      } else {
        edit.wall = rng_.pick(scene_.objects).name;
      }
      if (editor_.square(edit.wall) && editor_.apply(edit)) return;
    }
  }

  void light() {
    Edit edit;
    edit.light = rng_.uniform(0.5, 1.5);
    static_cast<void>(editor_.apply(edit));
  }

 private:
  [[nodiscard]] bool on_floor(int object) const {
    const double z = editor_.box(object).min().z();
    const std::vector<double> floors = scene_.plan ? scene_.plan->storeys : std::vector<double>{0.0};
    return std::any_of(floors.begin(), floors.end(),
                       [&](double floor) { return std::abs(z - floor) < 0.15; });
  }

  /// A leaf of an inner door that is not the only way into a room.
  [[nodiscard]] bool may_turn(int door) const {
    const PlanOpening& o = scene_.plan->openings[static_cast<std::size_t>(door)];
    return o.back >= 0 && (o.leaf == Leaf::kShut || o.leaf == Leaf::kAjar);
  }

  /// Moves, turns or removes a thing at random, or adds a box near it; false if this does not fit.
  bool change(int object) {
    const std::string& name = scene_.objects[static_cast<std::size_t>(object)].name;
    const double kind = rng_.uniform();
    Edit edit;

    // Some things are removed.
    if (kind < 0.15) {
      edit.remove = name;
      return editor_.apply(edit).has_value();
    }

    // Some turn in place, others also move.
    const double far = kind < 0.3 ? 0.0 : rng_.uniform(0.1, 1.0), angle = rng_.uniform(-M_PI, M_PI);
    const Vector2d by = far * Vector2d(std::cos(angle), std::sin(angle));
    const double turn = far == 0.0 || rng_.chance(0.3) ? rng_.uniform(-1.5, 1.5) : 0.0;
    const Eigen::AlignedBox3d box = editor_.box(object);
    const Vector2d middle = box.center().head<2>();

    // The outline after the motion.
    std::vector<Vector2d> place;
    for (const Vector2d& p : editor_.outline(object))
      place.push_back(middle + by + Eigen::Rotation2Dd(turn) * (p - middle));
    const bool adds = kind > 0.85;

    // A new box instead.
    if (adds) {
      const Vector2d at = middle + 1.5 * by;
      place = rectangle(at, turn, {-0.25, -0.2}, {0.25, 0.2});
      edit.add = "box";

      // On the floor, if the thing nearly is.
      edit.at = {at.x(), at.y(), std::round(100.0 * box.min().z()) / 100.0 < 0.16 ? 0.0 : box.min().z()};
      edit.size = {0.5, 0.4, rng_.uniform(0.25, 0.6)};
      edit.yaw_rad = turn;
    } else {
      edit.move = name;
      edit.by = {by.x(), by.y()};
      edit.turn_rad = turn;
    }

    return fits(adds ? -1 : object, name, place, box) && editor_.apply(edit).has_value();
  }

  /// The place is free without the thing itself, and people can still get everywhere.
  [[nodiscard]] bool fits(int object, const std::string& name, const std::vector<Vector2d>& place,
                          const Eigen::AlignedBox3d& box) const {
    // Away from the robots' paths.
    for (const RobotPath& robot : scene_.robots) {
      for (std::size_t i = 0; i < robot.waypoints.size(); ++i) {
        const Vector2d a = robot.waypoints[i].position.head<2>(),
                       b = robot.waypoints[(i + 1) % robot.waypoints.size()].position.head<2>();

        // Samples of the way between two waypoints.
        for (int k = 0; k <= 8; ++k) {
          for (const Vector2d& p : place) {
            if ((a + 0.125 * k * (b - a) - p).norm() < 0.6) return false;
          }
        }
      }
    }

    // The scene without the thing.
    Scene rest;
    const std::vector<int> gone = object < 0 ? std::vector<int>{} : editor_.with_company(object);
    for (const Face& face : scene_.faces) {
      const bool own = std::find(gone.begin(), gone.end(), face.object) != gone.end();
      if (!own && !editor_.removed(face.object)) rest.faces.push_back(face);
    }

    // The storey that it stands on.
    double floor = 0.0;
    for (const double storey : scene_.plan ? scene_.plan->storeys : std::vector<double>{}) {
      if (storey < box.min().z() + 0.2) floor = storey;
    }

    if (!Ground(rest, floor).is_free(place)) return false;
    return !scene_.plan || leaves_ways(name, object < 0, place, box.max().z() - box.min().z());
  }

  /// True if doors stay free and the room stays passable.
  [[nodiscard]] bool leaves_ways(const std::string& name, bool adds, const std::vector<Vector2d>& place,
                                 double height) const {
    const Plan& plan = *scene_.plan;
    const auto thing = std::find_if(plan.things.begin(), plan.things.end(),
                                    [&](const PlanThing& t) { return t.name == name; });
    if (thing == plan.things.end()) return false;

    // It stays in its room.
    const PlanRoom& room = plan.rooms[static_cast<std::size_t>(thing->room)];
    if (!std::all_of(place.begin(), place.end(), [&](const Vector2d& p) { return room.contains(p); }))
      return false;

    // Doors need space to open.
    for (const PlanOpening& o : plan.openings) {
      if (o.front != thing->room && o.back != thing->room) continue;
      for (const Vector2d& p : place) {
        if ((p - plan.middle(o)).norm() < 0.5 * o.width() + 0.5) return false;
      }
    }

    // The rest of the room stays reachable.
    Ground ground = furnished_ground(plan, room.storey);
    if (!adds) ground.unblock(thing->outline);
    return ground.try_block(place, height > 1.4, room.outline(), ways_of(plan, thing->room), 0.2);
  }

  Rng rng_;
  Scene& scene_;
  Editor& editor_;
};

}  // namespace

std::vector<Vector2d> ways_of(const Plan& plan, int room) {
  std::vector<Vector2d> out;
  for (const PlanOpening& o : plan.openings) {
    if (o.passable() && (o.front == room || o.back == room)) out.push_back(plan.middle(o));
  }
  return out;
}

core::Result<void> apply_changes(const SynthOptions& options, Scene& scene) {
  Editor editor(scene);

  // A number draws random changes, a file lists them.
  if (const auto seed = core::to_number(options.changes)) {
    Draw draw(static_cast<std::uint64_t>(std::max(0.0, *seed)), scene, editor);
    draw.things();
    draw.door();
    draw.wall();
    draw.light();
  } else {
    const auto edits = read_edits(options.changes);
    if (!edits) return tl::unexpected<core::Error>(edits.error());

    // An impossible edit ends the run.
    for (const Edit& edit : *edits) {
      if (auto done = editor.apply(edit); !done) return done;
    }
  }
  editor.finish();
  return {};
}

}  // namespace plumbline::synth
