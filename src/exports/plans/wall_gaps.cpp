// SPDX-License-Identifier: BSD-3-Clause
// Parts of walls that the cut passes over or through.
#include <algorithm>
#include <cmath>
#include <utility>

#include "plans/wall_steps.hpp"

namespace plumbline::exports {
namespace {

constexpr double kHalfBand_m = 0.1;  ///< of the heights that count as at the cut
constexpr double kMostSurface = 0.25;

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

/// True if a column has no surface at the cut, and cameras looked through it there.
bool is_crossed(const WallRaster& raster, int column, const Cut& cut) {
  constexpr double kLeastCrossed = 0.15;
  const double low = cut.at_m - kHalfBand_m;
  const double high = cut.at_m + kHalfBand_m;
  if (raster.seen(column, low, high) > kMostSurface) return false;
  const double crossed = mean_around(raster, column, [&](int c) { return raster.crossed(c, low, high); });
  const double hidden = mean_around(raster, column, [&](int c) { return raster.hidden(c, low, high); });
  return crossed >= kLeastCrossed && crossed > hidden;
}

/// True if a column has no surface at the cut, but above and below it: a pane, or something dark.
bool is_pane(const WallRaster& raster, int column, const Cut& cut) {
  constexpr double kFoot_m = 0.1;
  const double low = cut.at_m - kHalfBand_m;
  const double high = cut.at_m + kHalfBand_m;
  if (low <= kFoot_m || raster.seen(column, low, high) > kMostSurface) return false;
  return raster.seen(column, kFoot_m, low) > 0.0 && raster.seen(column, high, kHighest_m) > 0.0;
}

/// True if cameras looked through the columns, or nothing in front hid the wall there.
bool is_gap(const WallRaster& raster, int first, int last, const Cut& cut) {
  constexpr double kLeastCrossed = 0.5;  // share of the columns
  constexpr double kMostHidden = 0.05;   // the frame of a screen before the wall hides more
  constexpr double kAround_m = 0.3;
  double crossed = 0.0, hidden = 0.0;
  for (int c = first; c <= last; ++c) {
    crossed += is_crossed(raster, c, cut) ? 1.0 : 0.0;
    hidden += raster.hidden(c, std::max(0.0, cut.at_m - kAround_m), cut.at_m + kAround_m);
  }
  return crossed >= kLeastCrossed * (last - first + 1) || hidden <= kMostHidden * (last - first + 1);
}

}  // namespace

std::vector<WallOpening> gaps_between(const WallRaster& raster, double s0, double s1, const Cut& cut) {
  constexpr int kBridge = 5;  // columns with the bars of a window
  constexpr double kNarrowest_m = 0.3;
  std::vector<std::pair<int, int>> runs;
  for (int c = raster.column_of(s0); c <= raster.column_of(s1); ++c) {
    if (!is_crossed(raster, c, cut) && !is_pane(raster, c, cut)) continue;
    if (!runs.empty() && c - runs.back().second <= kBridge) {
      runs.back().second = c;
    } else {
      runs.emplace_back(c, c);
    }
  }

  std::vector<WallOpening> gaps;
  for (const auto& [a, b] : runs) {
    const WallOpening gap{std::max(s0, raster.start_of(a)), std::min(s1, raster.start_of(b + 1))};
    if (gap.s1 - gap.s0 >= kNarrowest_m && is_gap(raster, a, b, cut)) gaps.push_back(gap);
  }
  return gaps;
}

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

void drop_gaps_at_doors(WallLine& wall) {
  const auto is_door = [&](const WallOpening& gap) {
    return std::any_of(wall.openings.begin(), wall.openings.end(), [&](const WallOpening& door) {
      return std::min(gap.s1, door.s1) - std::max(gap.s0, door.s0) > 0.5 * (door.s1 - door.s0);
    });
  };
  wall.gaps.erase(std::remove_if(wall.gaps.begin(), wall.gaps.end(), is_door), wall.gaps.end());
}

}  // namespace plumbline::exports
