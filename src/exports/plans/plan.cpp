// SPDX-License-Identifier: BSD-3-Clause
// A floor plan, or a vertical section: SVG, PDF, DXF.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "formats.hpp"
#include "plans/drawing.hpp"
#include "plans/walls.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/text.hpp"
#include "source/georeference.hpp"

namespace plumbline::exports {
namespace {

constexpr double kPlanText_m = 0.14;

/// The layers of a plan, by their numbers in the drawing.
struct PlanLayers {
  std::size_t grid, furniture, rooms, path, walls, windows, doors, dimensions;
  explicit PlanLayers(Drawing& drawing)
      : grid(drawing.add_layer({"grid", "#d0d0d0", 8, 0.1})),
        furniture(drawing.add_layer({"furniture", "#909090", 9, 0.13})),
        rooms(drawing.add_layer({"rooms", "#3a6ea5", 5, 0.15})),
        path(drawing.add_layer({"path", "#c08020", 30, 0.15})),
        walls(drawing.add_layer({"walls", "#000000", 7, 0.6})),
        windows(drawing.add_layer({"windows", "#3080a0", 4, 0.25})),
        doors(drawing.add_layer({"doors", "#b03030", 1, 0.25})),
        dimensions(drawing.add_layer({"dimensions", "#505050", 3, 0.13})) {}
};

void draw_walls(const WallPlan& plan, const PlanLayers& layers, Drawing& drawing) {
  constexpr double kDimensioned_m = 1.0;
  constexpr double kBeside_m = 0.16;
  for (const WallLine& wall : plan.walls) {
    for (const auto& [a, b] : solid_pieces(wall)) drawing.line(layers.walls, wall.at(a), wall.at(b));
    for (const WallOpening& gap : wall.gaps) drawing.line(layers.windows, wall.at(gap.s0), wall.at(gap.s1));
    if (wall.length() < kDimensioned_m) continue;
    DrawnText text;
    text.layer = layers.dimensions;
    text.at = wall.at(0.5 * (wall.s0 + wall.s1)) + kBeside_m * wall.normal;
    text.height_m = kPlanText_m;
    text.angle_rad = std::atan2(wall.along().y(), wall.along().x());
    text.text = fmt::format("{:.2f}", wall.length());
    drawing.texts.push_back(text);
    for (const double s : {wall.s0, wall.s1})  // where the length is measured
      drawing.line(layers.dimensions, wall.at(s), wall.at(s) + 1.6 * kBeside_m * wall.normal);
  }
}

void draw_doors(const WallPlan& plan, const PlanLayers& layers, Drawing& drawing) {
  for (const WallDoor& door : plan.doors) {
    drawing.line(layers.doors, 0.5 * (door.jambs[0] + door.far_jambs[0]),
                 0.5 * (door.jambs[1] + door.far_jambs[1]));
    for (std::size_t k = 0; k < 2; ++k) {
      if (door.jambs[k] != door.far_jambs[k]) drawing.line(layers.walls, door.jambs[k], door.far_jambs[k]);
    }
  }
}

/// A dashed line, in dashes that all forms can hold.
void draw_dashed(std::size_t layer, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                 Drawing& drawing) {
  constexpr double kDash_m = 0.1;
  constexpr double kPitch_m = 0.16;
  const double length = (to - from).norm();
  for (double s = 0.0; s < length; s += kPitch_m)
    drawing.line(layer, from + s / length * (to - from),
                 from + std::min(s + kDash_m, length) / length * (to - from));
}

/// Numbers and areas, and dashed what is assumed or the limit of what was seen.
void draw_rooms(const WallPlan& plan, const PlanLayers& layers, Drawing& drawing) {
  int number = 0;
  for (const WallRoom& room : plan.rooms) {
    DrawnText text;
    text.layer = layers.rooms;
    text.at = room.label;
    text.height_m = 1.4 * kPlanText_m;
    text.text = fmt::format("{}: {}{:.2f} m2", ++number, room.closed ? "" : "at least ", room.area_m2);
    drawing.texts.push_back(text);
    for (std::size_t i = 0; i < room.outline.size(); ++i) {
      if (room.side(i) != RoomSide::kWall)
        draw_dashed(layers.rooms, room.outline[i], room.outline[(i + 1) % room.outline.size()], drawing);
    }
  }
}

/// The table of rooms, below everything.
void draw_room_table(const WallPlan& plan, const PlanLayers& layers, Drawing& drawing) {
  constexpr double kLine_m = 2.2 * kPlanText_m;
  const Eigen::Vector2d low = drawing.bounds().first;
  for (std::size_t i = 0; i < plan.rooms.size(); ++i) {
    const WallRoom& room = plan.rooms[i];
    DrawnText text;
    text.layer = layers.dimensions;
    text.height_m = kPlanText_m;
    text.text = fmt::format("Room {}: area {}{:.2f} m2, perimeter {:.2f} m, height {}", i + 1,
                            room.closed ? "" : "at least ", room.area_m2, room.perimeter_m(),
                            room.height_m > 0.0 ? fmt::format("{:.2f} m ({:.2f} to {:.2f})", room.height_m,
                                                              room.heights_m[0], room.heights_m[1])
                                                : "not seen");
    text.at = low + Eigen::Vector2d(0.5 + 0.35 * kPlanText_m * static_cast<double>(text.text.size()),
                                    -kLine_m * static_cast<double>(i + 1));
    drawing.texts.push_back(text);
  }
}

/// The selected part of the cameras' paths, thinned; those are left out that only a cloud is known of.
void draw_path(const MapSource& source, std::size_t layer, Drawing& drawing) {
  constexpr double kStep_m = 0.05;
  const auto poses = source.poses(false);
  if (!poses) return;
  std::int32_t robot = -1;
  for (const ExportPose& pose : *poses) {
    const Eigen::Vector2d at = pose.world_from_camera.translation.head<2>();
    if (robot != pose.robot) {
      drawing.lines.push_back({layer, {at}, false, false});
      robot = pose.robot;
    } else if ((at - drawing.lines.back().points.back()).norm() > kStep_m) {
      drawing.lines.back().points.push_back(at);
    }
  }
  const auto single = [&](const DrawnLine& line) { return line.layer == layer && line.points.size() < 2; };
  drawing.lines.erase(std::remove_if(drawing.lines.begin(), drawing.lines.end(), single),
                      drawing.lines.end());
}

/// A line each metre, and a scale bar below.
void draw_grid(std::size_t layer, std::size_t bar_layer, Drawing& drawing) {
  const auto [low, high] = drawing.bounds();
  const Eigen::Array2d from = low.array().floor();
  const Eigen::Array2d to = high.array().ceil();
  std::vector<DrawnLine> lines;
  for (double x = from.x(); x <= to.x() + 0.5; x += 1.0)
    lines.push_back({layer, {{x, from.y()}, {x, to.y()}}, false, false});
  for (double y = from.y(); y <= to.y() + 0.5; y += 1.0)
    lines.push_back({layer, {{from.x(), y}, {to.x(), y}}, false, false});
  drawing.lines.insert(drawing.lines.begin(), lines.begin(), lines.end());
  const double bar_m = to.x() - from.x() >= 5.0 ? 5.0 : 1.0;
  const double y = from.y() - 0.45;
  constexpr double kTick_m = 0.12;
  drawing.line(bar_layer, {from.x(), y}, {from.x() + bar_m, y});
  for (double x = 0.0; x <= bar_m; x += 1.0)
    drawing.line(bar_layer, {from.x() + x, y}, {from.x() + x, y + kTick_m});
  drawing.texts.push_back(
      {bar_layer, {from.x() + bar_m + 0.4, y + 0.05}, kPlanText_m, 0.0, fmt::format("{:g} m", bar_m)});
}

/// Notes on what the plan holds.
std::vector<std::string> notes_of(const WallPlan& plan) {
  std::size_t gaps = 0;
  for (const WallLine& wall : plan.walls) gaps += wall.gaps.size();
  const auto closed =
      std::count_if(plan.rooms.begin(), plan.rooms.end(), [](const WallRoom& r) { return r.closed; });
  const auto open = static_cast<std::ptrdiff_t>(plan.rooms.size()) - closed;
  std::vector<std::string> notes{
      fmt::format("{} walls, {} doors{}, {} closed rooms{}", plan.walls.size(), plan.doors.size(),
                  gaps > 0 ? fmt::format(", {} windows or gaps at the cut", gaps) : "", closed,
                  open > 0 ? fmt::format(", {} seen in part", open) : "")};
  if (!plan.rays_known)
    notes.emplace_back(
        "without map.db it is not known what cameras saw through: only doors below a lintel are found");
  return notes;
}

core::Result<Drawing> plan_drawing(MapSource& source, ExportSummary& summary) {
  const auto plan = find_walls(source);
  if (!plan) return tl::unexpected(plan.error());
  Drawing drawing;
  const PlanLayers layers(drawing);
  for (const auto& outline : plan->furniture)
    drawing.lines.push_back({layers.furniture, outline, true, false});
  draw_walls(*plan, layers, drawing);
  draw_doors(*plan, layers, drawing);
  draw_rooms(*plan, layers, drawing);
  draw_path(source, layers.path, drawing);
  draw_grid(layers.grid, layers.dimensions, drawing);
  draw_room_table(*plan, layers, drawing);
  drawing.title = fmt::format("{}: plan at {:g} m", source.name(), source.options().cut_m);
  summary.notes = notes_of(*plan);
  return drawing;
}

/// Drawing of a vertical cut: the cells, 2 cm wide, that contain points of the cloud near the cut.
core::Result<Drawing> section_drawing(MapSource& source, ExportSummary& summary) {
  constexpr double kHalfThick_m = 0.03;
  constexpr double kCell_m = 0.02;
  const std::vector<double>& line = source.options().section;
  if (line.size() != 4) return core::usage_error("--section: takes two places seen from above, x,y,x,y");

  const Eigen::Vector2d from(line[0], line[1]);
  const Eigen::Vector2d to(line[2], line[3]);
  const double length = (to - from).norm();
  if (length < kCell_m) return core::usage_error("--section: its two places are one");

  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());

  const Eigen::Vector2d along = (to - from) / length;
  const Eigen::Vector2d across(-along.y(), along.x());
  std::set<std::pair<long, long>> cells;  // by row, then column
  for (const cloud::Point& p : *(*cloud)->cloud) {
    const Eigen::Vector3d at = p.getVector3fMap().cast<double>() + (*cloud)->shift;
    const Eigen::Vector2d way = at.head<2>() - from;
    const double s = along.dot(way);
    if (s < 0.0 || s > length || std::abs(across.dot(way)) > kHalfThick_m) continue;
    cells.emplace(std::lround(std::floor(at.z() / kCell_m)), std::lround(std::floor(s / kCell_m)));
  }

  if (cells.empty()) {
    return core::input_error(
        fmt::format("{}: the section meets no point of the cloud", source.request().output.string()));
  }

  Drawing drawing;
  const std::size_t grid = drawing.add_layer({"grid", "#d0d0d0", 8, 0.1});
  const std::size_t section = drawing.add_layer({"section", "#000000", 7, 0.1});
  const std::size_t dimensions = drawing.add_layer({"dimensions", "#505050", 3, 0.13});

  for (auto cell = cells.begin(); cell != cells.end();) {  // neighbours in a row as one
    auto last = cell;
    auto next = std::next(cell);
    while (next != cells.end() && next->first == last->first && next->second == last->second + 1)
      last = next++;

    const double z0 = static_cast<double>(cell->first) * kCell_m;
    const double s0 = static_cast<double>(cell->second) * kCell_m;
    const double s1 = static_cast<double>(last->second + 1) * kCell_m;
    drawing.lines.push_back(
        {section, {{s0, z0}, {s1, z0}, {s1, z0 + kCell_m}, {s0, z0 + kCell_m}}, true, true});
    cell = next;
  }

  draw_grid(grid, dimensions, drawing);
  drawing.title = fmt::format("{}: section from {:g},{:g} to {:g},{:g}", source.name(), line[0], line[1],
                              line[2], line[3]);
  summary.notes.push_back(fmt::format("a section {:.2f} m long", length));
  return drawing;
}

core::Result<ExportSummary> write_plan_json(MapSource& source, const std::filesystem::path& output) {
  if (!source.options().section.empty())
    return core::usage_error("--section: is a drawing; write .svg, .pdf or .dxf");
  const auto plan = find_walls(source);
  if (!plan) return tl::unexpected(plan.error());
  ExportSummary summary;
  summary.notes = notes_of(*plan);
  summary.written = {output};
  const auto written = core::write_file(
      output, plan_json(*plan, source.frame_text(), source.floor_m(), source.options().cut_m));
  if (!written) return tl::unexpected(written.error());
  return summary;
}

core::Result<ExportSummary> write_plan(MapSource& source, const std::filesystem::path& output) {
  const auto reference = georeference_of(source.options(), source.log());
  if (!reference) return tl::unexpected(reference.error());

  const bool section = !source.options().section.empty();
  const std::string ending = core::ending_of(output);
  if (*reference && (ending != ".dxf" || section)) {
    return core::usage_error(
        fmt::format("{}: only a plan as .dxf is moved into world coordinates; leave --datum and "
                    "--epsg out",
                    output.string()));
  }

  ExportSummary summary;
  if (ending == ".json") return write_plan_json(source, output);
  auto drawing = section ? section_drawing(source, summary) : plan_drawing(source, summary);
  if (!drawing) return tl::unexpected(drawing.error());

  drawing->notes.push_back(section ? "x along the section, y up; metres" : source.frame_text());
  core::Result<void> written;
  if (ending == ".svg") {
    written = write_svg(output, *drawing);
  } else if (ending == ".pdf") {
    written = write_pdf(output, *drawing);
  } else if (*reference) {
    const Georeference& world = **reference;
    drawing->notes = {fmt::format("frame: {} (EPSG:{}); x east, y north, metres", world.name, world.epsg)};
    written = write_dxf(output, *drawing, world.linear().topLeftCorner<2, 2>(), world.origin.head<2>());

    if (written) written = write_georeference(output, world);
  } else {
    written = write_dxf(output, *drawing);
  }

  if (!written) return tl::unexpected(written.error());
  summary.written = {output};
  return summary;
}

}  // namespace

std::vector<std::pair<double, double>> solid_pieces(const WallLine& wall) {
  std::vector<WallOpening> openings = wall.openings;
  openings.insert(openings.end(), wall.gaps.begin(), wall.gaps.end());
  std::sort(openings.begin(), openings.end(),
            [](const WallOpening& a, const WallOpening& b) { return a.s0 < b.s0; });

  std::vector<std::pair<double, double>> pieces;
  double from = wall.s0;
  for (const WallOpening& opening : openings) {
    if (opening.s0 > from) pieces.emplace_back(from, opening.s0);
    from = std::max(from, opening.s1);
  }
  if (wall.s1 > from) pieces.emplace_back(from, wall.s1);
  return pieces;
}

Format plan_format() {
  return {
      "plan",
      {".svg", ".pdf", ".dxf", "plan.json"},
      {Content::kCloud},
      "",
      "Floor plan or section for architects",
      "Walls at `--cut` over the floor as lines, fitted to the wall planes that `plumbline evaluate "
      "cloud` finds and joined at corners, both sides of a wall where both were seen. What the cut passes "
      "over is left out: a half-height wall of which both faces were seen is drawn where it is higher than "
      "the cut. Where the cut passes through a window, or over a lower part, the wall is open, with a thin "
      "line: cameras looked through, or a hole over a level sill lies between wall, and nothing at the wall "
      "hides it, as at a pane (or a dark screen on the wall). Furniture is a thin outline of what was seen "
      "0.15 to 1.8 m over the floor. Doors are where cameras "
      "looked through a "
      "wall (without `map.db`: what lies "
      "below a lintel); closed doors are wall. Walls over 1 m have their length, rooms number and area; "
      "a table lists perimeter and height. Rooms close over doors and over gaps that the wall's other side, "
      "the end of "
      "a wall or less than 0.6 m explain, dashed; a room that was seen in part has a dashed limit and \"at "
      "least\" "
      "([plans.md](../method/plans.md)). `plan.json` holds rooms, openings and walls as numbers; a grid of "
      "metres, a scale bar, the paths. SVG and PDF are in a round scale, which is written in the "
      "file; DXF (R2000) is in metres with the layers grid, furniture, rooms, path, walls, windows, doors, "
      "dimensions. "
      "Texts are read from below or from the right, also after `--datum`. `--section x,y,x,y` draws a "
      "vertical cut along that line instead.",
      {"cut", "section", "voxel", "datum", "epsg", "origin"},
      &write_plan};
}

}  // namespace plumbline::exports
