// SPDX-License-Identifier: BSD-3-Clause
// Tells walls from tall furniture and door leaves.
#include <algorithm>
#include <cmath>
#include <utility>

#include "wall_steps.hpp"

namespace plumbline::plans {
namespace {

/// True if two sides lie on one line, one behind the other.
bool in_line(const WallLine& a, const WallLine& b) {
  constexpr double kSameLine_m = 0.03;
  return a.normal.dot(b.normal) > 0.998 &&
         std::abs(a.normal.dot(b.at(0.5 * (b.s0 + b.s1))) - a.offset_m) < kSameLine_m;
}

/// True if cameras looked over it, where its upper edge was seen at all.
bool is_looked_over(const WallLine& side, const WallRaster& raster) {
  constexpr double kLeastTop_m = 1.5;
  constexpr double kGap_m = 0.1;
  constexpr double kAbove_m = 0.5;
  constexpr double kCrossed = 0.3;
  constexpr double kShare = 0.3;
  int columns = 0, over = 0;
  for (int c = raster.column_of(side.s0); c <= raster.column_of(side.s1); ++c) {
    const double top = raster.top(c);
    if (top < kLeastTop_m) continue;
    ++columns;
    if (raster.crossed(c, top + kGap_m, top + kAbove_m) >= kCrossed) ++over;
  }
  return over > kShare * columns;
}

/// True if walls that face the same way run a little behind the side: along most of it, so that they were
/// seen over it; one that is longer; or two parts of one, to the left and to the right, of which the side
/// hides the middle.
bool stands_before_wall(const WallLine& side, const std::vector<WallLine>& walls) {
  constexpr double kNearest_m = 0.12;
  constexpr double kFarthest_m = 0.75;
  constexpr double kReach_m = 0.4;
  constexpr double kSeenBehind = 0.6;  // share of the side
  bool before = false, behind = false;
  double seen_m = 0.0;

  // Walls that face the same way, further back
  for (const WallLine& wall : walls) {
    if (wall.normal.dot(side.normal) < 0.998) continue;
    const double s0 = wall.along().dot(side.at(side.s0));
    const double s1 = wall.along().dot(side.at(side.s1));
    const double distance = wall.normal.dot(side.at(0.5 * (side.s0 + side.s1))) - wall.offset_m;

    // One wall that reaches beyond both ends
    if (distance < kNearest_m || distance > kFarthest_m) continue;
    if (wall.s0 - kReach_m < s0 && wall.s1 + kReach_m > s1 && wall.length() > side.length()) return true;
    seen_m += std::max(0.0, std::min(wall.s1, s1) - std::max(wall.s0, s0));
    before = before || (wall.s0 < s0 && wall.s1 > s0 - kReach_m);
    behind = behind || (wall.s1 > s1 && wall.s0 < s1 + kReach_m);
  }

  // Seen left and right, or over the side
  return (before && behind) || seen_m > kSeenBehind * side.length();
}

/// Keeps the sides for which keep(number) is true.
template <typename Keep>
void keep_sides(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters, const Keep& keep) {
  std::vector<WallLine> kept;
  std::vector<WallRaster> kept_rasters;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    if (!keep(i)) continue;
    kept.push_back(walls[i]);
    kept_rasters.push_back(std::move(rasters[i]));
  }
  walls = std::move(kept);
  rasters = std::move(kept_rasters);
}

/// True if two sides are the faces of one thin wall: opposite each other for most of their length.
bool are_faces(const WallLine& a, const WallLine& b) {
  constexpr double kThinnest_m = 0.06;  // thicker than a door's leaf
  constexpr double kThickest_m = 0.3;
  constexpr double kShare = 0.6;
  if (a.normal.dot(b.normal) > -0.99) return false;
  const double behind = a.offset_m - a.normal.dot(b.at(0.5 * (b.s0 + b.s1)));
  if (behind < kThinnest_m || behind > kThickest_m) return false;
  const double first = a.along().dot(b.at(b.s1));  // the other face runs backwards
  const double last = a.along().dot(b.at(b.s0));
  return std::min(a.s1, last) - std::max(a.s0, first) > kShare * std::max(a.length(), b.length());
}

/// True if a short side is neither parallel nor square to any long one: a curtain, or a leaf that is ajar.
bool is_askew(const WallLine& side, const std::vector<WallLine>& walls) {
  constexpr double kShort_m = 0.6;
  constexpr double kLong_m = 1.5;
  constexpr double kTurn = 0.07;  // sine of 4 degrees
  return side.length() < kShort_m && std::none_of(walls.begin(), walls.end(), [&](const WallLine& other) {
           const double parallel = std::abs(side.normal.dot(other.normal));
           const double square = std::abs(side.normal.dot(other.along()));
           return other.length() >= kLong_m && std::min(parallel, square) < kTurn;
         });
}

}  // namespace

/// Drops low sides that are not one face of a low wall.
void drop_low_furniture(std::vector<WallLine>& walls) {
  const std::vector<WallLine> all = walls;
  const auto is_furniture = [&](const WallLine& side) {
    return side.low && std::none_of(all.begin(), all.end(), [&](const WallLine& other) {
             return other.low && are_faces(side, other);
           });
  };
  walls.erase(std::remove_if(walls.begin(), walls.end(), is_furniture), walls.end());
}

/// Drops low sides that cameras saw over, and sides that stand before a wall.
void drop_furniture(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters, bool rays_known) {
  constexpr double kLongest_m = 3.0;  // longest furniture
  constexpr double kLeastHigh = 0.2;  // share of a side that must be higher than furniture
  const std::vector<WallLine> all = walls;
  keep_sides(walls, rasters, [&](std::size_t i) {
    // Two low faces of a thin wall are a wall
    const bool high = walls[i].high >= kLeastHigh || walls[i].low ||
                      std::any_of(all.begin(), all.end(), [&](const WallLine& other) {
                        return other.high < kLeastHigh && are_faces(all[i], other);
                      });
    if (!high && (!rays_known || is_looked_over(walls[i], rasters[i]))) return false;
    return walls[i].length() >= kLongest_m || !stands_before_wall(walls[i], walls);
  });
}

/// Drops short sides that nothing connects to a wall.
void drop_loose_sides(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters) {
  constexpr double kShort_m = 1.5;
  constexpr double kStub_m = 0.6;
  constexpr double kSquare = 0.05;  // cosine: within 3 degrees
  std::vector<WallLine> joined = walls;
  join_corners(joined);

  keep_sides(walls, rasters, [&](std::size_t i) {
    // Long sides need no support
    if (walls[i].length() >= kShort_m) return true;
    if (is_askew(walls[i], walls)) return false;

    // Corners at both ends support a side
    const bool met = joined[i].corner[0] >= 0 && joined[i].corner[1] >= 0;
    if (met && walls[i].length() >= kStub_m) return true;

    // A long wall at a right angle supports it
    const bool square = std::any_of(joined[i].corner.begin(), joined[i].corner.end(), [&](int other) {
      return other >= 0 &&
             std::abs(joined[i].normal.dot(joined[static_cast<std::size_t>(other)].normal)) < kSquare &&
             joined[static_cast<std::size_t>(other)].length() >= kShort_m;
    });
    if (square) return true;

    // A wall in line supports it
    return std::any_of(walls.begin(), walls.end(), [&](const WallLine& other) {
      return &other != &walls[i] && other.length() >= 0.5 * kShort_m && in_line(walls[i], other);
    });
  });
}

}  // namespace plumbline::plans
