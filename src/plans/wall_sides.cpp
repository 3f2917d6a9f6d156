// SPDX-License-Identifier: BSD-3-Clause
// From the wall planes that evaluate finds to straight pieces of walls.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "plumbline/evaluate/surface.hpp"
#include "plumbline/evaluate/wall_planes.hpp"
#include "plumbline/evaluate/wall_thickness.hpp"
#include "plumbline/plans/plan.hpp"
#include "wall_steps.hpp"

namespace plumbline::plans {
namespace {

constexpr double kWallSlab_m = 0.03;   ///< points within this distance of a plane belong to its wall
constexpr double kWallUpright = 0.26;  ///< most of a normal that is vertical: 15 degrees
constexpr float kWallAlike = 0.906F;   ///< cosine of 25 degrees
constexpr double kShortestWall_m = 0.25;

/// A piece of a wall, and the number of points that show it.
struct Side {
  WallLine line;
  std::size_t points = 0;
};

/// Points of walls, with their height over the floor as z: planes that are a little askew meet the plan
/// there.
evaluate::SurfaceSamples upright_samples(const cloud::Cloud& cloud, double floor_m) {
  constexpr double kFoot_m = 0.1;  // skirting
  evaluate::SurfaceSamples samples;
  for (const cloud::Point& p : cloud) {
    const Eigen::Vector3f normal = p.getNormalVector3fMap();
    if (!normal.allFinite() || std::abs(normal.z()) > kWallUpright || p.z < floor_m + kFoot_m) continue;
    samples.points.emplace_back(p.x, p.y, p.z - static_cast<float>(floor_m));
    samples.normals.push_back(normal);
  }
  return samples;
}

/// Distance of neighbouring points, from the number of points per cell.
double typical_spacing(const evaluate::SurfaceSamples& samples) {
  constexpr float kCell_m = 0.1F;
  std::map<std::array<int, 3>, int> cells;
  for (std::size_t i = 0; i < samples.points.size(); i += 1) {
    const Eigen::Array3f cell = (samples.points[i] / kCell_m).array().floor();
    ++cells[{static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z())}];
  }
  std::vector<int> counts;
  counts.reserve(cells.size());
  for (const auto& [cell, count] : cells) counts.push_back(count);
  if (counts.empty()) return kCell_m;
  std::nth_element(counts.begin(), counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2),
                   counts.end());
  return kCell_m / std::sqrt(static_cast<double>(std::max(1, counts[counts.size() / 2])));
}

/// Height that walls reach and furniture does not.
double wall_height(const evaluate::SurfaceSamples& samples) {
  constexpr double kMost_m = 2.25;
  constexpr double kBelowTop_m = 0.3;
  if (samples.points.empty()) return kMost_m;
  std::vector<float> heights;
  for (const auto& p : samples.points) heights.push_back(p.z());
  const auto high = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() * 98 / 100);
  std::nth_element(heights.begin(), high, heights.end());
  return std::min(kMost_m, static_cast<double>(*high) - kBelowTop_m);
}

/// The line on which most points lie: the most frequent distance, then least squares near it.
void fit_line(const std::vector<Eigen::Vector2d>& places, WallLine& line) {
  constexpr double kBin_m = 0.001;
  constexpr std::array<double, 5> kNear_m{0.03, 0.015, 0.008, 0.005, 0.005};
  constexpr int kBins = 2 * static_cast<int>(kWallSlab_m / kBin_m) + 1;
  std::array<int, kBins> bins{};
  for (const Eigen::Vector2d& p : places) {
    const auto bin = std::lround((line.normal.dot(p) - line.offset_m + kWallSlab_m) / kBin_m);
    if (bin >= 0 && bin < kBins) ++bins[static_cast<std::size_t>(bin)];
  }

  int best = 0;
  int most = -1;
  for (int b = 3; b + 3 < kBins; ++b) {
    int sum = 0;
    for (int k = b - 3; k <= b + 3; ++k) sum += bins[static_cast<std::size_t>(k)];
    if (sum > most) {
      most = sum;
      best = b;
    }
  }

  line.offset_m += best * kBin_m - kWallSlab_m;

  for (const double near_m : kNear_m) {
    const Eigen::Vector2d along = line.along();
    double n = 0.0, s_sum = 0.0, h_sum = 0.0, ss = 0.0, sh = 0.0;

    for (const Eigen::Vector2d& p : places) {
      const double h = line.normal.dot(p) - line.offset_m;
      if (std::abs(h) > near_m) continue;
      const double s = along.dot(p);
      n += 1.0;
      s_sum += s;
      h_sum += h;
      ss += s * s;
      sh += s * h;
    }

    const double spread = ss - s_sum * s_sum / std::max(1.0, n);
    if (n < 20.0) return;

    // A short piece does not know its direction better than its plane does.
    const double slope = line.length() > 0.6 && spread > 0.0 ? (sh - s_sum * h_sum / n) / spread : 0.0;
    const double middle = s_sum / n;
    const double rest = h_sum / n - slope * middle;

    const Eigen::Vector2d first = line.at(line.s0);
    const Eigen::Vector2d last = line.at(line.s1);
    const Eigen::Vector2d normal = line.normal - slope * along;
    line.offset_m = (line.offset_m + rest) / normal.norm();
    line.normal = normal.normalized();
    line.s0 = line.along().dot(first);
    line.s1 = line.along().dot(last);
  }
}

/// Columns of one plane that walls fill, as runs.
std::vector<std::pair<int, int>> filled_runs(const WallRaster& raster) {
  constexpr double kFewest_m = 0.2;
  constexpr int kBridge = 3;  // columns: narrower than any wall is thick
  std::vector<std::pair<int, int>> runs;
  for (int c = 0; c < raster.columns(); ++c) {
    const double seen_m = raster.seen(c, 0.0, WallRaster::kRows * WallRaster::kHeight_m) * WallRaster::kRows *
                          WallRaster::kHeight_m;
    if (seen_m < kFewest_m) continue;
    if (!runs.empty() && c - runs.back().second <= kBridge + 1) {
      runs.back().second = c;
    } else {
      runs.emplace_back(c, c);
    }
  }
  return runs;
}

/// Measures of how much a run resembles a wall.
struct RunLook {
  double high = 0.0;    ///< share of its columns that reach where furniture does not
  double at_cut = 0.0;  ///< share of the cells around the cut that show surface
};

/// Shares of a run that are high, and at the height of the cut.
RunLook look_of(const WallRaster& raster, const std::pair<int, int>& run, double need_m, double cut_m) {
  RunLook look;
  const int columns = run.second - run.first + 1;
  for (int c = run.first; c <= run.second; ++c) {
    if (raster.top(c) >= need_m) look.high += 1.0 / columns;
    look.at_cut += raster.seen(c, std::max(0.0, cut_m - 0.6), cut_m + 0.6) / columns;
  }
  return look;
}

/// True if a run reaches high enough for a wall, also where cameras looked down.
bool is_tall(const WallRaster& raster, const std::pair<int, int>& run, double need_m, double cut_m) {
  constexpr double kTall_m = 1.6;  // cameras that are held look down, and see little above this
  constexpr double kLeastTall = 0.2;
  constexpr double kLeastAtCut = 0.1;
  const RunLook look = look_of(raster, run, std::min(kTall_m, need_m), cut_m);
  return (run.second - run.first + 1) * WallRaster::kWidth_m >= kShortestWall_m && look.high >= kLeastTall &&
         look.at_cut > kLeastAtCut;
}

/// True if a run may be a part of a wall of which the upper part was not seen.
bool reaches_cut(const WallRaster& raster, const std::pair<int, int>& run, double cut_m) {
  constexpr double kLeastTall = 0.2;
  constexpr double kLeastAtCut = 0.1;
  const RunLook look = look_of(raster, run, cut_m, cut_m);
  return (run.second - run.first + 1) * WallRaster::kWidth_m >= kShortestWall_m && look.high >= kLeastTall &&
         look.at_cut > kLeastAtCut;
}

/// True if a run may be one face of a wall that is no higher than furniture: seen from its foot to the cut.
bool is_low_wall(const WallRaster& raster, const std::pair<int, int>& run, double cut_m) {
  constexpr double kFoot_m = 0.1;
  constexpr double kShortest_m = 0.8;
  constexpr double kLeastSeen = 0.6;
  if ((run.second - run.first + 1) * WallRaster::kWidth_m < kShortest_m || cut_m <= kFoot_m) return false;

  int columns = 0, reaching = 0;
  double seen = 0.0;
  for (int c = run.first; c <= run.second; ++c) {
    const double top = raster.top(c);
    if (top == 0.0) continue;  // narrower than the cloud's spacing
    ++columns;
    seen += raster.seen(c, kFoot_m, cut_m);
    if (top > cut_m) ++reaching;
  }
  return seen >= kLeastSeen * columns && reaching >= kLeastSeen * columns;
}

/// Points of the slab around a line that face as it does.
std::vector<Eigen::Vector3d> points_on(const evaluate::SurfaceSamples& samples, const WallLine& line) {
  const Eigen::Vector3f facing(static_cast<float>(line.normal.x()), static_cast<float>(line.normal.y()),
                               0.0F);
  std::vector<Eigen::Vector3d> own;
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    const Eigen::Vector3d p = samples.points[i].cast<double>();
    if (std::abs(line.normal.dot(p.head<2>()) - line.offset_m) < kWallSlab_m &&
        samples.normals[i].dot(facing) > kWallAlike)
      own.push_back(p);
  }
  return own;
}

/// Fits the line to all its points.
void align_with_points(const std::vector<Eigen::Vector3d>& points, WallLine& line) {
  std::vector<Eigen::Vector2d> places;
  places.reserve(points.size());
  for (const Eigen::Vector3d& p : points) places.emplace_back(p.head<2>());
  const Eigen::Vector2d along = line.along();
  const auto earlier = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return along.dot(a) < along.dot(b);
  };
  const auto [first, last] = std::minmax_element(places.begin(), places.end(), earlier);
  line.s0 = along.dot(*first);
  line.s1 = along.dot(*last);
  fit_line(places, line);
}

/// The walls on one plane.
std::vector<Side> sides_on(const evaluate::SurfaceSamples& samples, const evaluate::WallPlane& plane,
                           double need_m, double cut_m) {
  WallLine base;
  base.normal = plane.normal.head<2>().normalized();
  base.offset_m = plane.offset_m / plane.normal.head<2>().norm();
  const std::vector<Eigen::Vector3d> first = points_on(samples, base);
  if (first.empty()) return {};

  // A plane of a few patches is a little askew: at the far end of a long wall that is more than the slab.
  align_with_points(first, base);
  std::vector<Eigen::Vector3d> own = points_on(samples, base);
  if (own.empty()) return {};

  const Eigen::Vector2d along = base.along();
  std::sort(own.begin(), own.end(), [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return along.dot(a.head<2>()) < along.dot(b.head<2>());
  });

  WallRaster raster(base.normal, base.offset_m, along.dot(own.front().head<2>()),
                    along.dot(own.back().head<2>()), 0.0);
  for (const Eigen::Vector3d& p : own) raster.add_surface(p);

  // In line with a long wall another part of it need not be tall
  constexpr double kLong_m = 1.5;
  std::vector<Side> sides;
  const auto runs = filled_runs(raster);
  const bool any_long = std::any_of(runs.begin(), runs.end(), [&](const auto& run) {
    return (run.second - run.first + 1) * WallRaster::kWidth_m >= kLong_m &&
           is_tall(raster, run, need_m, cut_m);
  });
  for (const auto& run : runs) {
    const bool tall = is_tall(raster, run, need_m, cut_m) || (any_long && reaches_cut(raster, run, cut_m));
    if (!tall && !is_low_wall(raster, run, cut_m)) continue;
    Side side;
    side.line = base;
    side.line.low = !tall;

    std::vector<Eigen::Vector2d> places;
    for (const Eigen::Vector3d& p : own) {
      const double s = along.dot(p.head<2>());
      if (s >= raster.start_of(run.first) && s < raster.start_of(run.second + 1))
        places.emplace_back(p.head<2>());
    }

    side.line.s0 = along.dot(places.front());
    side.line.s1 = along.dot(places.back());
    for (int c = run.first; c <= run.second; ++c) side.line.top_m = std::max(side.line.top_m, raster.top(c));
    side.line.high = look_of(raster, run, need_m, cut_m).high;
    side.points = places.size();
    fit_line(places, side.line);
    sides.push_back(side);
  }

  return sides;
}

/// True if two pieces are one wall with something flat on it.
bool covers(const WallLine& large, const WallLine& small) {
  constexpr double kApart_m = 0.12;
  constexpr double kShare = 0.6;
  constexpr double kShort_m = 0.6;  // of which the direction is not known well
  if (large.normal.dot(small.normal) < (small.length() < kShort_m ? kWallAlike : 0.985)) return false;
  const double middle = 0.5 * (small.s0 + small.s1);
  if (std::abs(large.normal.dot(small.at(middle)) - large.offset_m) > kApart_m) return false;
  const double a = large.along().dot(small.at(small.s0));
  const double b = large.along().dot(small.at(small.s1));
  const double common = std::min(large.s1, std::max(a, b)) - std::max(large.s0, std::min(a, b));
  return common > kShare * small.length();
}

/// Turns short pieces, of which the direction is not known well, into that of the wall's longer other face.
void align_short_faces(std::vector<WallLine>& walls) {
  constexpr double kShort_m = 0.6, kThinnest_m = 0.06, kShare = 0.6;
  constexpr double kAlike = 0.95;  // cosine of 18 degrees
  const std::vector<WallLine> all = walls;
  for (WallLine& side : walls) {
    const Eigen::Vector2d middle = side.at(0.5 * (side.s0 + side.s1));
    const double half = 0.5 * side.length();
    if (2.0 * half >= kShort_m) continue;

    // A longer face behind most of it
    const auto face = std::find_if(all.begin(), all.end(), [&](const WallLine& other) {
      const double behind = other.offset_m - other.normal.dot(middle), s = other.along().dot(middle);
      const double common = std::min(other.s1, s + half) - std::max(other.s0, s - half);
      return other.length() > 2.0 * half && other.normal.dot(side.normal) < -kAlike && behind > kThinnest_m &&
             behind < kThickestWall_m && common > kShare * 2.0 * half;
    });
    if (face == all.end()) continue;

    // Turned about its middle
    side.normal = -face->normal;
    side.offset_m = side.normal.dot(middle);
    side.s0 = side.along().dot(middle) - half;
    side.s1 = side.along().dot(middle) + half;
  }
}

}  // namespace

/// Fits every wall to its own points once more; openings keep their places.
void fit_sides(const cloud::Cloud& cloud, double floor_m, const core::Executor& executor,
               std::vector<WallLine>& walls) {
  const evaluate::SurfaceSamples samples = upright_samples(cloud, floor_m);
  executor.parallel_for(walls.size(), [&](std::size_t i) {
    WallLine& wall = walls[i];
    std::vector<Eigen::Vector2d> places;
    for (const Eigen::Vector3d& p : points_on(samples, wall)) {
      const double s = wall.along().dot(p.head<2>());
      if (s >= wall.s0 && s <= wall.s1) places.emplace_back(p.head<2>());
    }

    // Places along the line change with its direction
    const WallLine before = wall;
    fit_line(places, wall);
    for (auto* parts : {&wall.openings, &wall.gaps}) {
      for (WallOpening& part : *parts)
        part = {wall.along().dot(before.at(part.s0)), wall.along().dot(before.at(part.s1))};
    }
  });
}

/// Straight pieces of walls, without those that a larger piece covers.
std::vector<WallLine> wall_sides(const cloud::Cloud& cloud, double floor_m, double cut_m,
                                 const core::Executor& executor) {
  constexpr int kMostPlanes = 80;

  // Planes of the cloud's upright patches
  const evaluate::SurfaceSamples samples = upright_samples(cloud, floor_m);
  evaluate::WallThicknessOptions patch_options;
  evaluate::WallPlanesOptions plane_options;
  plane_options.planes = kMostPlanes;
  auto patches = evaluate::wall_patches(samples, typical_spacing(samples), patch_options, executor);
  const auto planes =
      evaluate::wall_planes(samples, std::move(patches), patch_options.patch_m, plane_options);

  // Planes are independent, so they run in parallel
  const double need_m = wall_height(samples);
  std::vector<std::vector<Side>> found(planes.size());
  executor.parallel_for(planes.size(), [&](std::size_t i) {
    if (std::abs(planes[i].normal.z()) < kWallUpright) found[i] = sides_on(samples, planes[i], need_m, cut_m);
  });

  // Tall sides come first, then those with many points
  std::vector<Side> sides;
  for (const auto& of_plane : found) sides.insert(sides.end(), of_plane.begin(), of_plane.end());
  std::stable_sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.line.low != b.line.low ? b.line.low : a.points > b.points;
  });

  // Pictures and panels on a wall are dropped
  std::vector<WallLine> walls;
  for (const Side& side : sides) {
    const bool covered = std::any_of(walls.begin(), walls.end(),
                                     [&](const WallLine& wall) { return covers(wall, side.line); });
    if (!covered) walls.push_back(side.line);
  }

  align_short_faces(walls);
  return walls;
}

}  // namespace plumbline::plans
