// SPDX-License-Identifier: BSD-3-Clause
// Rooms: chains of walls whose corners meet all round.
#include <algorithm>
#include <cmath>
#include <set>

#include "room_cells.hpp"

namespace plumbline::plans {
namespace {

struct Loop {
  std::vector<Eigen::Vector2d> outline;
  double area_m2 = 0.0;  ///< positive: counter-clockwise
  bool inwards = false;  ///< its walls are seen from inside
};

/// From one end of a wall to the other, round the corner, until the first wall comes again; empty: it never
/// does.
std::vector<Eigen::Vector2d> chain_from(const std::vector<WallLine>& walls, std::size_t first,
                                        std::set<std::size_t>& used, double& facing) {
  std::vector<Eigen::Vector2d> outline;
  std::size_t wall = first;
  int from = 0;
  facing = 0.0;

  do {
    if (!used.insert(wall).second) return {};
    const WallLine& w = walls[wall];
    const int to = 1 - from;
    outline.push_back(w.at(from == 0 ? w.s0 : w.s1));

    // Along its direction a wall has its normal on the right.
    facing += (from == 0 ? 1.0 : -1.0) * w.length();
    const int next = w.corner[static_cast<std::size_t>(to)];
    const int next_end = w.corner_end[static_cast<std::size_t>(to)];
    if (next < 0 || next_end == 2) return {};
    wall = static_cast<std::size_t>(next);
    from = next_end;
  } while (wall != first);
  return from == 0 ? outline : std::vector<Eigen::Vector2d>{};
}

/// The middle of the widest piece inside of the lines at eighths of the outline's height.
Eigen::Vector2d label_place(const std::vector<Eigen::Vector2d>& outline, const std::vector<Loop>& loops) {
  // Height range of the outline
  Eigen::Vector2d low = outline.front(), high = outline.front();
  for (const Eigen::Vector2d& p : outline) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }

  // Lines at eighths of the height
  Eigen::Vector2d best = 0.5 * (low + high);
  double widest = -1.0;

  for (int k = 1; k < 8; ++k) {
    const double y = low.y() + k * (high.y() - low.y()) / 8.0;
    std::vector<double> crossings;
    const auto add = [&](const std::vector<Eigen::Vector2d>& ring) {
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Eigen::Vector2d& a = ring[i];
        const Eigen::Vector2d& b = ring[(i + 1) % ring.size()];
        if ((a.y() > y) != (b.y() > y))
          crossings.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
      }
    };

    // Rings of other loops are holes
    add(outline);
    for (const Loop& loop : loops) {
      if (!loop.inwards && is_inside(outline, loop.outline.front())) add(loop.outline);
    }

    // Between odd and even crossings it is inside
    std::sort(crossings.begin(), crossings.end());
    for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
      const double width = crossings[i + 1] - crossings[i] + (k == 4 ? 1e-6 : 0.0);
      if (width <= widest) continue;
      widest = width;
      best = {0.5 * (crossings[i] + crossings[i + 1]), y};
    }
  }

  return best;
}

}  // namespace

std::vector<WallRoom> rooms_of(const std::vector<WallLine>& walls) {
  constexpr double kSmallest_m2 = 0.5;
  std::vector<Loop> loops;
  std::set<std::size_t> done;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    if (done.count(i) > 0) continue;
    std::set<std::size_t> used;
    double facing = 0.0;
    Loop loop;
    loop.outline = chain_from(walls, i, used, facing);
    if (loop.outline.size() < 3) continue;

    done.insert(used.begin(), used.end());
    loop.area_m2 = area_of(loop.outline);

    // Walked counter-clockwise, a room lies on the left; normals on the left of the way look into it.
    loop.inwards = (loop.area_m2 > 0.0) == (facing < 0.0);
    if (loop.area_m2 < 0.0) std::reverse(loop.outline.begin(), loop.outline.end());
    loop.area_m2 = std::abs(loop.area_m2);
    loops.push_back(std::move(loop));
  }

  std::vector<WallRoom> rooms;

  for (const Loop& loop : loops) {
    if (!loop.inwards || loop.area_m2 < kSmallest_m2) continue;
    WallRoom room;
    room.outline = loop.outline;
    room.area_m2 = loop.area_m2;

    // Columns and free-standing walls take area away
    for (const Loop& hole : loops) {
      if (!hole.inwards && hole.area_m2 < loop.area_m2 && is_inside(loop.outline, hole.outline.front()))
        room.area_m2 -= hole.area_m2;
    }
    room.label = label_place(loop.outline, loops);
    rooms.push_back(std::move(room));
  }

  std::stable_sort(rooms.begin(), rooms.end(),
                   [](const WallRoom& a, const WallRoom& b) { return a.area_m2 > b.area_m2; });
  return rooms;
}

}  // namespace plumbline::plans
