// SPDX-License-Identifier: BSD-3-Clause
#include "drawings/plan_drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace plumbline::exports {
namespace {

/// A leaf at right angles to its wall, from a hinge at the origin to (0, 1), and its way to (1, 0).
DrawnBlock door_block() {
  constexpr int kSteps = 24;
  DrawnBlock block{"DOOR", {{0, {{0.0, 0.0}, {0.0, 1.0}}}, {0, {}}}};
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = 0.5 * M_PI * i / kSteps;
    block.lines[1].points.emplace_back(std::cos(angle), std::sin(angle));
  }
  return block;
}

/// Both faces of a wall and the pane between, from (0, 0) to (1, 1).
DrawnBlock window_block() {
  return {"WINDOW",
          {{0, {{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}}, true}, {0, {{0.0, 0.5}, {1.0, 0.5}}}}};
}

void draw_opening(const plans::WallDoor& door, const PlanLayers& layers, double unit, Drawing& drawing) {
  const Eigen::Vector2d along = door.jambs[1] - door.jambs[0];
  const Eigen::Vector2d behind = Eigen::Vector2d(-along.y(), along.x()).normalized();
  Eigen::Vector2d across = door.far_jambs[0] - door.jambs[0];
  if (across.norm() < 0.02) across = plans::kAssumedThickness_m * unit * behind;

  if (door.kind == plans::OpeningKind::kWindow) {
    drawing.symbols.push_back({layers.glazing, 1, door.jambs[0], along, across});
    return;
  }

  // The edges of the opening, as the lintel over it.
  drawing.line(layers.door, door.jambs[0], door.jambs[1], true);
  drawing.line(layers.door, door.jambs[0] + across, door.jambs[1] + across, true);
  for (const Eigen::Vector2d& jamb : door.jambs) drawing.line(layers.wall, jamb, jamb + across);
  if (door.hinge < 0) return;

  const Eigen::Vector2d hinge = door.jambs[static_cast<std::size_t>(door.hinge)] +
                                (door.opens_front ? Eigen::Vector2d(0.0, 0.0) : across);
  drawing.symbols.push_back({layers.door, 0, hinge, door.hinge == 0 ? along : Eigen::Vector2d(-along),
                             (door.opens_front ? -along.norm() : along.norm()) * behind});
}

/// True if an outline lies in no room and behind a wall, such as what is seen through a window.
bool is_behind_walls(const std::vector<Eigen::Vector2d>& outline, const plans::WallPlan& plan) {
  constexpr double kFarthest_m = 0.8;
  const Eigen::Vector2d middle = std::accumulate(outline.begin(), outline.end(), Eigen::Vector2d(0.0, 0.0)) /
                                 static_cast<double>(outline.size());
  const bool in_room = std::any_of(plan.rooms.begin(), plan.rooms.end(), [&](const plans::WallRoom& room) {
    return plans::is_inside(room.outline, middle);
  });
  return !in_room && std::any_of(plan.walls.begin(), plan.walls.end(), [&](const plans::WallLine& wall) {
    const double behind = wall.offset_m - wall.normal.dot(middle), s = wall.along().dot(middle);
    return behind > 0.0 && behind < kFarthest_m && s > wall.s0 && s < wall.s1;
  });
}

/// True if the text lies in the room.
bool is_in_room(const DrawnText& text, const plans::WallRoom& room) {
  const auto box = box_of(text);
  return std::all_of(box.begin(), box.end(),
                     [&](const Eigen::Vector2d& p) { return plans::is_inside(room.outline, p); });
}

/// Outlines of furniture, and the places that they take from texts.
struct LabelFurniture {
  const std::vector<std::vector<Eigen::Vector2d>>& outlines;
  LabelPlaces lines{Drawing{}};

  [[nodiscard]] bool is_under(const DrawnText& text) const {
    return !lines.is_free(text) || std::any_of(outlines.begin(), outlines.end(), [&](const auto& outline) {
      return plans::is_inside(outline, text.at);
    });
  }
};

/// Puts a text at the nearest free place to its room's label, over furniture only if no other is free. False:
/// none is.
bool place_in_room(const plans::WallRoom& room, const LabelFurniture& furniture, double mm,
                   LabelPlaces& places, DrawnText& text) {
  std::vector<Eigen::Vector2d> inside;
  for (const Eigen::Vector2d& at : places_around(room.label, 2.0 * mm, 80.0 * mm)) {
    text.at = at;
    if (!is_in_room(text, room)) continue;
    if (places.is_free(text) && !furniture.is_under(text)) return places.place(text, {at});
    inside.push_back(at);
  }
  return places.place(text, inside);
}

}  // namespace

PlanLayers::PlanLayers(Drawing& drawing)
    : grid(drawing.add_layer({"A-ANNO-GRID", "#b8b8b8", 8, 0.1, true})),
      furniture(drawing.add_layer({"A-FURN", "#909090", 9, 0.13, true})),
      hatch(drawing.add_layer({"A-WALL-PATT", "#707070", 8, 0.1})),
      assumed(drawing.add_layer({"A-WALL-ASSM", "#707070", 8, 0.18})),
      area(drawing.add_layer({"A-AREA", "#2f5f93", 5, 0.18})),
      path(drawing.add_layer({"A-PATH", "#c08020", 30, 0.13, true})),
      wall(drawing.add_layer({"A-WALL", "#000000", 7, 0.5})),
      glazing(drawing.add_layer({"A-GLAZ", "#1f7090", 4, 0.18})),
      door(drawing.add_layer({"A-DOOR", "#a02828", 1, 0.25})),
      dimensions(drawing.add_layer({"A-ANNO-DIMS", "#404040", 3, 0.13})),
      anno(drawing.add_layer({"A-ANNO", "#202020", 7, 0.18})) {
  drawing.blocks = {door_block(), window_block()};
}

std::string PlanStyle::number(double value, int decimals) const {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (comma) std::replace(text.begin(), text.end(), '.', ',');
  return text;
}

/// Walls with hatching, furniture, openings and the limits of rooms.
void draw_walls(const plans::WallPlan& plan, const PlanStyle& style, const PlanLayers& layers,
                Drawing& drawing) {
  for (const auto& outline : plan.furniture) {
    if (!is_behind_walls(outline, plan)) drawing.lines.push_back({layers.furniture, outline, true});
  }

  // Solids: outlined, hatched if both faces were seen
  for (plans::WallSolid& solid : plans::wall_solids(plan, style.unit)) {
    for (const auto& ring : solid.rings)
      drawing.lines.push_back(
          {solid.assumed ? layers.assumed : layers.wall, ring, true, false, solid.assumed});
    if (!solid.assumed) drawing.areas.push_back({layers.hatch, std::move(solid.rings), 1.2 * style.mm});
  }

  // Faces, and gaps that are no windows
  for (const plans::WallLine& wall : plan.walls) {
    for (const auto& [a, b] : plans::solid_pieces(wall)) drawing.line(layers.wall, wall.at(a), wall.at(b));

    for (const plans::WallOpening& gap : wall.gaps) {
      const Eigen::Vector2d middle = wall.at(0.5 * (gap.s0 + gap.s1));
      const bool window = std::any_of(plan.doors.begin(), plan.doors.end(), [&](const plans::WallDoor& door) {
        return (0.5 * (door.jambs[0] + door.jambs[1]) - middle).norm() < 0.3 ||
               (0.5 * (door.far_jambs[0] + door.far_jambs[1]) - middle).norm() < 0.3;
      });
      if (!window) drawing.line(layers.glazing, wall.at(gap.s0), wall.at(gap.s1), true);
    }
  }

  // Openings, and sides of rooms without a wall
  for (const plans::WallDoor& door : plan.doors) draw_opening(door, layers, style.unit, drawing);
  for (const plans::WallRoom& room : plan.rooms) {
    for (std::size_t i = 0; i < room.outline.size(); ++i) {
      if (room.side(i) != plans::RoomSide::kWall)
        drawing.line(layers.area, room.outline[i], room.outline[(i + 1) % room.outline.size()], true);
    }
  }
}

/// Numbers of openings by kind: D1, P1, W1.
std::vector<std::string> opening_numbers(const plans::WallPlan& plan) {
  std::array<int, 3> counts{0, 0, 0};
  std::vector<std::string> numbers;
  for (const plans::WallDoor& door : plan.doors) {
    const auto kind = static_cast<std::size_t>(door.kind);
    numbers.push_back(fmt::format("{}{}", "DPW"[kind], ++counts[kind]));
  }
  return numbers;
}

void draw_labels(const plans::WallPlan& plan, const PlanStyle& style, const PlanLayers& layers,
                 Drawing& drawing) {
  LabelPlaces places(drawing);
  const std::vector<std::string> numbers = opening_numbers(plan);

  const auto with_leader = [&](DrawnText& text, const Eigen::Vector2d& anchor, double farthest_mm) {
    for (const Eigen::Vector2d& at : places_around(anchor, 1.5 * style.mm, farthest_mm * style.mm)) {
      text.at = at;
      if ((at - anchor).norm() < text.width_m() || !places.is_free(text) || !places.is_free(anchor, at))
        continue;

      // The leader ends at the nearer side of the text
      const auto box = box_of(text, 0.25 * text.height_m);
      const Eigen::Vector2d left = 0.5 * (box[0] + box[3]), right = 0.5 * (box[1] + box[2]);
      drawing.line(text.layer, anchor, (left - anchor).norm() < (right - anchor).norm() ? left : right);
      places.add(drawing.lines.back());
      places.add(text);
      return;
    }
  };

  LabelFurniture furniture{plan.furniture};
  for (const auto& outline : plan.furniture) furniture.lines.add(DrawnLine{layers.furniture, outline, true});

  // A room's number and area where it lies free in the room, smaller if need be, else beside it
  for (std::size_t i = 0; i < plan.rooms.size(); ++i) {
    const plans::WallRoom& room = plan.rooms[i];
    const std::string area = fmt::format("{}{} m²", room.closed ? "" : "≥ ", style.number(room.area_m2, 2));
    DrawnText text{layers.area, room.label, 3.0 * style.mm, 0.0, fmt::format("{}: {}", i + 1, area)};
    bool placed = false;
    for (const double height_mm : {3.0, 2.2, 1.8}) {
      text.height_m = height_mm * style.mm;
      placed = place_in_room(room, furniture, style.mm, places, text);
      if (placed) break;
    }
    if (!placed) with_leader(text, room.label, 80.0);
    drawing.texts.push_back(text);
  }

  // Numbers of openings beside them
  for (std::size_t i = 0; i < plan.doors.size(); ++i) {
    const plans::WallDoor& door = plan.doors[i];
    const Eigen::Vector2d middle =
        0.25 * (door.jambs[0] + door.jambs[1] + door.far_jambs[0] + door.far_jambs[1]);
    DrawnText text{door.kind == plans::OpeningKind::kWindow ? layers.glazing : layers.door, middle,
                   1.8 * style.mm, 0.0, numbers[i]};
    if (!places.place(text, places_around(middle, style.mm, 9.0 * style.mm))) with_leader(text, middle, 60.0);
    drawing.texts.push_back(text);
  }
}

/// Tables of rooms and openings, without empty ones.
std::vector<SheetTable> tables_of(const plans::WallPlan& plan, const PlanStyle& style) {
  const auto known = [&](double value) { return value > 0.0 ? style.number(value, 2) : std::string("–"); };
  std::vector<SheetTable> tables(2);
  tables[0] = {"Rooms", {{"No.", 9}, {"Area (m²)", 21}, {"Perimeter (m)", 23}, {"Height (m)", 34}}, {}};

  // Areas of rooms seen in part are lower bounds
  for (std::size_t i = 0; i < plan.rooms.size(); ++i) {
    const plans::WallRoom& room = plan.rooms[i];

    const std::string range = room.height_m > 0.0
                                  ? fmt::format(" ({} to {})", style.number(room.heights_m[0], 2),
                                                style.number(room.heights_m[1], 2))
                                  : "";
    tables[0].rows.push_back({fmt::format("{}", i + 1),
                              (room.closed ? "" : "≥ ") + style.number(room.area_m2, 2),
                              (room.closed ? "" : "≥ ") + style.number(room.perimeter_m() / style.unit, 2),
                              known(room.height_m) + range});
  }

  // Openings in the order of their numbers
  static constexpr std::array<const char*, 3> kKinds{"door", "passage", "window"};
  const std::vector<std::string> numbers = opening_numbers(plan);
  tables[1] = {"Openings",
               {{"No.", 9}, {"Kind", 21}, {"Clear width (m)", 27}, {"Sill (m)", 15}, {"Head (m)", 15}},
               {}};
  for (std::size_t i = 0; i < plan.doors.size(); ++i) {
    const plans::WallDoor& door = plan.doors[i];
    tables[1].rows.push_back({numbers[i], kKinds[static_cast<std::size_t>(door.kind)],
                              style.number(door.width_m, 3), known(door.sill_m), known(door.head_m)});
  }

  // A table without rows is left out
  tables.erase(
      std::remove_if(tables.begin(), tables.end(), [](const SheetTable& t) { return t.rows.empty(); }),
      tables.end());
  return tables;
}

}  // namespace plumbline::exports
