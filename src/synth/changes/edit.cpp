// SPDX-License-Identifier: BSD-3-Clause
#include "changes/edit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "layout/layout.hpp"
#include "plumbline/core/numbers.hpp"

namespace plumbline::synth {

using Eigen::AlignedBox3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::Rigid3;

namespace {

/// Turned about the vertical through `middle`, then moved.
Rigid3 moved(const Vector3d& middle, double turn_rad, const Vector3d& by) {
  const Rigid3 turn = upright(Vector3d::Zero(), turn_rad);
  return {turn.rotation, middle + by - turn.rotation * middle};
}

void transform(Face& face, const Rigid3& motion) {
  face.origin = motion * face.origin;
  for (Vector3d* axis : {&face.u_axis, &face.v_axis, &face.normal}) *axis = motion.rotation * *axis;
}

bool structural(const std::string& type) {
  return type == "wall" || type == "floor" || type == "ceiling" || type == "opening" || type == "panels";
}

bool hangs(const std::string& type) {
  return type == "poster" || type == "picture" || type == "whiteboard" || type == "sign";
}

}  // namespace

/// The space that a wall takes.
struct Editor::Slab {
  Vector2d origin{0, 0}, along{1, 0}, normal{0, 1};
  double from = 1e9, to = -1e9, half = 0.0;  // m along it, and half its thickness
  double low = -1e9, high = 1e9;             // m: heights of its storey
  std::vector<int> objects;                  // its own

  /// Makes it long enough for a place on it.
  void extend(const Vector2d& p);
  [[nodiscard]] bool has(const Face& face) const {
    double z = 1e9;
    for (const Vector2d& uv : face.polygon) z = std::min(z, face.at(uv.x(), uv.y()).z());
    return z > low && z < high;
  }
  [[nodiscard]] bool near(const Vector2d& p, double margin) const {
    const double s = along.dot(p - origin);
    return std::abs(normal.dot(p - origin)) < half + margin && s > from - 0.16 && s < to + 0.16;
  }
};

tl::unexpected<core::Error> Editor::wrong(const Edit& edit, const std::string& what) {
  return core::usage_error(fmt::format("{}:{}: {}", edit.mark.file, edit.mark.line, what));
}

int Editor::find(const std::string& name) const {
  const auto at = std::find_if(scene_.objects.begin(), scene_.objects.end(),
                               [&](const Object& object) { return object.name == name; });
  const int index = static_cast<int>(at - scene_.objects.begin());
  return at == scene_.objects.end() || removed(index) ? -1 : index;
}

AlignedBox3d Editor::box(int object) const {
  AlignedBox3d box;
  for (const Face& face : scene_.faces) {
    if (face.object != object) continue;
    for (const Vector2d& uv : face.polygon) box.extend(face.at(uv.x(), uv.y()));
  }
  return box;
}

std::vector<Vector2d> Editor::outline(int object) const {
  const Face* first = nullptr;
  Eigen::AlignedBox2d box;
  Eigen::Matrix2d axes = Eigen::Matrix2d::Identity();
  for (const Face& face : scene_.faces) {
    if (face.object != object) continue;

    // The first face gives the direction, if upright.
    if (first == nullptr && std::abs(face.normal.z()) < 0.1) {
      axes.col(1) = -face.normal.head<2>().normalized();
      axes.col(0) = Vector2d(axes(1, 1), -axes(0, 1));
    }
    first = &face;
    for (const Vector2d& uv : face.polygon)
      box.extend(Vector2d(axes.transpose() * face.at(uv.x(), uv.y()).head<2>()));
  }
  return rectangle(Vector2d::Zero(), std::atan2(axes(1, 0), axes(0, 0)), box.min(), box.max());
}

std::vector<int> Editor::with_company(int object) const {
  std::vector<int> all = {object};
  const AlignedBox3d thing = box(object);
  for (int k = 0; k < static_cast<int>(scene_.objects.size()); ++k) {
    const std::string& type = scene_.objects[static_cast<std::size_t>(k)].type;
    if (k == object || removed(k) || structural(type) || hangs(type) || type == "lamp") continue;

    // Things that stand on it move with it.
    const AlignedBox3d other = box(k);
    if (other.isEmpty() || other.min().z() < thing.min().z() + 0.2) continue;
    if (thing.contains(Vector3d(other.center().x(), other.center().y(), thing.center().z())))
      all.push_back(k);
  }
  return all;
}

SceneChange& Editor::note(const std::string& kind, int object) {
  SceneChange change;
  change.kind = kind;

  // Light is not a thing.
  if (object >= 0) {
    change.thing = scene_.objects[static_cast<std::size_t>(object)].name;
    change.before = box(object);
  }
  scene_.changes.push_back(change);
  return scene_.changes.back();
}

core::Result<void> Editor::move(const Edit& edit) {
  const int object = find(edit.move);
  SceneChange& change = note("moved", object);
  change.offset = edit.by.empty() ? Vector3d::Zero() : Vector3d(edit.by[0], edit.by[1], 0.0);
  change.turn_rad = edit.turn_rad;
  const Rigid3 motion = moved(change.before.center(), edit.turn_rad, change.offset);

  // Things on it move too, with their lamps.
  const std::vector<int> all = with_company(object);
  for (const int k : all) {
    if (k != object) change.with.push_back(scene_.objects[static_cast<std::size_t>(k)].name);
    const AlignedBox3d around = box(k);
    for (Lamp& lamp : scene_.lamps) {
      if (!around.contains(lamp.center)) continue;
      lamp.center = motion * lamp.center;
      for (Vector3d* axis : {&lamp.half_u, &lamp.half_v}) *axis = motion.rotation * *axis;
    }

    for (Face& face : scene_.faces) {
      if (face.object == k) transform(face, motion);
    }
  }
  change.after = box(object);

  // The plan knows outlines of things.
  if (!scene_.plan) return {};
  for (PlanThing& thing : scene_.plan->things) {
    if (thing.name != edit.move) continue;
    for (Vector2d& p : thing.outline) p = (motion * Vector3d(p.x(), p.y(), 0.0)).head<2>();
  }

  return {};
}

core::Result<void> Editor::remove(const Edit& edit) {
  const int object = find(edit.remove);
  SceneChange& change = note("removed", object);

  // Things on it go too.
  for (const int k : with_company(object)) {
    if (k != object) change.with.push_back(scene_.objects[static_cast<std::size_t>(k)].name);
    const AlignedBox3d around = box(k);
    const auto gone = [&](const Lamp& lamp) { return around.contains(lamp.center); };
    scene_.lamps.erase(std::remove_if(scene_.lamps.begin(), scene_.lamps.end(), gone), scene_.lamps.end());
    removed_.push_back(k);
  }

  // The plan forgets it.
  if (!scene_.plan) return {};
  std::vector<PlanThing>& things = scene_.plan->things;
  things.erase(std::remove_if(things.begin(), things.end(),
                              [&](const PlanThing& thing) { return thing.name == edit.remove; }),
               things.end());
  return {};
}

core::Result<void> Editor::add(const Edit& edit) {
  if (edit.at.size() < 2) return wrong(edit, "add: needs at: [x, y]");
  const Vector3d size =
      edit.size.size() == 3 ? Vector3d(edit.size[0], edit.size[1], edit.size[2]) : Vector3d(0.4, 0.4, 0.4);
  const Vector3d at(edit.at[0], edit.at[1], edit.at.size() > 2 ? edit.at[2] : 0.0);

  // A new object, as a scene file would describe it.
  Builder builder(scene_);
  builder.begin_object(edit.add, fmt::format("added {} {}", edit.add, scene_.changes.size()), edit.mark);
  add_thing(builder, edit.add, upright(at, edit.yaw_rad), size, edit.material);
  const int object = static_cast<int>(scene_.objects.size()) - 1;

  // Unknown types add no faces.
  if (box(object).isEmpty())
    return wrong(edit, fmt::format("add: things of the type '{}' cannot be added", edit.add));

  // It did not exist before.
  SceneChange& change = note("added", object);
  change.after = change.before;
  change.before.setEmpty();

  // The plan lists it in its room.
  if (!scene_.plan) return {};
  for (std::size_t r = 0; r < scene_.plan->rooms.size(); ++r) {
    const PlanRoom& room = scene_.plan->rooms[r];
    const double floor = scene_.plan->storeys[static_cast<std::size_t>(room.storey)];
    if (std::abs(floor - at.z()) > 0.1 || !room.contains(at.head<2>())) continue;
    scene_.plan->things.push_back({change.thing, edit.add, outline(object), change.after.min().z() - floor,
                                   change.after.max().z() - floor, static_cast<int>(r)});
  }

  return {};
}

void Editor::Slab::extend(const Vector2d& p) {
  from = std::min(from, along.dot(p - origin));
  to = std::max(to, along.dot(p - origin));
}

/// A numbered wall of the plan, as plan.json has it.
std::optional<Editor::Slab> Editor::slab_of_plan(const Plan& plan, const std::string& wall) const {
  Slab slab;
  const auto number = core::to_number(wall);
  if (!number || *number < 0.0 || *number >= static_cast<double>(plan.walls.size())) return std::nullopt;

  // The line in its middle, and half its thickness.
  const int index = static_cast<int>(*number);
  const PlanWall& w = plan.walls[static_cast<std::size_t>(index)];
  slab.origin = w.origin;
  slab.along = w.direction;
  slab.half = 0.5 * w.thickness;

  // Objects of walls and openings are in the order of the plan.
  std::vector<int> walls, openings;
  for (std::size_t k = 0; k < scene_.objects.size(); ++k) {
    if (scene_.objects[k].type == "wall") walls.push_back(static_cast<int>(k));
    if (scene_.objects[k].type == "opening") openings.push_back(static_cast<int>(k));
  }

  // Faces of the wall, and its storey.
  std::size_t next = 0;
  for (const PlanRoom& room : plan.rooms) {
    for (const PlanFace& face : room.faces) {
      const int object = walls[next++];
      if (face.wall != index) continue;
      const auto storey = static_cast<std::size_t>(room.storey);
      slab.low = plan.storeys[storey] - 0.05;
      slab.high = storey + 1 < plan.storeys.size() ? plan.storeys[storey + 1] - 0.05 : 1e9;
      slab.objects.push_back(object);
      slab.extend(face.from);
      slab.extend(face.to);
    }
  }

  // Openings belong to the wall.
  for (std::size_t i = 0; i < plan.openings.size(); ++i) {
    if (plan.openings[i].wall == index) slab.objects.push_back(openings[i]);
  }
  return slab;
}

/// A named wall of a scene file.
std::optional<Editor::Slab> Editor::slab_of_object(const std::string& wall) const {
  const int object = find(wall);
  if (object < 0 || scene_.objects[static_cast<std::size_t>(object)].type != "wall") return std::nullopt;
  const auto face = std::find_if(scene_.faces.begin(), scene_.faces.end(),
                                 [&](const Face& f) { return f.object == object; });
  const Face &front = face[0], &back = face[1];  // of the first piece
  Slab slab;
  slab.along = front.u_axis.head<2>();
  slab.half = 0.5 * std::abs(front.normal.dot(front.origin - back.origin));
  slab.origin = (front.origin - slab.half * front.normal).head<2>();

  // Extent from all pieces of the wall.
  slab.objects = {object};
  for (const Face& f : scene_.faces) {
    if (f.object != object || std::abs(f.normal.dot(front.normal)) < 0.9) continue;
    for (const Vector2d& uv : f.polygon) slab.extend(f.at(uv.x(), uv.y()).head<2>());
  }
  return slab;
}

std::optional<Editor::Slab> Editor::slab(const std::string& wall) const {
  std::optional<Slab> slab = scene_.plan ? slab_of_plan(*scene_.plan, wall) : slab_of_object(wall);
  if (!slab || slab->from >= slab->to) return std::nullopt;
  slab->normal = {-slab->along.y(), slab->along.x()};
  return slab;
}

bool Editor::square(const std::string& wall) const {
  const auto s = slab(wall);
  return s && std::all_of(scene_.faces.begin(), scene_.faces.end(), [&](const Face& face) {
           const auto& type = scene_.objects[static_cast<std::size_t>(face.object)].type;
           const double across = std::abs(face.normal.head<2>().dot(s->normal));

           // Oblique structure must not end at the wall.
           if (!structural(type) || !s->has(face) || across < 1e-6 || across > 1.0 - 1e-6) return true;
           if (std::find(s->objects.begin(), s->objects.end(), face.object) != s->objects.end()) return true;
           return std::none_of(face.polygon.begin(), face.polygon.end(), [&](const Vector2d& uv) {
             return s->near(face.at(uv.x(), uv.y()).head<2>(), 0.03);
           });
         });
}

/// Moves a wall with its openings and the pictures on it sideways; surfaces that end there become longer
/// or shorter.
core::Result<void> Editor::shift_wall(const Edit& edit) {
  const auto s = slab(edit.wall);
  if (!s || !square(edit.wall)) {
    return wrong(edit, fmt::format("wall: {} '{}'; walls are numbered in plan.json, and named in scene files",
                                   s ? "another wall is not square to" : "there is no", edit.wall));
  }

  SceneChange& change = note("wall", s->objects.front());
  if (scene_.plan) change.thing = "wall " + edit.wall;
  const Vector3d by(edit.shift * s->normal.x(), edit.shift * s->normal.y(), 0.0);
  change.offset = by;

  // The wall moves with its openings and pictures.
  std::vector<char> rigid(scene_.objects.size(), 0);
  for (const int object : s->objects) rigid[static_cast<std::size_t>(object)] = 1;
  for (std::size_t k = 0; k < scene_.objects.size(); ++k) {
    if (hangs(scene_.objects[k].type) && box(static_cast<int>(k)).center().z() > s->low &&
        box(static_cast<int>(k)).center().z() < s->high &&
        s->near(box(static_cast<int>(k)).center().head<2>(), 0.06))
      rigid[k] = 1;
  }

  // Ends of adjoining surfaces follow.
  for (Face& face : scene_.faces) {
    const auto object = static_cast<std::size_t>(face.object);
    if (rigid[object] != 0) face.origin += by;
    if (rigid[object] != 0 || !structural(scene_.objects[object].type) || !s->has(face)) continue;

    // Only surfaces parallel to the motion.
    if (std::abs(face.normal.dot(by)) > 1e-6 * by.norm()) continue;
    for (Vector2d& uv : face.polygon) {
      if (s->near(face.at(uv.x(), uv.y()).head<2>(), 0.03))
        uv += Vector2d(by.dot(face.u_axis), by.dot(face.v_axis));
    }
  }

  // Door leaves turn about moved hinges.
  for (DoorLeaf& leaf : scene_.leaves) {
    if (rigid[static_cast<std::size_t>(scene_.faces[leaf.first].object)] != 0) leaf.hinge += by;
  }
  change.after = change.before.translated(by);

  // Rooms of the plan change their shape.
  if (!scene_.plan) return {};
  for (PlanRoom& room : scene_.plan->rooms) {
    const double floor = scene_.plan->storeys[static_cast<std::size_t>(room.storey)];
    if (floor < s->low || floor > s->high) continue;

    // Corners at the wall move with it.
    for (PlanFace& face : room.faces) {
      for (Vector2d* p : {&face.from, &face.to}) {
        if (s->near(*p, 0.03)) *p += by.head<2>();
      }
    }
  }

  scene_.plan->walls[static_cast<std::size_t>(std::stoi(edit.wall))].origin += by.head<2>();
  return {};
}

DoorLeaf* Editor::leaf(int door) {
  int opening = -1;

  // Scene files count leaves, plans count openings.
  for (std::size_t i = 0; i < scene_.leaves.size(); ++i) {
    if (!scene_.plan && static_cast<int>(i) == door) return &scene_.leaves[i];
  }
  for (std::size_t k = 0; scene_.plan && k < scene_.objects.size(); ++k) {
    if (scene_.objects[k].type != "opening" || ++opening != door) continue;
    for (DoorLeaf& leaf : scene_.leaves) {
      if (scene_.faces[leaf.first].object == static_cast<int>(k)) return &leaf;
    }
  }
  return nullptr;
}

core::Result<void> Editor::turn_door(const Edit& edit) {
  DoorLeaf* door = leaf(edit.door);
  if (door == nullptr) {
    return wrong(edit,
                 fmt::format("door: {} has no leaf that turns; doors are the openings of plan.json, and "
                             "counted in scene files, both from 0",
                             edit.door));
  }

  // The leaf turns about its hinge.
  SceneChange& change = note("door", scene_.faces[door->first].object);
  if (scene_.plan) change.thing = fmt::format("opening {}", edit.door);
  change.turn_rad = door->open_rad - edit.open_rad;
  change.before.setEmpty();
  const Rigid3 motion = moved(door->hinge, change.turn_rad, Vector3d::Zero());

  // Extent before and after.
  for (std::size_t i = door->first; i < door->first + door->count; ++i) {
    Face& face = scene_.faces[i];
    for (const Vector2d& uv : face.polygon) change.before.extend(face.at(uv.x(), uv.y()));
    transform(face, motion);
    for (const Vector2d& uv : face.polygon) change.after.extend(face.at(uv.x(), uv.y()));
  }

  door->open_rad = edit.open_rad;

  // The plan knows the leaf's state.
  if (!scene_.plan) return {};
  PlanOpening& o = scene_.plan->openings[static_cast<std::size_t>(edit.door)];
  o.open_rad = edit.open_rad;
  o.leaf = edit.open_rad < 0.02 ? Leaf::kShut : edit.open_rad < 0.9 ? Leaf::kAjar : Leaf::kOpen;

  return {};
}

core::Result<void> Editor::apply(const Edit& edit) {
  // Unknown names, with the most similar one.
  for (const std::string& name : {edit.move, edit.remove}) {
    if (name.empty() || find(name) >= 0) continue;
    std::vector<std::string> names;
    for (const Object& object : scene_.objects) names.push_back(object.name);
    return wrong(edit, fmt::format("there is no '{}'{}", name, core::hint(name, names)));
  }

  if (!edit.move.empty()) return move(edit);
  if (!edit.remove.empty()) return remove(edit);
  if (!edit.add.empty()) return add(edit);
  if (!edit.wall.empty()) return shift_wall(edit);
  if (edit.door >= 0) return turn_door(edit);
  if (!(edit.light > 0.0)) {
    return wrong(edit, "an edit has one of move, remove, add, wall, door, light");
  }

  // Lamps and ambient light alike.
  scene_.ambient *= edit.light;
  for (Lamp& lamp : scene_.lamps) lamp.power *= edit.light;
  note("light", -1).factor = edit.light;

  return {};
}

void Editor::finish() {
  // Leaves keep their faces, whose numbers change.
  std::vector<std::size_t> number{0};
  for (const Face& face : scene_.faces) number.push_back(number.back() + (removed(face.object) ? 0 : 1));
  for (DoorLeaf& leaf : scene_.leaves) {
    const std::size_t end = number[leaf.first + leaf.count];
    leaf.first = number[leaf.first];
    leaf.count = end - leaf.first;
  }

  scene_.faces.erase(std::remove_if(scene_.faces.begin(), scene_.faces.end(),
                                    [&](const Face& face) { return removed(face.object); }),
                     scene_.faces.end());
}

}  // namespace plumbline::synth
