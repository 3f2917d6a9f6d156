// SPDX-License-Identifier: BSD-3-Clause
// A plan as numbers, for programs.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "drawings/plan_drawing.hpp"
#include "plumbline/core/json.hpp"

namespace plumbline::exports {
namespace {

using PlanJson = nlohmann::ordered_json;

double to_tenth_mm(double value) { return std::round(value * 1e4) / 1e4; }
PlanJson place(const Eigen::Vector2d& p) { return {to_tenth_mm(p.x()), to_tenth_mm(p.y())}; }
PlanJson known(double value) { return value > 0.0 ? PlanJson(to_tenth_mm(value)) : PlanJson(nullptr); }

/// A room with what is along each of its sides.
PlanJson room_json(const plans::WallRoom& room, std::size_t number) {
  static constexpr std::array<const char*, 3> kSides{"wall", "gap", "limit"};
  PlanJson outline = PlanJson::array(), sides = PlanJson::array();
  for (std::size_t i = 0; i < room.outline.size(); ++i) {
    outline.push_back(place(room.outline[i]));
    sides.push_back(kSides[static_cast<std::size_t>(room.side(i))]);
  }

  // Values that are not known are null
  PlanJson json = {{"number", number},
                   {"closed", room.closed},
                   {"area_m2", to_tenth_mm(room.area_m2)},
                   {"perimeter_m", to_tenth_mm(room.perimeter_m())},
                   {"height_m", known(room.height_m)},
                   {"heights_m", nullptr},
                   {"label_m", place(room.label)},
                   {"outline_m", outline},
                   {"sides", sides}};

  // Ceilings that are not level have a range
  if (room.height_m > 0.0)
    json["heights_m"] = {to_tenth_mm(room.heights_m[0]), to_tenth_mm(room.heights_m[1])};
  return json;
}

}  // namespace

/// The plan as JSON; lengths are metres, rounded to a tenth of a millimetre.
std::string plan_json(const plans::WallPlan& plan, const std::string& frame, double floor_m, double cut_m) {
  PlanJson json = {{"frame", frame}, {"unit", "m"}, {"floor_m", floor_m}, {"cut_m", cut_m}};
  json["rooms"] = PlanJson::array();
  for (std::size_t i = 0; i < plan.rooms.size(); ++i)
    json["rooms"].push_back(room_json(plan.rooms[i], i + 1));

  // Numbers as in the drawing
  json["openings"] = PlanJson::array();
  const std::vector<std::string> numbers = opening_numbers(plan);

  for (std::size_t i = 0; i < plan.doors.size(); ++i) {
    const plans::WallDoor& door = plan.doors[i];

    json["openings"].push_back(
        {{"number", numbers[i]},
         {"kind", door.kind == plans::OpeningKind::kDoor      ? "door"
                  : door.kind == plans::OpeningKind::kPassage ? "passage"
                                                              : "window"},
         {"jambs_m",
          {place(0.5 * (door.jambs[0] + door.far_jambs[0])),
           place(0.5 * (door.jambs[1] + door.far_jambs[1]))}},
         {"width_m", to_tenth_mm(door.width_m)},
         {"depth_m", known(door.depth_m())},
         {"sill_m", to_tenth_mm(door.sill_m)},
         {"head_m", known(door.head_m)},
         {"hinge", door.hinge < 0 ? PlanJson(nullptr) : PlanJson(door.hinge)},
         {"opens", door.hinge < 0 ? PlanJson(nullptr) : PlanJson(door.opens_front ? "right" : "left")}});
  }

  // Walls without their openings
  json["walls"] = PlanJson::array();
  for (const plans::WallLine& wall : plan.walls) {
    for (const auto& [a, b] : plans::solid_pieces(wall)) {
      json["walls"].push_back({{"from_m", place(wall.at(a))},
                               {"to_m", place(wall.at(b))},
                               {"normal", place(wall.normal)},
                               {"thickness_m", known(wall.thickness_m)}});
    }
  }

  // Outlines of furniture
  json["furniture"] = PlanJson::array();
  for (const auto& outline : plan.furniture) {
    PlanJson corners = PlanJson::array();
    for (const Eigen::Vector2d& corner : outline) corners.push_back(place(corner));
    json["furniture"].push_back({{"outline_m", corners}});
  }

  return core::json_text(json);
}

}  // namespace plumbline::exports
