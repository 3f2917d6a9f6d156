// SPDX-License-Identifier: BSD-3-Clause
#include "plans/walls.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>

#include "plans/wall_raster.hpp"

namespace plumbline::exports {
namespace {

/// The fronts of a side's first and its last piece; the same for a side of one piece.
struct Fronts {
  std::shared_ptr<const WallRaster> first, last;
};

constexpr double kNarrowestDoor_m = 0.55;
constexpr double kWidestDoor_m = 1.6;

/// Surface and rays of walls, each from a little before its start to a little behind its end.
std::vector<WallRaster> rasters_of(const std::vector<WallLine>& walls, const cloud::CloudFile& file,
                                   double floor_m) {
  constexpr double kSlab_m = 0.03;
  std::vector<WallRaster> rasters;
  rasters.reserve(walls.size());
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
WallOpening widened(const WallRaster& raster, const WallLine& wall, WallOpening opening, const Cut& cut) {
  const int first = raster.column_at(wall.at(opening.s0));
  const int last = raster.column_at(wall.at(opening.s1));
  int a = first;
  int b = last;
  while (a > 0 && open_column(raster, a - 1, cut) && raster.start_of(b) - raster.start_of(a) < kWidestDoor_m)
    --a;
  while (b + 1 < raster.columns() && open_column(raster, b, cut) &&
         raster.start_of(b) - raster.start_of(a) < kWidestDoor_m)
    ++b;
  opening.s0 -= (first - a) * WallRaster::kWidth_m;
  opening.s1 += (b - last) * WallRaster::kWidth_m;
  return opening;
}

/// The line through two pieces of one, each of which counts by its length.
WallLine joined_pieces(const WallLine& a, const WallLine& b) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const WallLine* piece : {&a, &b})
    middle += piece->length() * piece->at(0.5 * (piece->s0 + piece->s1)) / (a.length() + b.length());

  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const WallLine* piece : {&a, &b}) {
    const Eigen::Vector2d off = piece->at(0.5 * (piece->s0 + piece->s1)) - middle;
    const double own = piece->length() * piece->length() / 12.0;
    spread += piece->length() * (off * off.transpose() + own * piece->along() * piece->along().transpose());
  }

  const Eigen::Vector2d across = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvectors().col(0);
  WallLine line = a;
  line.normal = across.dot(a.normal) < 0.0 ? Eigen::Vector2d(-across) : across;
  line.offset_m = line.normal.dot(middle);
  line.s0 = line.along().dot(a.at(a.s0));
  line.s1 = line.along().dot(b.at(b.s1));
  line.openings.clear();
  for (const WallLine* piece : {&a, &b}) {
    for (const WallOpening& o : piece->openings)
      line.openings.push_back({line.along().dot(piece->at(o.s0)), line.along().dot(piece->at(o.s1))});
  }

  line.corner[1] = b.corner[1];
  line.top_m = std::max(a.top_m, b.top_m);
  line.high = std::max(a.high, b.high);
  return line;
}

/// Joins what lies behind one another on one line and was only hidden, or is a door without a lintel that was
/// seen.
void bridge_gaps(std::vector<WallLine>& walls, std::vector<Fronts>& fronts, const Cut& cut) {
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

      const WallRaster& front = *fronts[i].last;
      const bool crossed = is_passage(front, front.column_at(a.at(a.s1)), front.column_at(b.at(b.s0)),
                                      {cut.low_m, cut.high_m, true});
      if (crossed && gap < kNarrowestDoor_m) continue;

      if (crossed || !cut.rays_known) a.openings.push_back(widened(front, a, {a.s1, from}, cut));
      a = joined_pieces(a, b);
      fronts[i].last = fronts[j].last;

      walls.erase(walls.begin() + static_cast<std::ptrdiff_t>(j));
      fronts.erase(fronts.begin() + static_cast<std::ptrdiff_t>(j));
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

/// Share of a side that reaches so high as to be no furniture.
constexpr double kLeastHigh = 0.2;

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

/// True if a longer wall that faces the same way runs a little behind it, in front of which furniture stands.
/// It hides that wall: what is seen of the wall may end on both sides of it.
bool stands_before_wall(const WallLine& side, const std::vector<WallLine>& walls) {
  constexpr double kNearest_m = 0.12;
  constexpr double kFarthest_m = 0.75;
  constexpr double kReach_m = 0.4;
  bool before = false, behind = false;
  for (const WallLine& wall : walls) {
    if (wall.normal.dot(side.normal) < 0.998) continue;
    const double s0 = wall.along().dot(side.at(side.s0));
    const double s1 = wall.along().dot(side.at(side.s1));
    const double distance = wall.normal.dot(side.at(0.5 * (side.s0 + side.s1))) - wall.offset_m;
    if (distance < kNearest_m || distance > kFarthest_m) continue;
    if (wall.s0 - kReach_m < s0 && wall.s1 + kReach_m > s1 && wall.length() > side.length()) return true;
    before = before || (wall.s0 < s0 && wall.s1 > s0 - kReach_m);
    behind = behind || (wall.s1 > s1 && wall.s0 < s1 + kReach_m);
  }
  return before && behind;
}

/// Drops what is tall, but no wall: cameras looked over it, or it stands in front of a wall. Without rays
/// only what reaches high is known to be a wall.
void drop_furniture(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters, bool rays_known) {
  constexpr double kLongest_m = 3.0;  // of furniture
  std::vector<WallLine> kept;
  std::vector<WallRaster> kept_rasters;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const bool high = walls[i].high >= kLeastHigh;
    if (!high && (!rays_known || is_looked_over(walls[i], rasters[i]))) continue;
    if (walls[i].length() < kLongest_m && stands_before_wall(walls[i], walls)) continue;
    kept.push_back(walls[i]);
    kept_rasters.push_back(std::move(rasters[i]));
  }
  walls = std::move(kept);
  rasters = std::move(kept_rasters);
}

/// Drops door leaves and pieces of furniture: short pieces that neither meet walls at both ends, or one at a
/// right angle, nor continue along a line.
void drop_loose_pieces(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters) {
  constexpr double kShort_m = 1.5;
  constexpr double kStub_m = 0.6;
  constexpr double kSquare = 0.05;  // cosine: within 3 degrees
  std::vector<WallLine> joined = walls;
  join_corners(joined);

  std::vector<WallLine> kept;
  std::vector<WallRaster> kept_rasters;
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
    const bool between = met && walls[i].length() >= kStub_m;
    if (!(walls[i].length() >= kShort_m || between || square || goes_on)) continue;
    kept.push_back(walls[i]);
    kept_rasters.push_back(std::move(rasters[i]));
  }

  walls = std::move(kept);
  rasters = std::move(kept_rasters);
}

}  // namespace

namespace {

/// True if the two are seen from one side: each stands in front of the other, or each behind it.
bool make_a_corner(const WallLine& a, const WallLine& b) {
  const bool b_before = a.normal.dot(b.at(0.5 * (b.s0 + b.s1))) > a.offset_m;
  const bool a_before = b.normal.dot(a.at(0.5 * (a.s0 + a.s1))) > b.offset_m;
  return a_before == b_before;
}

}  // namespace

void join_corners(std::vector<WallLine>& walls) {
  constexpr double kReach_m = 0.3;
  constexpr double kBeyond_m = 0.08;  // that a wall was seen beyond its corner, by noise
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
        const double more = end == 0 ? walls[i].s0 - s : s - walls[i].s1;  // that the wall is longer
        const double off = std::abs(more);
        if (more > kReach_m || more < -kBeyond_m) continue;
        for (int other = 0; other < 2; ++other) {
          const double other_more = other == 0 ? walls[j].s0 - t : t - walls[j].s1;
          if (other_more <= kReach_m && other_more >= -kBeyond_m && make_a_corner(walls[i], walls[j]))
            meetings.push_back({off + std::abs(other_more), i, end, j, other, s, t});
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

namespace {

/// Makes both ends of the same opening, on the two sides of a wall, lie opposite each other.
void level_openings(const WallLine& a, WallOpening& of_a, const WallLine& b, WallOpening& of_b) {
  constexpr double kAlike_m = 0.05;
  const double first = a.along().dot(b.at(of_b.s1));
  const double last = a.along().dot(b.at(of_b.s0));
  if (std::abs(first - of_a.s0) > kAlike_m) {
    of_a.s0 = std::min(first, of_a.s0);
    of_b.s1 = b.along().dot(a.at(of_a.s0));
  }
  if (std::abs(last - of_a.s1) > kAlike_m) {
    of_a.s1 = std::max(last, of_a.s1);
    of_b.s0 = b.along().dot(a.at(of_a.s1));
  }
}

}  // namespace

std::vector<WallDoor> doors_of(std::vector<WallLine>& walls) {
  constexpr double kThickest_m = 0.45;
  std::vector<WallDoor> doors;
  std::vector<std::vector<bool>> used;
  used.reserve(walls.size());
  for (const WallLine& wall : walls) used.emplace_back(wall.openings.size(), false);

  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (std::size_t k = 0; k < walls[i].openings.size(); ++k) {
      if (used[i][k]) continue;
      const WallLine& wall = walls[i];
      WallOpening& opening = walls[i].openings[k];
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
          level_openings(wall, opening, walls[j], walls[j].openings[m]);
          door.jambs = {wall.at(opening.s0), wall.at(opening.s1)};
          door.far_jambs = {walls[j].at(walls[j].openings[m].s1), walls[j].at(walls[j].openings[m].s0)};
          door.width_m = std::min(opening.s1 - opening.s0, walls[j].openings[m].s1 - walls[j].openings[m].s0);
        }
      }

      doors.push_back(door);
    }
  }

  return doors;
}

namespace {

/// Ends that meet no wall, but nearly the line of one of which this part was hidden, are moved to that line.
void meet_hidden_walls(std::vector<WallLine>& walls) {
  constexpr double kNear_m = 0.06;
  constexpr double kHidden_m = 2.5;
  constexpr double kShortest_m = 1.0;
  constexpr double kLeastTurn = 0.5;  // sine of 30 degrees
  const std::vector<WallLine> all = walls;
  for (WallLine& wall : walls) {
    for (int end = 0; end < 2; ++end) {
      if (wall.corner[static_cast<std::size_t>(end)] >= 0) continue;
      double& own = end == 0 ? wall.s0 : wall.s1;
      double best = kNear_m, moved = own;

      for (const WallLine& other : all) {
        const double turn = other.normal.dot(wall.along());
        if (std::abs(turn) < kLeastTurn || other.length() < kShortest_m) continue;
        const double s = own + (other.offset_m - other.normal.dot(wall.at(own))) / turn;
        const double t = other.along().dot(wall.at(s));
        const double hidden = std::max(other.s0 - t, t - other.s1);
        if (std::abs(s - own) >= best || hidden > kHidden_m || hidden < 0.0) continue;
        best = std::abs(s - own);
        moved = s;
      }

      own = moved;
    }
  }
}

/// Finds doors whose jambs were seen from different sides of the wall, one from each.
std::vector<WallDoor> doors_between_sides(const std::vector<WallLine>& walls,
                                          const std::vector<Fronts>& fronts, const Cut& cut) {
  constexpr double kThickest_m = 0.45;
  std::vector<WallDoor> doors;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (std::size_t j = i + 1; j < walls.size(); ++j) {
      const WallLine& a = walls[i];
      const WallLine& b = walls[j];
      const double behind = a.offset_m - a.normal.dot(b.at(0.5 * (b.s0 + b.s1)));
      if (a.normal.dot(b.normal) > -0.998 || behind < 0.0 || behind > kThickest_m) continue;

      // The other side runs backwards, so that its ends in the gap have equal numbers.
      for (std::size_t end = 0; end < 2; ++end) {
        if (a.corner[end] >= 0 || b.corner[end] >= 0) continue;
        const Eigen::Vector2d jamb = a.at(end == 0 ? a.s0 : a.s1);
        const Eigen::Vector2d far = b.at(end == 0 ? b.s0 : b.s1);
        const double gap = (end == 0 ? -1.0 : 1.0) * a.along().dot(far - jamb);
        if (gap < kNarrowestDoor_m || gap > kWidestDoor_m) continue;

        const WallRaster& front = end == 0 ? *fronts[i].first : *fronts[i].last;
        const int c0 = front.column_at(jamb), c1 = front.column_at(far);
        if (!is_passage(front, std::min(c0, c1), std::max(c0, c1), cut)) continue;
        const Eigen::Vector2d across = (a.normal.dot(far) - a.offset_m) * a.normal;
        doors.push_back({{jamb, far - across}, {jamb + across, far}, gap});
      }
    }
  }

  return doors;
}

}  // namespace

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
  std::vector<WallRaster> rasters = rasters_of(plan.walls, **cloud, floor_m);
  if (source.has_store()) {
    auto seen = for_each_view(source, [&](const ViewRays& rays) -> core::Result<void> {
      source.executor().parallel_for(rasters.size(), [&](std::size_t i) { rasters[i].add_rays(rays); });
      return {};
    });
    if (!seen) return tl::unexpected(seen.error());
    plan.rays_known = true;
  }

  drop_furniture(plan.walls, rasters, plan.rays_known);
  drop_loose_pieces(plan.walls, rasters);
  if (plan.walls.empty()) {
    return core::input_error(fmt::format("{}: no wall is seen at {:g} m over the floor; choose another --cut",
                                         source.request().input.string(), cut_m));
  }

  join_corners(plan.walls);
  const Cut cut{std::max(0.25, cut_m - 0.3), cut_m + 0.3, plan.rays_known};
  for (std::size_t i = 0; i < plan.walls.size(); ++i)
    plan.walls[i].openings = openings_between(rasters[i], plan.walls[i].s0, plan.walls[i].s1, cut);

  std::vector<Fronts> fronts;
  for (WallRaster& raster : rasters) {
    const auto front = std::make_shared<const WallRaster>(std::move(raster));
    fronts.push_back({front, front});
  }
  bridge_gaps(plan.walls, fronts, cut);
  fit_sides(**cloud, floor_m, source.executor(), plan.walls);
  join_corners(plan.walls);
  meet_hidden_walls(plan.walls);

  for (WallLine& wall : plan.walls) {
    std::sort(wall.openings.begin(), wall.openings.end(),
              [](const WallOpening& a, const WallOpening& b) { return a.s0 < b.s0; });
  }

  plan.doors = doors_of(plan.walls);
  const std::vector<WallDoor> more = doors_between_sides(plan.walls, fronts, cut);
  plan.doors.insert(plan.doors.end(), more.begin(), more.end());
  plan.rooms = rooms_of(plan.walls);
  return plan;
}

}  // namespace plumbline::exports
