// SPDX-License-Identifier: BSD-3-Clause
#include "plans/walls.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

#include "plans/wall_raster.hpp"

namespace plumbline::exports {
namespace {

constexpr double kNarrowestDoor_m = 0.55;
constexpr double kWidestDoor_m = 1.6;

/// Surface and rays of walls, each from a little before its start to a little behind its end.
std::vector<WallRaster> rasters_of(const std::vector<WallLine>& walls, const cloud::CloudFile& file,
                                   double floor_m) {
  constexpr double kSlab_m = 0.03;
  std::vector<WallRaster> rasters;
  for (const WallLine& wall : walls)
    rasters.emplace_back(wall.normal, wall.offset_m, wall.s0 - kWidestDoor_m, wall.s1 + kWidestDoor_m,
                         floor_m);
  for (const cloud::Point& p : *file.cloud) {
    if (!(std::abs(p.normal_z) < 0.4F)) continue;
    const Eigen::Vector3d at = p.getVector3fMap().cast<double>() + file.shift;
    for (std::size_t i = 0; i < walls.size(); ++i) {
      const double h = walls[i].normal.dot(at.head<2>()) - walls[i].offset_m;
      const double facing = walls[i].normal.x() * p.normal_x + walls[i].normal.y() * p.normal_y;
      if (std::abs(h) < kSlab_m && facing > 0.8) rasters[i].add_surface(at);
    }
  }
  return rasters;
}

/// Mean over the columns from a to b.
template <typename Share>
double mean_share(int a, int b, const Share& share) {
  double sum = 0.0;
  for (int c = a; c <= b; ++c) sum += share(c);
  return sum / std::max(1, b - a + 1);
}

/// Heights between which a column must be free to count as open, metres.
struct Cut {
  double low_m;
  double high_m;
  bool rays_known;
};

bool open_column(const WallRaster& raster, int column, const Cut& cut) {
  constexpr double kMost = 0.25;
  return raster.seen(column, 0.25, 0.8) <= kMost && raster.seen(column, cut.low_m, cut.high_m) <= kMost;
}

/// True if cameras looked through; if the rays are not known, true if there is a lintel above.
bool is_passage(const WallRaster& raster, int a, int b, const Cut& cut) {
  constexpr double kLeastCrossed = 0.08;
  constexpr double kLeastLintel = 0.3;
  if (cut.rays_known)
    return mean_share(a, b, [&](int c) { return raster.crossed(c, 0.3, 1.9); }) >= kLeastCrossed;
  return mean_share(a, b, [&](int c) { return raster.seen(c, 2.15, 2.5); }) >= kLeastLintel;
}

/// Openings between two places of a wall, by their columns.
std::vector<WallOpening> openings_between(const WallRaster& raster, double s0, double s1, const Cut& cut) {
  constexpr int kBridge = 3;  // columns with a door's handle or the like
  std::vector<std::pair<int, int>> runs;
  for (int c = raster.column_of(s0); c <= raster.column_of(s1); ++c) {
    if (!open_column(raster, c, cut)) continue;
    if (!runs.empty() && c - runs.back().second <= kBridge) {
      runs.back().second = c;
    } else {
      runs.emplace_back(c, c);
    }
  }

  std::vector<WallOpening> openings;
  for (const auto& [a, b] : runs) {
    const WallOpening opening{raster.start_of(a), raster.start_of(b + 1)};
    const double width = opening.s1 - opening.s0;
    if (width >= kNarrowestDoor_m && width <= kWidestDoor_m && is_passage(raster, a, b, cut))
      openings.push_back(opening);
  }

  return openings;
}

/// An opening up to where its wall begins: leaves and frames reach a little into it.
WallOpening widened(const WallRaster& raster, WallOpening opening, const Cut& cut) {
  int a = raster.column_of(opening.s0);
  int b = raster.column_of(opening.s1);
  while (a > 0 && open_column(raster, a - 1, cut) && raster.start_of(b) - raster.start_of(a) < kWidestDoor_m)
    --a;
  while (b + 1 < raster.columns() && open_column(raster, b, cut) &&
         raster.start_of(b) - raster.start_of(a) < kWidestDoor_m)
    ++b;
  opening.s0 = std::min(opening.s0, raster.start_of(a));
  opening.s1 = std::max(opening.s1, raster.start_of(b));
  return opening;
}

/// Joins what lies behind one another on one line and was only hidden, or is a door without a lintel that was
/// seen.
void bridge_gaps(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters, const Cut& cut) {
  constexpr double kLongest_m = 1.6;
  constexpr double kSameLine_m = 0.025;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (std::size_t j = 0; j < walls.size(); ++j) {
      WallLine& a = walls[i];
      const WallLine& b = walls[j];
      if (i == j || a.corner[1] >= 0 || b.corner[0] >= 0 || a.normal.dot(b.normal) < 0.998) continue;

      const double from = a.along().dot(b.at(b.s0));
      const double gap = from - a.s1;
      if (gap <= 0.0 || gap > kLongest_m || std::abs(a.normal.dot(b.at(b.s0)) - a.offset_m) > kSameLine_m)
        continue;

      const int first = rasters[i].column_of(a.s1);
      const int last = rasters[i].column_of(from);
      const bool crossed = is_passage(rasters[i], first, last, {cut.low_m, cut.high_m, true});
      if (crossed && gap < kNarrowestDoor_m) continue;

      if (crossed || !cut.rays_known) a.openings.push_back(widened(rasters[i], {a.s1, from}, cut));
      const double to = a.along().dot(b.at(b.s1));
      for (const WallOpening& o : b.openings)
        a.openings.push_back({a.along().dot(b.at(o.s0)), a.along().dot(b.at(o.s1))});
      a.s1 = to;
      a.corner[1] = b.corner[1];
      a.top_m = std::max(a.top_m, b.top_m);

      walls.erase(walls.begin() + static_cast<std::ptrdiff_t>(j));
      rasters.erase(rasters.begin() + static_cast<std::ptrdiff_t>(j));
      join_corners(walls);
      i = static_cast<std::size_t>(-1);  // from the start: numbers have changed
      break;
    }

    if (i == static_cast<std::size_t>(-1)) continue;
  }
}

/// True if two sides lie on one line, one behind the other.
bool in_line(const WallLine& a, const WallLine& b) {
  constexpr double kSameLine_m = 0.03;
  return a.normal.dot(b.normal) > 0.998 &&
         std::abs(a.normal.dot(b.at(0.5 * (b.s0 + b.s1))) - a.offset_m) < kSameLine_m;
}

/// Drops door leaves and pieces of furniture: short pieces that neither meet walls at both ends, or one at a
/// right angle, nor continue along a line.
void drop_loose_pieces(std::vector<WallLine>& walls) {
  constexpr double kShort_m = 1.5;
  constexpr double kSquare = 0.05;  // cosine: within 3 degrees
  std::vector<WallLine> joined = walls;
  join_corners(joined);

  std::vector<WallLine> kept;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const bool met = joined[i].corner[0] >= 0 && joined[i].corner[1] >= 0;
    const bool square = std::any_of(joined[i].corner.begin(), joined[i].corner.end(), [&](int other) {
      return other >= 0 &&
             std::abs(joined[i].normal.dot(joined[static_cast<std::size_t>(other)].normal)) < kSquare &&
             joined[static_cast<std::size_t>(other)].length() >= kShort_m;
    });

    const bool goes_on = std::any_of(walls.begin(), walls.end(), [&](const WallLine& other) {
      return &other != &walls[i] && other.length() >= 0.5 * kShort_m && in_line(walls[i], other);
    });
    if (walls[i].length() >= kShort_m || met || square || goes_on) kept.push_back(walls[i]);
  }

  walls = std::move(kept);
}

}  // namespace

void join_corners(std::vector<WallLine>& walls) {
  constexpr double kReach_m = 0.3;
  constexpr double kLeastTurn = 0.5;  // sine of 30 degrees
  for (WallLine& wall : walls) {
    wall.corner = {-1, -1};
    wall.corner_end = {0, 0};
  }

  struct Meeting {
    double distance;
    std::size_t wall;
    int end;
    std::size_t other;
    int other_end;
    double s;
    double other_s;
  };

  std::vector<Meeting> meetings;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (std::size_t j = 0; j < walls.size(); ++j) {
      Eigen::Matrix2d normals;
      normals.row(0) = walls[i].normal.transpose();
      normals.row(1) = walls[j].normal.transpose();
      if (i == j || std::abs(normals.determinant()) < kLeastTurn) continue;

      const Eigen::Vector2d at = normals.inverse() * Eigen::Vector2d(walls[i].offset_m, walls[j].offset_m);
      const double s = walls[i].along().dot(at);
      const double t = walls[j].along().dot(at);

      for (int end = 0; end < 2; ++end) {
        const double off = std::abs(s - (end == 0 ? walls[i].s0 : walls[i].s1));
        if (off > kReach_m) continue;
        for (int other = 0; other < 2; ++other) {
          const double other_off = std::abs(t - (other == 0 ? walls[j].s0 : walls[j].s1));
          if (other_off <= kReach_m) meetings.push_back({off + other_off, i, end, j, other, s, t});
        }
        if (t > walls[j].s0 + kReach_m && t < walls[j].s1 - kReach_m)
          meetings.push_back({off + 2.0 * kReach_m, i, end, j, 2, s, t});
      }
    }
  }

  std::stable_sort(meetings.begin(), meetings.end(),
                   [](const Meeting& a, const Meeting& b) { return a.distance < b.distance; });
  for (const Meeting& m : meetings) {
    WallLine& wall = walls[m.wall];
    WallLine& other = walls[m.other];
    if (wall.corner[static_cast<std::size_t>(m.end)] >= 0) continue;
    if (m.other_end < 2 && other.corner[static_cast<std::size_t>(m.other_end)] >= 0) continue;

    wall.corner[static_cast<std::size_t>(m.end)] = static_cast<int>(m.other);
    wall.corner_end[static_cast<std::size_t>(m.end)] = m.other_end;
    (m.end == 0 ? wall.s0 : wall.s1) = m.s;
    if (m.other_end == 2) continue;

    other.corner[static_cast<std::size_t>(m.other_end)] = static_cast<int>(m.wall);
    other.corner_end[static_cast<std::size_t>(m.other_end)] = m.end;
    (m.other_end == 0 ? other.s0 : other.s1) = m.other_s;
  }
}

std::vector<WallDoor> doors_of(const std::vector<WallLine>& walls) {
  constexpr double kThickest_m = 0.45;
  std::vector<WallDoor> doors;
  std::vector<std::vector<bool>> used;
  for (const WallLine& wall : walls) used.emplace_back(wall.openings.size(), false);

  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (std::size_t k = 0; k < walls[i].openings.size(); ++k) {
      if (used[i][k]) continue;
      const WallLine& wall = walls[i];
      const WallOpening& opening = wall.openings[k];
      WallDoor door;
      door.jambs = {wall.at(opening.s0), wall.at(opening.s1)};
      door.far_jambs = door.jambs;
      door.width_m = opening.s1 - opening.s0;

      // The other side of the same wall.
      for (std::size_t j = 0; j < walls.size(); ++j) {
        if (walls[j].normal.dot(wall.normal) > -0.98) continue;

        for (std::size_t m = 0; m < walls[j].openings.size(); ++m) {
          const std::array<Eigen::Vector2d, 2> far = {walls[j].at(walls[j].openings[m].s1),
                                                      walls[j].at(walls[j].openings[m].s0)};
          const double behind = wall.offset_m - wall.normal.dot(far[0]);
          const double common =
              std::min(opening.s1, wall.along().dot(far[1])) - std::max(opening.s0, wall.along().dot(far[0]));
          if (used[j][m] || behind < 0.0 || behind > kThickest_m || common < 0.5 * door.width_m) continue;
          used[j][m] = true;
          door.far_jambs = far;
          door.width_m = std::min(door.width_m, walls[j].openings[m].s1 - walls[j].openings[m].s0);
        }
      }

      doors.push_back(door);
    }
  }

  return doors;
}

core::Result<WallPlan> find_walls(MapSource& source) {
  if (auto up = source.need_upright("a plan"); !up) return tl::unexpected(up.error());
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());

  if (!(*cloud)->has_normals) {
    return core::input_error(fmt::format(
        "{}: a plan needs normals, which this cloud has not; run a filter chain with normals over it first",
        source.request().input.string()));
  }

  const double floor_m = source.floor_m();
  const double cut_m = source.options().cut_m;
  WallPlan plan;
  plan.walls = wall_sides(**cloud, floor_m, cut_m, source.executor());
  drop_loose_pieces(plan.walls);

  if (plan.walls.empty()) {
    return core::input_error(fmt::format("{}: no wall is seen at {:g} m over the floor; choose another --cut",
                                         source.request().input.string(), cut_m));
  }

  join_corners(plan.walls);
  std::vector<WallRaster> rasters = rasters_of(plan.walls, **cloud, floor_m);
  if (source.has_store()) {
    auto seen = for_each_view(source, [&](const ViewRays& rays) -> core::Result<void> {
      source.executor().parallel_for(rasters.size(), [&](std::size_t i) { rasters[i].add_rays(rays); });
      return {};
    });
    if (!seen) return tl::unexpected(seen.error());
    plan.rays_known = true;
  }

  const Cut cut{std::max(0.25, cut_m - 0.3), cut_m + 0.3, plan.rays_known};
  for (std::size_t i = 0; i < plan.walls.size(); ++i)
    plan.walls[i].openings = openings_between(rasters[i], plan.walls[i].s0, plan.walls[i].s1, cut);
  bridge_gaps(plan.walls, rasters, cut);

  for (WallLine& wall : plan.walls) {
    std::sort(wall.openings.begin(), wall.openings.end(),
              [](const WallOpening& a, const WallOpening& b) { return a.s0 < b.s0; });
  }

  plan.doors = doors_of(plan.walls);
  plan.rooms = rooms_of(plan.walls);
  return plan;
}

}  // namespace plumbline::exports
