// SPDX-License-Identifier: BSD-3-Clause
#include "room_cells.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace plumbline::plans {
namespace {

constexpr double kThinnestCell_m = 0.015;  ///< cells are wider

double cross_of(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// A line that cuts the cells that it passes through between two places of it.
struct CuttingLine {
  Eigen::Vector2d from;
  Eigen::Vector2d along;  ///< unit
  double length = 0.0;
};

/// The part of a cell on the left of a line.
PlanOutline left_of(const PlanOutline& outline, const Eigen::Vector2d& from, const Eigen::Vector2d& along) {
  PlanOutline left;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d& a = outline[i];
    const Eigen::Vector2d& b = outline[(i + 1) % outline.size()];
    const double da = cross_of(along, a - from), db = cross_of(along, b - from);
    if (da >= 0.0) left.push_back(a);
    if ((da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0)) left.emplace_back(a + da / (da - db) * (b - a));
  }
  return left;
}

/// True if a line passes through a cell, both parts are wide enough, and it does so between the line's ends.
bool cuts(const CuttingLine& line, const PlanOutline& outline) {
  double most = 0.0, least = 0.0, s0 = 1e300, s1 = -1e300;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d& a = outline[i];
    const Eigen::Vector2d& b = outline[(i + 1) % outline.size()];
    const double da = cross_of(line.along, a - line.from), db = cross_of(line.along, b - line.from);
    most = std::max(most, da);
    least = std::min(least, da);
    if ((da < 0.0) == (db < 0.0)) continue;
    const double s = line.along.dot(a + da / (da - db) * (b - a) - line.from);
    s0 = std::min(s0, s);
    s1 = std::max(s1, s);
  }
  return most > kThinnestCell_m && least < -kThinnestCell_m &&
         std::min(s1, line.length) - std::max(s0, 0.0) > 0.01;
}

/// Splits the cells that a line passes through.
void cut_cells(const CuttingLine& line, std::vector<PlanOutline>& cells) {
  const std::size_t count = cells.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (!cuts(line, cells[i])) continue;
    cells.push_back(left_of(cells[i], line.from, -line.along));
    cells[i] = left_of(cells[i], line.from, line.along);
  }
}

/// Lines of walls, long ones first, then the sides of openings.
std::vector<CuttingLine> cutting_lines(const std::vector<WallLine>& walls,
                                       const std::vector<PlanOutline>& openings) {
  constexpr double kBeyond_m = 2.5;  // that corners may be hidden
  constexpr double kShort_m = 0.6;   // of which the direction is not known well
  std::vector<CuttingLine> lines;
  std::vector<WallLine> sorted = walls;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const WallLine& a, const WallLine& b) { return a.length() > b.length(); });

  // Walls are extended, for corners may be hidden
  for (const WallLine& wall : sorted) {
    const double beyond_m = wall.length() < kShort_m ? 0.3 : std::min(kBeyond_m, 0.3 + 1.5 * wall.length());
    lines.push_back({wall.at(wall.s0 - beyond_m), wall.along(), wall.length() + 2.0 * beyond_m});
  }

  // Sides of openings separate them from rooms
  for (const PlanOutline& opening : openings) {
    for (std::size_t i = 0; i < opening.size(); ++i) {
      const Eigen::Vector2d side = opening[(i + 1) % opening.size()] - opening[i];
      if (side.norm() > kThinnestCell_m) lines.push_back({opening[i], side.normalized(), side.norm()});
    }
  }

  return lines;
}

/// Halves cells through which the limit of what was seen passes, across their longest side.
void refine_cells(const FreeSpace& space, std::vector<PlanOutline>& cells) {
  constexpr double kLeast = 0.1;
  constexpr double kLongest_m = 0.3;
  for (std::size_t i = 0; i < cells.size();) {
    const PlanOutline& cell = cells[i];
    Eigen::Vector2d along = Eigen::Vector2d::UnitX();
    double longest = 0.0;

    // The direction of the longest side
    for (std::size_t k = 0; k < cell.size(); ++k) {
      const Eigen::Vector2d side = cell[(k + 1) % cell.size()] - cell[k];
      if (side.norm() <= longest) continue;
      longest = side.norm();
      along = side / longest;
    }
    double s0 = 1e300, s1 = -1e300;

    for (const Eigen::Vector2d& p : cell) {
      s0 = std::min(s0, along.dot(p));
      s1 = std::max(s1, along.dot(p));
    }
    const double free = s1 - s0 > kLongest_m ? space.share(cell) : 0.0;

    // Cells that are clearly free, or clearly not, stay whole
    if (free < kLeast || free > 1.0 - kLeast) {
      ++i;
      continue;
    }

    // Cut across the middle
    const Eigen::Vector2d middle = 0.5 * (s0 + s1) * along;
    const Eigen::Vector2d across(-along.y(), along.x());
    PlanOutline rest = left_of(cell, middle, -across);

    cells[i] = left_of(cell, middle, across);
    cells.push_back(std::move(rest));
  }
}

Eigen::Vector2d middle_of(const PlanOutline& outline) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : outline) sum += p;
  return sum / static_cast<double>(outline.size());
}

}  // namespace

double area_of(const PlanOutline& outline) {
  double twice = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i)
    twice += cross_of(outline[i], outline[(i + 1) % outline.size()]);
  return 0.5 * twice;
}

/// True if a ray from the place crosses the outline an odd number of times.
bool is_inside(const PlanOutline& outline, const Eigen::Vector2d& place) {
  bool in = false;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d& a = outline[i];
    const Eigen::Vector2d& b = outline[(i + 1) % outline.size()];
    if ((a.y() > place.y()) == (b.y() > place.y())) continue;
    if (place.x() < a.x() + (place.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) in = !in;
  }
  return in;
}

/// Outlines of openings through the thickness of the wall, counter-clockwise.
std::vector<PlanOutline> openings_of(const std::vector<WallDoor>& doors) {
  constexpr double kAssumed_m = 0.1;  // depth of an opening of which one side was seen
  std::vector<PlanOutline> openings;
  for (const WallDoor& door : doors) {
    PlanOutline corners{door.jambs[0], door.jambs[1], door.far_jambs[1], door.far_jambs[0]};
    const Eigen::Vector2d along = (door.jambs[1] - door.jambs[0]).normalized();
    if ((door.jambs[0] - door.far_jambs[0]).norm() < kThinnestCell_m) {  // behind: the left of the jambs' way
      corners[2] += kAssumed_m * Eigen::Vector2d(-along.y(), along.x());
      corners[3] += kAssumed_m * Eigen::Vector2d(-along.y(), along.x());
    }
    if (area_of(corners) < 0.0) std::reverse(corners.begin(), corners.end());
    openings.push_back(std::move(corners));
  }
  return openings;
}

/// Cells that the walls' lines cut the plan into, with their shares of free space.
std::vector<RoomCell> cells_of(const Eigen::AlignedBox2d& box, const std::vector<WallLine>& walls,
                               const std::vector<PlanOutline>& openings, const FreeSpace& space) {
  std::vector<PlanOutline> outlines{
      {box.min(), {box.max().x(), box.min().y()}, box.max(), {box.min().x(), box.max().y()}}};
  for (const CuttingLine& line : cutting_lines(walls, openings)) cut_cells(line, outlines);
  refine_cells(space, outlines);

  // Facts that later decide on inside and outside
  std::vector<RoomCell> cells;
  for (PlanOutline& outline : outlines) {
    const Eigen::Vector2d middle = middle_of(outline);
    RoomCell cell;
    cell.area_m2 = area_of(outline);
    cell.free = space.share(outline);
    cell.opening = std::any_of(openings.begin(), openings.end(),
                               [&](const PlanOutline& opening) { return is_inside(opening, middle); });

    cell.outline = std::move(outline);
    cells.push_back(std::move(cell));
  }

  return cells;
}

/// Common borders of neighbouring cells.
std::vector<CellBorder> borders_of(const std::vector<RoomCell>& cells) {
  constexpr double kSame_m = 1e-6;

  // Boxes exclude most pairs
  std::vector<Eigen::AlignedBox2d> boxes(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    for (const Eigen::Vector2d& p : cells[i].outline) boxes[i].extend(p);
    boxes[i] = {boxes[i].min().array() - kSame_m, boxes[i].max().array() + kSame_m};
  }

  // Sides of neighbours run in opposite directions
  std::vector<CellBorder> borders;
  const auto add_common = [&](std::size_t a, std::size_t b) {
    const PlanOutline& of_a = cells[a].outline;
    const PlanOutline& of_b = cells[b].outline;
    for (std::size_t i = 0; i < of_a.size(); ++i) {
      const Eigen::Vector2d side = of_a[(i + 1) % of_a.size()] - of_a[i];
      const double length = side.norm();
      if (length < kSame_m) continue;
      const Eigen::Vector2d along = side / length;

      // Sides of the other cell on the same line
      for (std::size_t j = 0; j < of_b.size(); ++j) {
        const Eigen::Vector2d p = of_b[(j + 1) % of_b.size()] - of_a[i];  // the other cell goes backwards
        const Eigen::Vector2d q = of_b[j] - of_a[i];
        if (std::abs(cross_of(along, p)) > kSame_m || std::abs(cross_of(along, q)) > kSame_m) continue;
        const double s0 = std::max(0.0, along.dot(p)), s1 = std::min(length, along.dot(q));
        if (s1 - s0 > 10.0 * kSame_m) borders.push_back({a, b, {of_a[i] + s0 * along, of_a[i] + s1 * along}});
      }
    }
  };

  // All pairs whose boxes meet
  for (std::size_t a = 0; a < cells.size(); ++a) {
    for (std::size_t b = a + 1; b < cells.size(); ++b) {
      if (boxes[a].intersects(boxes[b])) add_common(a, b);
    }
  }

  return borders;
}

/// Parts of a segment that walls or openings run along, as shares of it.
std::vector<WallOpening> walled_parts(const PlanSegment& segment, const std::vector<WallLine>& walls,
                                      const std::vector<PlanOutline>& openings, double off_m) {
  constexpr double kTurn = 0.05;
  const double length = (segment[1] - segment[0]).norm();
  const Eigen::Vector2d along = (segment[1] - segment[0]) / length;
  std::vector<WallOpening> parts;

  // A side counts if it is parallel and near
  const auto add = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    const Eigen::Vector2d side = (to - from).normalized();
    const Eigen::Vector2d middle = 0.5 * (segment[0] + segment[1]) - from;

    if (std::abs(cross_of(side, along)) > kTurn || std::abs(cross_of(side, middle)) > off_m) return;
    double s0 = along.dot(from - segment[0]) / length, s1 = along.dot(to - segment[0]) / length;
    if (s0 > s1) std::swap(s0, s1);
    if (s1 > 0.0 && s0 < 1.0) parts.push_back({std::max(0.0, s0), std::min(1.0, s1)});
  };

  // Walls, and the sides of openings
  for (const WallLine& wall : walls) add(wall.at(wall.s0), wall.at(wall.s1));
  for (const PlanOutline& opening : openings) {
    for (std::size_t i = 0; i < opening.size(); ++i) {
      const Eigen::Vector2d& next = opening[(i + 1) % opening.size()];
      if ((next - opening[i]).norm() > kThinnestCell_m) add(opening[i], next);
    }
  }

  // Parts that touch are joined
  std::sort(parts.begin(), parts.end(),
            [](const WallOpening& a, const WallOpening& b) { return a.s0 < b.s0; });
  std::vector<WallOpening> joined;

  for (const WallOpening& part : parts) {
    if (!joined.empty() && part.s0 <= joined.back().s1 + 0.005 / length) {
      joined.back().s1 = std::max(joined.back().s1, part.s1);
    } else {
      joined.push_back(part);
    }
  }

  return joined;
}

}  // namespace plumbline::plans
