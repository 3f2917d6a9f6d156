// SPDX-License-Identifier: BSD-3-Clause
// Parts of walls that the cut passes over or through.
#include <algorithm>
#include <cmath>
#include <utility>

#include "plumbline/core/numbers.hpp"
#include "wall_steps.hpp"

namespace plumbline::plans {
namespace {

constexpr double kHalfBand_m = 0.1;  ///< of the heights that count as at the cut

/// Mean over the columns around one, which evens out where rays are sparse.
template <typename Share>
double mean_around(const WallRaster& raster, int column, const Share& share) {
  constexpr int kAround = 4;
  const int first = std::max(0, column - kAround);
  const int last = std::min(raster.columns() - 1, column + kAround);
  double sum = 0.0;
  for (int c = first; c <= last; ++c) sum += share(c);
  return sum / (last - first + 1);
}

bool is_bare(const WallRaster& raster, int column, const Cut& cut) {
  constexpr double kMostSurface = 0.25;
  return raster.seen(column, cut.at_m - kHalfBand_m, cut.at_m + kHalfBand_m) <= kMostSurface;
}

/// True if a column has no surface at the cut, and cameras looked through it there.
bool is_crossed(const WallRaster& raster, int column, const Cut& cut) {
  constexpr double kLeastCrossed = 0.15;
  if (!is_bare(raster, column, cut)) return false;
  const double low = cut.at_m - kHalfBand_m;
  const double high = cut.at_m + kHalfBand_m;
  const double crossed = mean_around(raster, column, [&](int c) { return raster.crossed(c, low, high); });
  const double hidden = mean_around(raster, column, [&](int c) { return raster.hidden(c, low, high); });
  return crossed >= kLeastCrossed && crossed > hidden;
}

/// Height of the wall below the cut, over the floor; 0: nothing of it was seen.
double sill_of(const WallRaster& raster, int column, const Cut& cut) {
  return raster.top(column, cut.at_m - kHalfBand_m);
}

/// True if columns without surface at the cut are a window: a hole over a level sill, which nothing that
/// stands at the wall hides. Where cameras did not look as high as the cut, wall is seen up to little below.
bool is_window(const WallRaster& raster, int first, int last, const Cut& cut) {
  constexpr double kLeastDrop_m = 0.25;
  constexpr double kLevel_m = 0.06;
  constexpr double kLeastLevel = 0.8;
  constexpr double kMostHidden = 0.1;
  std::vector<double> sills;
  double hidden = 0.0;
  for (int c = first; c <= last; ++c) {
    sills.push_back(sill_of(raster, c, cut));
    hidden += raster.hidden(c, cut.at_m - kHalfBand_m, cut.at_m + kHalfBand_m);
  }

  const double sill = core::median(sills);
  const auto level = std::count_if(sills.begin(), sills.end(),
                                   [&](double height) { return std::abs(height - sill) < kLevel_m; });
  const auto columns = static_cast<double>(sills.size());
  return sill <= cut.at_m - kLeastDrop_m && static_cast<double>(level) >= kLeastLevel * columns &&
         hidden <= kMostHidden * columns;
}

}  // namespace

/// Gaps at the height of the cut: windows, and parts that cameras saw through.
std::vector<WallOpening> gaps_between(const WallRaster& raster, double s0, double s1, const Cut& cut) {
  constexpr int kBridge = 5;  // columns with the bars of a window
  constexpr int kBeside = 3;  // columns of wall on both sides of a window
  constexpr double kNarrowest_m = 0.3;
  constexpr double kLowestSill_m = 0.25;
  const int begin = raster.column_of(s0);
  const int end = raster.column_of(s1);

  // Runs of columns without surface at the cut
  std::vector<std::pair<int, int>> runs;
  for (int c = begin; c <= end; ++c) {
    const bool over_sill = is_bare(raster, c, cut) && sill_of(raster, c, cut) > kLowestSill_m;
    if (!over_sill && !is_crossed(raster, c, cut)) continue;

    if (!runs.empty() && c - runs.back().second <= kBridge) {
      runs.back().second = c;
    } else {
      runs.emplace_back(c, c);
    }
  }

  // Narrow runs are noise
  std::vector<WallOpening> gaps;
  for (const auto& [a, b] : runs) {
    const WallOpening gap{std::max(s0, raster.start_of(a)), std::min(s1, raster.start_of(b + 1))};
    if (gap.s1 - gap.s0 < kNarrowest_m) continue;

    // Mostly seen through, or over a level sill
    int crossed = 0;
    for (int c = a; c <= b; ++c) crossed += is_crossed(raster, c, cut) ? 1 : 0;
    const bool beside = a >= begin + kBeside && b <= end - kBeside;
    if (2 * crossed >= b - a + 1 || (beside && is_window(raster, a, b, cut))) gaps.push_back(gap);
  }

  return gaps;
}

/// Finds the gaps of every side; sides that the cut mostly passes over are dropped.
void cut_sides(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters, const Cut& cut) {
  constexpr double kMostCrossed = 0.7;  // share of a side that the cut passes over or below
  for (std::size_t i = 0; i < walls.size();) {
    const int first = rasters[i].column_of(walls[i].s0);
    const int last = rasters[i].column_of(walls[i].s1);
    int crossed = 0;
    for (int c = first; c <= last; ++c) crossed += is_crossed(rasters[i], c, cut) ? 1 : 0;
    if (crossed <= kMostCrossed * (last - first + 1)) {
      walls[i].gaps = gaps_between(rasters[i], walls[i].s0, walls[i].s1, cut);
      ++i;
      continue;
    }
    walls.erase(walls.begin() + static_cast<std::ptrdiff_t>(i));
    rasters.erase(rasters.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

/// Drops gaps that cover most of a door, for they are that door.
void drop_gaps_at_doors(WallLine& wall) {
  const auto is_door = [&](const WallOpening& gap) {
    return std::any_of(wall.openings.begin(), wall.openings.end(), [&](const WallOpening& door) {
      return std::min(gap.s1, door.s1) - std::max(gap.s0, door.s0) > 0.5 * (door.s1 - door.s0);
    });
  };
  wall.gaps.erase(std::remove_if(wall.gaps.begin(), wall.gaps.end(), is_door), wall.gaps.end());
}

void take_back_doors(std::vector<WallDoor>& doors, std::vector<WallLine>& walls) {
  constexpr double kSquare = 0.05, kOff_m = 0.04;
  const auto is_none = [](const WallDoor& door) {
    return door.kind == OpeningKind::kWindow ||
           (door.width_m > kWidestDoor_m && !(door.jamb_seen[0] && door.jamb_seen[1]));
  };

  // Openings of the faces become gaps
  for (const WallDoor& door : doors) {
    if (!is_none(door)) continue;
    const Eigen::Vector2d way = (door.jambs[1] - door.jambs[0]).normalized();
    for (WallLine& wall : walls) {
      const bool on_near = std::abs(wall.normal.dot(door.jambs[0]) - wall.offset_m) < kOff_m;
      const bool on_far = std::abs(wall.normal.dot(door.far_jambs[0]) - wall.offset_m) < kOff_m;
      if (std::abs(wall.normal.dot(way)) > kSquare || (!on_near && !on_far)) continue;

      // The part of the face between the jambs
      const auto [s0, s1] = std::minmax({wall.along().dot(door.jambs[0]), wall.along().dot(door.jambs[1])});
      const auto first_of = std::stable_partition(
          wall.openings.begin(), wall.openings.end(), [&, low = s0, high = s1](const WallOpening& part) {
            return std::min(part.s1, high) - std::max(part.s0, low) <= 0.5 * (part.s1 - part.s0);
          });

      for (auto part = first_of; part != wall.openings.end(); ++part)
        part->to_floor = door.kind != OpeningKind::kWindow;
      wall.gaps.insert(wall.gaps.end(), first_of, wall.openings.end());
      wall.openings.erase(first_of, wall.openings.end());
      std::sort(wall.gaps.begin(), wall.gaps.end(),
                [](const WallOpening& a, const WallOpening& b) { return a.s0 < b.s0; });
    }
  }
  doors.erase(std::remove_if(doors.begin(), doors.end(), is_none), doors.end());
}

}  // namespace plumbline::plans
