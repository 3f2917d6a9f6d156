// SPDX-License-Identifier: BSD-3-Clause
// Openings of walls, and the doors that they are.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "wall_steps.hpp"

namespace plumbline::plans {
namespace {

/// Mean over the columns from a to b.
template <typename Share>
double mean_share(int a, int b, const Share& share) {
  double sum = 0.0;
  for (int c = a; c <= b; ++c) sum += share(c);
  return sum / std::max(1, b - a + 1);
}

constexpr int kLongestUnseen = 15;  ///< columns, 30 cm: what a post or a thing before an opening hides
constexpr double kLeastCrossedColumn = 0.08;  ///< of a column from 0.3 to 1.9 m that cameras looked through

bool open_column(const WallRaster& raster, int column, const Cut& cut) {
  constexpr double kMost = 0.25;
  return raster.seen(column, 0.25, 0.8) <= kMost && raster.seen(column, cut.low_m, cut.high_m) <= kMost;
}

/// True if cameras looked through, also below the sills of windows, which what stands before them hides; if
/// the rays are not known, true if there is a lintel above. Doors are such openings, too: measure_doors()
/// distinguishes OpeningKind::kPassage by width and head.
bool is_passage(const WallRaster& raster, int a, int b, const Cut& cut) {
  constexpr double kLeastCrossed = 0.08;
  constexpr double kLeastLintel = 0.3;
  constexpr double kLeastOpen = 0.5;
  const double open = mean_share(a, b, [&](int c) { return open_column(raster, c, cut) ? 1.0 : 0.0; });
  if (cut.rays_known && open < kLeastOpen) return false;
  const auto crossed = [&](double low_m, double high_m) {
    return mean_share(a, b, [&](int c) { return raster.crossed(c, low_m, high_m); });
  };
  if (cut.rays_known) return crossed(0.3, 1.9) >= kLeastCrossed && crossed(0.2, 0.8) >= kLeastCrossed;
  return mean_share(a, b, [&](int c) { return raster.seen(c, 2.15, 2.5); }) >= kLeastLintel;
}

/// Splits runs of open columns where no ray crossed the middle of one: there may be wall between two
/// openings.
std::vector<std::pair<int, int>> split_where_unseen(const WallRaster& raster,
                                                    const std::vector<std::pair<int, int>>& runs) {
  std::vector<std::pair<int, int>> parts;
  for (const auto& [a, b] : runs) {
    int first = a, crossed = -1;  // column that was crossed last
    for (int c = a; c <= b; ++c) {
      if (raster.crossed(c, 0.3, 1.9) < kLeastCrossedColumn) continue;
      if (crossed >= 0 && c - crossed > kLongestUnseen) {
        parts.emplace_back(first, crossed);
        first = c;
      }
      crossed = c;
    }
    parts.emplace_back(first, b);
  }
  return parts;
}

/// Narrows a run of columns to those that cameras looked through: a sliding leaf before the wall hides the
/// part beside its opening, which shows no surface either.
void trim_hidden(const WallRaster& raster, const Cut& cut, int& a, int& b) {
  const auto is_hidden = [&](int c) {
    return raster.hidden(c, 0.3, 1.9) > raster.crossed(c, 0.3, 1.9) &&
           raster.crossed(c, 0.3, 1.9) < kLeastCrossedColumn;
  };
  if (!cut.rays_known) return;
  while (a < b && is_hidden(a)) ++a;
  while (b > a && is_hidden(b)) --b;
}

/// Narrows a run of columns to where rays crossed it, if they left out more than a post or a thing before it
/// hides.
void trim_unseen(const WallRaster& raster, const Cut& cut, int& a, int& b) {
  if (!cut.rays_known) return;
  int first = b + 1, last = a - 1;  // columns that rays crossed
  for (int c = a; c <= b; ++c) {
    if (raster.crossed(c, 0.3, 1.9) < kLeastCrossedColumn) continue;
    first = std::min(first, c);
    last = c;
  }
  if (first > last) return;
  if (first - a > kLongestUnseen) a = first;
  if (b - last > kLongestUnseen) b = last;
}

/// An opening up to where its wall begins: leaves and frames reach a little into it.
WallOpening widened(const WallRaster& raster, const WallLine& wall, WallOpening opening, const Cut& cut) {
  const int first = raster.column_at(wall.at(opening.s0));
  const int last = raster.column_at(wall.at(opening.s1));
  int a = first;
  int b = last;
  trim_hidden(raster, cut, a, b);
  trim_unseen(raster, cut, a, b);
  if (a > first || b < last) {
    opening.s0 += (a - first) * WallRaster::kWidth_m;
    opening.s1 -= (last - b) * WallRaster::kWidth_m;
    return opening;
  }

  // Both ends go on as long as columns are open
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
  // The middle, weighted by length
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const WallLine* piece : {&a, &b})
    middle += piece->length() * piece->at(0.5 * (piece->s0 + piece->s1)) / (a.length() + b.length());

  // Scatter of both pieces about it
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const WallLine* piece : {&a, &b}) {
    const Eigen::Vector2d off = piece->at(0.5 * (piece->s0 + piece->s1)) - middle;
    const double own = piece->length() * piece->length() / 12.0;
    spread += piece->length() * (off * off.transpose() + own * piece->along() * piece->along().transpose());
  }

  // The normal is the direction of least scatter
  const Eigen::Vector2d across = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvectors().col(0);
  WallLine line = a;
  line.normal = across.dot(a.normal) < 0.0 ? Eigen::Vector2d(-across) : across;
  line.offset_m = line.normal.dot(middle);
  line.s0 = line.along().dot(a.at(a.s0));

  line.s1 = line.along().dot(b.at(b.s1));
  line.openings.clear();
  line.gaps.clear();

  // Openings and gaps on the new line
  for (const WallLine* piece : {&a, &b}) {
    const auto on_line = [&](const WallOpening& part) -> WallOpening {
      return {line.along().dot(piece->at(part.s0)), line.along().dot(piece->at(part.s1))};
    };
    std::transform(piece->openings.begin(), piece->openings.end(), std::back_inserter(line.openings),
                   on_line);
    std::transform(piece->gaps.begin(), piece->gaps.end(), std::back_inserter(line.gaps), on_line);
  }

  // The far end is that of the second piece
  line.corner[1] = b.corner[1];
  line.top_m = std::max(a.top_m, b.top_m);
  line.high = std::max(a.high, b.high);

  return line;
}

/// Lets an opening at the end of one of two pieces in line reach to the other piece, up to which there is no
/// wall either: its lintel was not seen there. False: neither has one.
bool fill_with_opening(WallLine& a, WallLine& b) {
  constexpr double kAtEnd_m = 0.1;
  const double a_end = a.s1, b_start = b.s0;
  for (WallOpening& opening : a.openings) {
    const double to = a.along().dot(b.at(b_start));
    if (std::abs(opening.s1 - a_end) > kAtEnd_m || to - opening.s0 > kWidestPassage_m) continue;
    opening.s1 = to;
    return true;
  }
  for (WallOpening& opening : b.openings) {
    const double from = b.along().dot(a.at(a_end));
    if (std::abs(opening.s0 - b_start) > kAtEnd_m || opening.s1 - from > kWidestPassage_m) continue;
    opening.s0 = from;
    return true;
  }
  return false;
}

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

/// Openings in a wall: runs of columns without surface that a door may have.
std::vector<WallOpening> openings_between(const WallRaster& raster, double s0, double s1, const Cut& cut) {
  constexpr int kBridge = 3;  // columns with a door's handle or the like

  // Runs of open columns, joined over handles
  std::vector<std::pair<int, int>> runs;
  for (int c = raster.column_of(s0); c <= raster.column_of(s1); ++c) {
    if (!open_column(raster, c, cut)) continue;
    if (!runs.empty() && c - runs.back().second <= kBridge) {
      runs.back().second = c;
    } else {
      runs.emplace_back(c, c);
    }
  }

  // Widths of doors only
  std::vector<WallOpening> openings;
  for (auto [a, b] : cut.rays_known ? split_where_unseen(raster, runs) : runs) {
    trim_hidden(raster, cut, a, b);
    const WallOpening opening{raster.start_of(a), raster.start_of(b + 1)};
    const double width = opening.s1 - opening.s0;
    const double widest = cut.rays_known ? kWidestPassage_m : kWidestDoor_m;
    if (width >= kNarrowestDoor_m && width <= widest && is_passage(raster, a, b, cut))
      openings.push_back(opening);
  }

  return openings;
}

/// Joins pieces of walls in line, over a door or a hidden part.
void bridge_gaps(std::vector<WallLine>& walls, std::vector<Fronts>& fronts, const Cut& cut) {
  constexpr double kLongest_m = 1.6;  // of wall that was hidden
  constexpr double kSameLine_m = 0.025;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (std::size_t j = 0; j < walls.size(); ++j) {
      WallLine& a = walls[i];
      WallLine& b = walls[j];
      if (i == j || a.corner[1] >= 0 || b.corner[0] >= 0 || a.normal.dot(b.normal) < 0.998) continue;

      // Pieces in line with a short gap
      const double from = a.along().dot(b.at(b.s0));
      const double gap = from - a.s1;
      if (gap <= 0.0 || gap > kWidestDoor_m || std::abs(a.normal.dot(b.at(b.s0)) - a.offset_m) > kSameLine_m)
        continue;

      // Cameras that saw through make it an opening
      const WallRaster& front = *fronts[i].last;
      const bool crossed = is_passage(front, front.column_at(a.at(a.s1)), front.column_at(b.at(b.s0)),
                                      {cut.at_m, cut.low_m, cut.high_m, true});
      const bool rest = crossed && gap < kNarrowestDoor_m && fill_with_opening(a, b);
      if (crossed ? gap < kNarrowestDoor_m && !rest : gap > kLongest_m) continue;

      // An opening, else hidden wall with its gaps
      if (!rest && (crossed || !cut.rays_known)) {
        a.openings.push_back(widened(front, a, {a.s1, from}, cut));
      } else if (!rest) {
        const std::vector<WallOpening> gaps = gaps_between(front, a.s1, from, cut);
        a.gaps.insert(a.gaps.end(), gaps.begin(), gaps.end());
      }
      a = joined_pieces(a, b);
      fronts[i].last = fronts[j].last;

      // Corners and numbers change with the walls
      walls.erase(walls.begin() + static_cast<std::ptrdiff_t>(j));
      fronts.erase(fronts.begin() + static_cast<std::ptrdiff_t>(j));
      join_corners(walls);
      i = static_cast<std::size_t>(-1);  // from the start: numbers have changed
      break;
    }
  }
}

std::vector<WallDoor> doors_of(std::vector<WallLine>& walls) {
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
          if (used[j][m] || behind < 0.0 || behind > kThickestWall_m || common < 0.5 * door.width_m) continue;

          // Both faces get the same opening
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

std::vector<WallDoor> doors_between_sides(const std::vector<WallLine>& walls,
                                          const std::vector<Fronts>& fronts, const Cut& cut) {
  std::vector<WallDoor> doors;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (std::size_t j = i + 1; j < walls.size(); ++j) {
      // Two faces of one wall
      const WallLine& a = walls[i];
      const WallLine& b = walls[j];
      const double behind = a.offset_m - a.normal.dot(b.at(0.5 * (b.s0 + b.s1)));
      if (a.normal.dot(b.normal) > -0.998 || behind < 0.0 || behind > kThickestWall_m) continue;

      // The other side runs backwards, so that its ends in the gap have equal numbers.
      for (std::size_t end = 0; end < 2; ++end) {
        if (a.corner[end] >= 0 || b.corner[end] >= 0) continue;
        const Eigen::Vector2d jamb = a.at(end == 0 ? a.s0 : a.s1);
        const Eigen::Vector2d far = b.at(end == 0 ? b.s0 : b.s1);
        const double gap = (end == 0 ? -1.0 : 1.0) * a.along().dot(far - jamb);
        if (gap < kNarrowestDoor_m || gap > kWidestDoor_m) continue;

        const auto is_open = [&](const WallRaster& front) {
          const int c0 = front.column_at(jamb), c1 = front.column_at(far);
          return is_passage(front, std::min(c0, c1), std::max(c0, c1), cut);
        };
        const auto front_of = [&](std::size_t wall) {
          return end == 0 ? fronts[wall].first : fronts[wall].last;
        };
        if (!is_open(*front_of(i)) || !is_open(*front_of(j))) continue;
        const Eigen::Vector2d across = (a.normal.dot(far) - a.offset_m) * a.normal;
        doors.push_back({{jamb, far - across}, {jamb + across, far}, gap});
      }
    }
  }

  return doors;
}

/// Finds the wall's other face for openings that were seen from one side only.
void find_far_sides(const std::vector<WallLine>& walls, std::vector<WallDoor>& doors) {
  constexpr double kThinnest_m = 0.03;
  constexpr double kBeside_m = 0.3;
  for (WallDoor& door : doors) {
    // The far side is behind the jambs
    const Eigen::Vector2d along = (door.jambs[1] - door.jambs[0]).normalized();
    const Eigen::Vector2d behind(-along.y(), along.x());

    if ((door.far_jambs[0] - door.jambs[0]).norm() > kThinnest_m) continue;
    double nearest = kThickestWall_m;

    // The nearest face that points away
    for (const WallLine& wall : walls) {
      const double distance = behind.dot(wall.at(0.5 * (wall.s0 + wall.s1)) - door.jambs[0]);
      if (wall.normal.dot(behind) < 0.99 || distance < kThinnest_m || distance > nearest) continue;
      const double first = along.dot(wall.at(wall.s1) - door.jambs[0]);  // it runs backwards
      const double last = along.dot(wall.at(wall.s0) - door.jambs[0]);
      if (first > door.width_m + kBeside_m || last < -kBeside_m) continue;

      // Its line gives the depth at each jamb
      nearest = distance;
      for (std::size_t k = 0; k < 2; ++k) {
        const double off = wall.normal.dot(door.jambs[k]) - wall.offset_m;
        door.far_jambs[k] = door.jambs[k] - off * wall.normal;
      }
    }
  }
}

/// The line across an opening, as if it were a wall.
WallLine closing_of(const WallDoor& door) {
  const Eigen::Vector2d along = (door.jambs[1] - door.jambs[0]).normalized();
  WallLine line;
  line.normal = {along.y(), -along.x()};
  line.offset_m = line.normal.dot(door.jambs[0]);
  line.s0 = along.dot(door.jambs[0]);
  line.s1 = along.dot(door.jambs[1]);
  return line;
}

namespace {

/// True if cameras looked through everywhere between two places of a wall: where they did not, there may be
/// wall.
bool is_looked_through(const WallRaster& front, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                       const Cut& cut) {
  const int first = front.column_at(from), last = front.column_at(to);
  int unseen = 0;
  for (int c = first; c <= last && unseen <= kLongestUnseen; ++c) {
    const bool open = open_column(front, c, cut) && front.crossed(c, 0.3, 1.9) >= kLeastCrossedColumn;
    unseen = open ? 0 : unseen + 1;
  }
  return unseen <= kLongestUnseen && is_passage(front, first, last, cut);
}

/// True if the end of a wall's face is beside a door of that wall.
bool is_at_door(const WallLine& wall, const Eigen::Vector2d& end, const std::vector<WallDoor>& doors) {
  constexpr double kBeside_m = 0.3;
  return std::any_of(doors.begin(), doors.end(), [&](const WallDoor& door) {
    const Eigen::Vector2d along = (door.jambs[1] - door.jambs[0]).normalized();
    const double s = along.dot(end - door.jambs[0]);
    return s > -kBeside_m && s < door.width_m + kBeside_m && std::abs(wall.normal.dot(along)) < 0.1 &&
           std::abs(wall.normal.dot(end - door.jambs[0])) < kThickestWall_m;
  });
}

/// Distance to the next wall on the way, if that is nearer than `farthest` and its face looks this way; else
/// nothing.
std::optional<double> way_to_face(const Eigen::Vector2d& from, const Eigen::Vector2d& way,
                                  const std::vector<WallLine>& walls, double farthest) {
  constexpr double kNearest_m = 0.1, kLeastTurn = 0.5, kBeside_m = 0.15;
  bool meets = false;
  for (const WallLine& other : walls) {
    const double turn = other.normal.dot(way);
    if (std::abs(turn) < kLeastTurn) continue;
    const double distance = (other.offset_m - other.normal.dot(from)) / turn;
    const double s = other.along().dot(from + distance * way);
    if (distance < -kNearest_m || distance > farthest || s < other.s0 - kBeside_m || s > other.s1 + kBeside_m)
      continue;

    farthest = distance;
    meets = turn < 0.0;
  }

  if (!meets || farthest < kNearest_m) return std::nullopt;
  return farthest;
}

}  // namespace

/// Openings between a free end of a wall and the next wall on its way.
std::vector<WallDoor> doors_at_free_ends(const std::vector<WallLine>& walls,
                                         const std::vector<WallDoor>& doors) {
  constexpr double kFarthest_m = 1.7;
  constexpr double kFarthestMet_m = 2.5;  // of a wall whose other end meets one
  std::vector<WallDoor> found;
  for (const WallLine& wall : walls) {
    for (std::size_t end = 0; end < 2; ++end) {
      if (wall.corner[end] >= 0) continue;

      // A wall with one corner is surely a wall, so it may reach further
      const Eigen::Vector2d from = wall.at(end == 0 ? wall.s0 : wall.s1);
      const Eigen::Vector2d way = end == 0 ? Eigen::Vector2d(-wall.along()) : wall.along();
      const auto distance =
          way_to_face(from, way, walls, wall.corner[1 - end] >= 0 ? kFarthestMet_m : kFarthest_m);
      if (!distance || is_at_door(wall, from, doors)) continue;

      // Jambs in the wall's direction
      const Eigen::Vector2d to = from + *distance * way;
      WallDoor door;
      door.jambs = {end == 0 ? to : from, end == 0 ? from : to};
      door.far_jambs = door.jambs;
      door.width_m = *distance;
      found.push_back(door);
    }
  }

  return found;
}

/// Openings wider than doors between two faces that lie on one line and end there, if not at a jamb.
std::vector<WallDoor> passages_in_line(const std::vector<WallLine>& walls, const std::vector<Fronts>& fronts,
                                       const Cut& cut, const std::vector<WallDoor>& doors) {
  constexpr double kSameLine_m = 0.025;
  const auto ends_there = [&](const WallLine& wall, std::size_t end) {
    return wall.corner[end] < 0 ||
           walls[static_cast<std::size_t>(wall.corner[end])].length() < kThickestWall_m;
  };
  std::vector<WallDoor> found;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (std::size_t j = 0; j < walls.size(); ++j) {
      const WallLine &a = walls[i], &b = walls[j];
      if (i == j || !ends_there(a, 1) || !ends_there(b, 0) || a.normal.dot(b.normal) < 0.998) continue;

      // Ends of both that look at each other
      const Eigen::Vector2d from = a.at(a.s1), to = b.at(b.s0);
      const double gap = a.along().dot(to - from);
      if (gap <= kWidestDoor_m || gap > kWidestPassage_m || is_at_door(a, from, doors) ||
          std::abs(a.normal.dot(to - from)) > kSameLine_m ||
          !is_looked_through(*fronts[i].last, from, to, cut))
        continue;

      WallDoor door;
      door.jambs = {from, to};
      door.far_jambs = door.jambs;
      door.width_m = gap;
      found.push_back(door);
    }
  }
  return found;
}

}  // namespace plumbline::plans
