// SPDX-License-Identifier: BSD-3-Clause
#include "recording/plan_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "plumbline/core/json.hpp"

namespace plumbline::synth {

namespace {

using nlohmann::ordered_json;

const char* name_of(OpeningKind kind) {
  switch (kind) {
    case OpeningKind::kDoor:
      return "door";
    case OpeningKind::kPassage:
      return "passage";
    case OpeningKind::kWindow:
      return "window";
    case OpeningKind::kHalfWall:
      return "half_wall";
    case OpeningKind::kNiche:
      return "niche";
  }
  return "";
}

const char* name_of(Leaf leaf) {
  switch (leaf) {
    case Leaf::kNone:
      return "none";
    case Leaf::kShut:
      return "shut";
    case Leaf::kAjar:
      return "ajar";
    case Leaf::kOpen:
      return "open";
    case Leaf::kSliding:
      return "sliding";
  }
  return "";
}

ordered_json point(const Eigen::Vector2d& p) { return {p.x(), p.y()}; }

ordered_json line(const std::vector<Eigen::Vector2d>& points) {
  ordered_json out = ordered_json::array();
  for (const Eigen::Vector2d& p : points) out.push_back(point(p));
  return out;
}

/// A room, with the faces of its walls.
ordered_json describe_room(const Plan& plan, const PlanRoom& room) {
  ordered_json faces = ordered_json::array();
  for (const PlanFace& face : room.faces) {
    const PlanWall& wall = plan.walls[static_cast<std::size_t>(face.wall)];
    faces.push_back({{"wall", face.wall},
                     {"from_m", point(face.from)},
                     {"to_m", point(face.to)},
                     {"thickness_m", wall.thickness},
                     {"outer", wall.outer}});
  }
  return {{"kind", room.kind},      {"storey", room.storey},   {"outline_m", line(room.outline())},
          {"area_m2", room.area()}, {"height_m", room.height}, {"faces", faces}};
}

/// An opening, with its leaf if it is a door.
ordered_json describe_opening(const Plan& plan, const PlanOpening& o) {
  const PlanWall& wall = plan.walls[static_cast<std::size_t>(o.wall)];
  ordered_json rooms = {o.front};
  if (o.back >= 0) rooms.push_back(o.back);
  ordered_json out = {{"kind", name_of(o.kind)}, {"wall", o.wall},
                      {"rooms", rooms},          {"jambs_m", line({wall.at(o.from), wall.at(o.to)})},
                      {"width_m", o.width()},    {"sill_m", o.sill},
                      {"head_m", o.head},        {"depth_m", o.depth}};
  if (o.kind == OpeningKind::kDoor) {
    out["leaf"] = name_of(o.leaf);
    out["open_deg"] = o.open_rad * 180.0 / M_PI;
  }
  return out;
}

/// Rows of the 4 x 4 matrix.
ordered_json matrix(const geometry::Rigid3& pose) {
  ordered_json rows = ordered_json::array();
  for (int i = 0; i < 3; ++i) {
    rows.push_back({pose.rotation(i, 0), pose.rotation(i, 1), pose.rotation(i, 2), pose.translation[i]});
  }
  rows.push_back({0.0, 0.0, 0.0, 1.0});
  return rows;
}

}  // namespace

std::string describe_plan(const Plan& plan, const std::vector<geometry::Rigid3>& starts,
                          const std::optional<PlanCoverage>& coverage) {
  ordered_json rooms = ordered_json::array(), openings = rooms, things = rooms, robots = rooms;
  for (const PlanRoom& room : plan.rooms) rooms.push_back(describe_room(plan, room));
  for (const PlanOpening& o : plan.openings) openings.push_back(describe_opening(plan, o));

  // Outlines of furniture.
  for (const PlanThing& thing : plan.things) {
    things.push_back({{"name", thing.name},
                      {"type", thing.type},
                      {"room", thing.room},
                      {"outline_m", line(thing.outline)},
                      {"bottom_m", thing.bottom},
                      {"top_m", thing.top}});
  }

  // Start of each recording.
  for (std::size_t i = 0; i < starts.size(); ++i) {
    robots.push_back({{"folder", fmt::format("robot{}", i)}, {"world_from_first_camera", matrix(starts[i])}});
  }

  // Shares seen, in the order of rooms and faces.
  if (coverage) {
    std::size_t next = 0;
    for (ordered_json& room : rooms) {
      for (ordered_json& face : room["faces"]) face["seen"] = coverage->wall_faces[next++];
    }

    for (std::size_t i = 0; i < openings.size(); ++i) openings[i]["jambs_seen"] = coverage->jambs[i];
  }

  // Keys in the order of the file.
  ordered_json file = {{"kind", plan.kind}, {"layout", plan.number}};
  file["storeys"] = plan.storeys;
  file["alike"] = plan.alike;

  // Seen shares are known only with a reference.
  if (coverage) file["seen"] = coverage->all;
  file["rooms"] = rooms;
  file["openings"] = openings;
  file["things"] = things;
  file["robots"] = robots;

  return core::json_text(file, 1);
}

std::string describe_changes(const Scene& scene) {
  // Things have no box before they are added or after removal.
  const auto corners = [](const Eigen::AlignedBox3d& box) -> ordered_json {
    if (box.isEmpty()) return nullptr;
    return {{box.min().x(), box.min().y(), box.min().z()}, {box.max().x(), box.max().y(), box.max().z()}};
  };
  ordered_json changes = ordered_json::array();

  for (const SceneChange& c : scene.changes) {
    changes.push_back({{"kind", c.kind}});

    // Light has no place.
    if (c.kind == "light") {
      changes.back()["factor"] = c.factor;
      continue;
    }

    // Moved things, with what stands on them.
    changes.back().update({{"thing", c.thing},
                           {"with", c.with},
                           {"box_before_m", corners(c.before)},
                           {"box_after_m", corners(c.after)},
                           {"offset_m", {c.offset.x(), c.offset.y(), c.offset.z()}},
                           {"turn_deg", c.turn_rad * 180.0 / M_PI}});
  }

  return core::json_text(ordered_json{{"scene", scene.name}, {"changes", changes}}, 1);
}

}  // namespace plumbline::synth
