// SPDX-License-Identifier: BSD-3-Clause
// Tells walls from tall furniture and door leaves.
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "wall_steps.hpp"

namespace plumbline::plans {
namespace {

/// True if two sides lie on one line, one behind the other. The longer one tells where the line goes.
bool in_line(const WallLine& a, const WallLine& b) {
  constexpr double kSameLine_m = 0.03;
  const auto& [line, other] = a.length() < b.length() ? std::tie(b, a) : std::tie(a, b);
  return line.normal.dot(other.normal) > 0.998 &&
         std::abs(line.normal.dot(other.at(0.5 * (other.s0 + other.s1))) - line.offset_m) < kSameLine_m;
}

/// Share of a side's columns, of those that reach at least as high as tall furniture, over whose upper edge
/// cameras looked. No ray passes over a wall's edge, however little of its upper part was seen.
double looked_over(const WallLine& side, const WallRaster& raster) {
  constexpr double kTop_m = 1.5;
  constexpr double kGap_m = 0.1;
  constexpr double kAbove_m = 0.6;
  const double least_m = std::min(kTop_m, side.top_m - kGap_m);  // less where a part of a wall was seen
  int columns = 0, over = 0;
  for (int c = raster.column_of(side.s0); c <= raster.column_of(side.s1); ++c) {
    const double top = raster.top(c);
    if (top < least_m) continue;
    ++columns;
    if (raster.crossed(c, top + kGap_m, top + kAbove_m) > 0.0) ++over;
  }
  return columns > 0 ? static_cast<double>(over) / columns : 0.0;
}

bool is_mostly_high(const WallLine& side) { return side.high > 0.5; }

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

/// True if a short side is neither parallel nor square to any long one, nor one face of a wall: a curtain, or
/// a leaf that is ajar.
bool is_askew(const WallLine& side, const std::vector<WallLine>& walls) {
  constexpr double kShort_m = 0.6;
  constexpr double kLong_m = 1.5;
  constexpr double kTurn = 0.07;  // sine of 4 degrees
  return side.length() < kShort_m && std::none_of(walls.begin(), walls.end(), [&](const WallLine& other) {
           if (are_faces(side, other)) return true;
           const double parallel = std::abs(side.normal.dot(other.normal));
           const double square = std::abs(side.normal.dot(other.along()));
           return other.length() >= kLong_m && std::min(parallel, square) < kTurn;
         });
}

constexpr double kShortestLeaf_m = 0.4;  ///< of what was seen of it
constexpr double kWidestLeaf_m = 1.3;    ///< as in find_leaves()

/// True if an end of a side is at a jamb of an opening of the wall that is about as wide as the side is long.
bool hangs_at(const WallLine& side, double end, const WallLine& wall, const WallRaster& raster,
              const Cut& cut) {
  constexpr double kHinge_m = 0.15, kOff_m = 0.3;
  constexpr double kAlike_m = 0.2;    // hinge and edge of a leaf may be hidden
  constexpr double kLeastTurn = 0.3;  // sine of 17 degrees, the smallest angle of find_leaves()

  // The place where the side's line meets the wall's
  const double turn = wall.normal.dot(side.along());
  if (std::abs(turn) < kLeastTurn) return false;
  const double off = (wall.offset_m - wall.normal.dot(side.at(end))) / turn;
  const double s = wall.along().dot(side.at(end + off));
  if (std::abs(off) > kOff_m || s < wall.s0 - kWidestLeaf_m || s > wall.s1 + kWidestLeaf_m) return false;

  // An opening that begins or ends there
  const auto openings = openings_between(raster, s - 2.0 * kWidestLeaf_m, s + 2.0 * kWidestLeaf_m, cut);
  return std::any_of(openings.begin(), openings.end(), [&](const WallOpening& opening) {
    return std::min(std::abs(opening.s0 - s), std::abs(opening.s1 - s)) < kHinge_m &&
           std::abs(opening.s1 - opening.s0 - side.length()) < kAlike_m;
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

/// Drops sides that cameras saw over, and sides that stand before a wall.
void drop_furniture(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters, bool rays_known) {
  constexpr double kLongest_m = 3.0;              // longest furniture
  constexpr double kLeastHigh = 0.2;              // share of a side that must be higher than furniture
  constexpr double kOver = 0.1, kOverHigh = 0.3;  // walls: up to 0.03 (docs/notes/2026-11-29-plans.md)
  const std::vector<WallLine> all = walls;
  keep_sides(walls, rasters, [&](std::size_t i) {
    // Two low faces of a thin wall are a wall
    const bool high = walls[i].high >= kLeastHigh || walls[i].low ||
                      std::any_of(all.begin(), all.end(), [&](const WallLine& other) {
                        return other.high < kLeastHigh && are_faces(all[i], other);
                      });
    if (rays_known ? looked_over(walls[i], rasters[i]) > (high ? kOverHigh : kOver) : !high) return false;
    return walls[i].length() >= kLongest_m || !stands_before_wall(walls[i], walls);
  });
}

/// Drops sides that hang at a jamb like a leaf and have no other face behind them as walls have.
void drop_leaves(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters, const Cut& cut) {
  if (!cut.rays_known) return;
  std::vector<bool> leaf(walls.size(), false);
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const WallLine& side = walls[i];
    if (side.length() < kShortestLeaf_m || side.length() > kWidestLeaf_m) continue;
    if (std::any_of(walls.begin(), walls.end(), [&](const auto& other) { return are_faces(side, other); }))
      continue;
    for (std::size_t w = 0; w < walls.size() && !leaf[i]; ++w)
      leaf[i] = w != i && (hangs_at(side, side.s0, walls[w], rasters[w], cut) ||
                           hangs_at(side, side.s1, walls[w], rasters[w], cut));
  }
  keep_sides(walls, rasters, [&](std::size_t i) { return !leaf[i]; });
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

    // Pieces of one wall support each other where furniture does not reach, whatever their direction
    const bool in_pieces =
        is_mostly_high(walls[i]) && std::any_of(walls.begin(), walls.end(), [&](const auto& other) {
          return &other != &walls[i] && is_mostly_high(other) && in_line(walls[i], other);
        });
    if (in_pieces) return true;
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
