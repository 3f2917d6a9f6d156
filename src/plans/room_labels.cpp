// SPDX-License-Identifier: BSD-3-Clause
// Rooms: labels of cells as inside or outside, found by a minimum cut.
#include <algorithm>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>

#include "room_cells.hpp"

namespace plumbline::plans {
namespace {

using CutTraits = boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>;
using CutGraph = boost::adjacency_list<
    boost::vecS, boost::vecS, boost::directedS,
    boost::property<boost::vertex_index_t, long,
                    boost::property<boost::vertex_color_t, boost::default_color_type,
                                    boost::property<boost::vertex_distance_t, long,
                                                    boost::property<boost::vertex_predecessor_t,
                                                                    CutTraits::edge_descriptor>>>>,
    boost::property<boost::edge_capacity_t, double,
                    boost::property<boost::edge_residual_capacity_t, double,
                                    boost::property<boost::edge_reverse_t, CutTraits::edge_descriptor>>>>;

/// A pair of edges in both directions, as the maximum flow needs them.
void add_link(CutGraph& graph, std::size_t from, std::size_t to, double there, double back) {
  const auto forth = boost::add_edge(from, to, graph).first;
  const auto reverse = boost::add_edge(to, from, graph).first;
  boost::put(boost::edge_capacity, graph, forth, there);
  boost::put(boost::edge_capacity, graph, reverse, back);
  boost::put(boost::edge_reverse, graph, forth, reverse);
  boost::put(boost::edge_reverse, graph, reverse, forth);
}

double length_of(const PlanSegment& segment) { return (segment[1] - segment[0]).norm(); }

/// Walls whose faces look to the left of a segment, or to its right.
std::vector<WallLine> walls_facing(const std::vector<WallLine>& walls, const PlanSegment& segment,
                                   bool left) {
  constexpr double kLeast = 0.9;
  const Eigen::Vector2d way = (segment[1] - segment[0]).normalized();
  std::vector<WallLine> facing;
  std::copy_if(walls.begin(), walls.end(), std::back_inserter(facing), [&](const WallLine& wall) {
    const double turn = way.x() * wall.normal.y() - way.y() * wall.normal.x();
    return (left ? turn : -turn) > kLeast;
  });
  return facing;
}

/// Parts of a segment, with a room on its left, behind which only the other side of the wall was seen.
std::vector<WallOpening> parts_before_far_sides(const PlanSegment& side, const std::vector<WallLine>& walls) {
  constexpr double kMiddle_m = 0.24;  // of the distances of far sides
  const Eigen::Vector2d along = (side[1] - side[0]).normalized();
  const Eigen::Vector2d out = kMiddle_m * Eigen::Vector2d(along.y(), -along.x());
  return walled_parts({side[0] + out, side[1] + out}, walls_facing(walls, side, false), {},
                      kMiddle_m - 0.025);
}

double total_of(const std::vector<WallOpening>& parts) {
  return std::accumulate(parts.begin(), parts.end(), 0.0,
                         [](double sum, const WallOpening& part) { return sum + part.s1 - part.s0; });
}

/// Share of a border along which there is a wall.
std::vector<double> walled_shares(const std::vector<CellBorder>& borders, const std::vector<WallLine>& walls,
                                  const std::vector<PlanOutline>& openings) {
  std::vector<double> shares;
  for (const CellBorder& border : borders) {
    shares.push_back(total_of(walled_parts(border.ends, walls, openings)));
  }
  return shares;
}

/// Metres of walls that have each cell behind them, less than a wall's thickness away.
std::vector<double> metres_before(const std::vector<RoomCell>& cells, const std::vector<CellBorder>& borders,
                                  const std::vector<WallLine>& walls) {
  std::vector<double> metres(cells.size(), 0.0);
  for (const CellBorder& border : borders) {
    for (const bool left : {true, false}) {
      const auto parts = walled_parts(border.ends, walls_facing(walls, border.ends, left), {});
      metres[left ? border.b : border.a] += total_of(parts) * length_of(border.ends);
    }
  }
  return metres;
}

/// The cells that are inside: the labels for which the area that was looked through and lies outside, the
/// area that was not and lies inside, and the length of the limits without a wall cost least together.
std::vector<bool> inside_cells(const std::vector<RoomCell>& cells, const std::vector<CellBorder>& borders,
                               const std::vector<double>& walled, const std::vector<WallLine>& walls) {
  const std::vector<double> behind = metres_before(cells, borders, walls);
  constexpr double kBehind = 0.3;    // a metre of a wall that is before it, inside
  constexpr double kFree = 1.0;      // a square metre that was looked through, outside
  constexpr double kUnknown = 0.3;   // a square metre that was not, inside
  constexpr double kUnwalled = 0.3;  // a metre of a limit without wall
  constexpr double kBorder = 0.01;   // a metre of any limit
  const std::size_t source = cells.size(), sink = cells.size() + 1;

  // Costs of a cell's label
  CutGraph graph(cells.size() + 2);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const RoomCell& cell = cells[i];
    add_link(graph, source, i, cell.opening ? 0.0 : kFree * cell.free * cell.area_m2, 0.0);
    add_link(graph, i, sink,
             cell.opening ? 1e3 : kUnknown * (1.0 - cell.free) * cell.area_m2 + kBehind * behind[i], 0.0);
  }

  // Cost of a limit between inside and outside
  for (std::size_t k = 0; k < borders.size(); ++k) {
    const auto& [a, b, ends] = borders[k];
    if (cells[a].opening || cells[b].opening) continue;
    const auto cost = [&](const PlanSegment& side) {
      const double known = std::max(walled[k], total_of(parts_before_far_sides(side, walls)));
      return length_of(side) * (kBorder + kUnwalled * (1.0 - known));
    };

    add_link(graph, a, b, cost(ends), cost({ends[1], ends[0]}));
  }
  boost::boykov_kolmogorov_max_flow(graph, source, sink);

  // Cells on the source's side of the cut are inside
  std::vector<bool> inside(cells.size());
  const auto free = boost::color_traits<boost::default_color_type>::black();
  for (std::size_t i = 0; i < cells.size(); ++i)
    inside[i] = boost::get(boost::vertex_color, graph, i) == free;

  return inside;
}

/// Number of the room of each cell; -1: outside. Cells belong together where no wall is between them.
std::vector<int> room_numbers(const std::vector<RoomCell>& cells, const std::vector<CellBorder>& borders,
                              const std::vector<double>& walled, const std::vector<bool>& inside) {
  // Union-find over borders without a wall
  constexpr double kMostWalled = 0.5;
  std::vector<std::size_t> root(cells.size());
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];

    return i;
  };
  for (std::size_t k = 0; k < borders.size(); ++k) {
    const auto& [a, b, ends] = borders[k];
    if (inside[a] && inside[b] && walled[k] < kMostWalled)
      root[std::max(find(a), find(b))] = std::min(find(a), find(b));
  }

  // Rooms are numbered in the order of their cells
  std::map<std::size_t, int> numbers;
  std::vector<int> room(cells.size(), -1);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (inside[i]) room[i] = numbers.emplace(find(i), static_cast<int>(numbers.size())).first->second;
  }

  return room;
}

/// Limits of a room, each with the room on its left.
std::vector<PlanSegment> limits_of(int number, const std::vector<int>& room,
                                   const std::vector<CellBorder>& borders) {
  std::vector<PlanSegment> limits;
  for (const auto& [a, b, ends] : borders) {
    if ((room[a] == number) == (room[b] == number)) continue;
    limits.push_back(room[a] == number ? ends : PlanSegment{ends[1], ends[0]});
  }
  return limits;
}

/// Joins limits to closed outlines; at a place where two meet, the way turns left, so that outlines are
/// simple.
std::vector<PlanOutline> outlines_of(const std::vector<PlanSegment>& limits) {
  constexpr double kSame_m = 2e-5;
  std::vector<bool> used(limits.size(), false);
  std::vector<PlanOutline> outlines;

  // A closed walk from every limit that is left
  for (std::size_t first = 0; first < limits.size(); ++first) {
    if (used[first]) continue;
    PlanOutline outline;
    std::size_t at = first;

    while (!used[at]) {
      used[at] = true;
      outline.push_back(limits[at][0]);

      // The sharpest left turn at the end of the limit
      const Eigen::Vector2d way = limits[at][1] - limits[at][0];
      double sharpest = -10.0;
      std::size_t next = limits.size();
      for (std::size_t k = 0; k < limits.size(); ++k) {
        if (used[k] && k != first) continue;
        if ((limits[k][0] - limits[at][1]).norm() > kSame_m) continue;

        // Its angle to the limit before
        const Eigen::Vector2d on = limits[k][1] - limits[k][0];
        const double turn = std::atan2(way.x() * on.y() - way.y() * on.x(), way.dot(on));
        if (turn <= sharpest) continue;
        sharpest = turn;
        next = k;
      }
      if (next == limits.size()) break;
      at = next;
    }

    // Two corners enclose no area
    if (outline.size() >= 3) outlines.push_back(std::move(outline));
  }
  return outlines;
}

/// Drops corners at which an outline goes straight on.
void straighten(PlanOutline& outline) {
  constexpr double kOff_m = 1e-4;
  for (std::size_t i = 0; i < outline.size() && outline.size() > 3;) {
    const Eigen::Vector2d& before = outline[(i + outline.size() - 1) % outline.size()];
    const Eigen::Vector2d side = (outline[(i + 1) % outline.size()] - before).normalized();
    const Eigen::Vector2d way = outline[i] - before;
    if (std::abs(side.x() * way.y() - side.y() * way.x()) > kOff_m) {
      ++i;
      continue;
    }
    outline.erase(outline.begin() + static_cast<std::ptrdiff_t>(i));
    i = i > 0 ? i - 1 : 0;
  }
}

/// Walls of a plan, what is assumed to be closed, and the outlines of openings.
struct RoomWalls {
  const std::vector<WallLine>& walls;
  const std::vector<WallLine>& closings;
  const std::vector<PlanOutline>& openings;
};

/// A part of an outline's side, as shares of it.
struct SidePart {
  double from, to;
  RoomSide kind;
};

/// Parts of a side: walls, gaps that a closing or the other side of the wall explains, and the rest.
std::vector<SidePart> side_parts(const PlanSegment& side, const RoomWalls& of) {
  constexpr double kNone_m = 0.03;
  const double length = length_of(side);
  std::vector<SidePart> parts;

  // Each part that is found leaves a rest for the next kind
  const auto fill = [&](const std::vector<WallOpening>& found, double from, double to, RoomSide kind,
                        const auto& rest) {
    for (const WallOpening& part : found) {
      const double s0 = std::max(part.s0, from), s1 = std::min(part.s1, to);
      if ((s1 - s0) * length < kNone_m) continue;
      if ((s0 - from) * length > kNone_m) {
        rest(from, s0);
        from = s0;
      }

      // A rest that is too short belongs to this part
      const double end = (to - s1) * length > kNone_m ? s1 : to;
      parts.push_back({from, end, kind});
      from = end;
    }

    if ((to - from) * length > 1e-6) rest(from, to);
  };

  // Walls explain a part first, then closings, then far sides
  const auto closed = walled_parts(side, of.closings, {});
  const auto behind = parts_before_far_sides(side, of.walls);
  const auto limit = [&](double from, double to) { parts.push_back({from, to, RoomSide::kLimit}); };
  const auto explained = [&](double from, double to) { fill(behind, from, to, RoomSide::kGap, limit); };
  const auto open = [&](double from, double to) { fill(closed, from, to, RoomSide::kGap, explained); };

  fill(walled_parts(side, of.walls, of.openings), 0.0, 1.0, RoomSide::kWall, open);
  return parts;
}

/// Cuts the outline where walls end, and tells what is along each side. Limits that are short are gaps.
void name_sides(const RoomWalls& of, WallRoom& room) {
  constexpr double kLongestGap_m = 0.6;

  // One corner at each end of a wall
  PlanOutline corners;
  for (std::size_t i = 0; i < room.outline.size(); ++i) {
    const PlanSegment side{room.outline[i], room.outline[(i + 1) % room.outline.size()]};
    for (const SidePart& part : side_parts(side, of)) {
      corners.emplace_back(side[0] + part.from * (side[1] - side[0]));
      room.sides.push_back(part.kind);
    }
  }

  room.outline = std::move(corners);

  // Begins at a side that is no limit, so that no run is split
  const std::size_t count = room.sides.size();
  const auto other = std::find_if(room.sides.begin(), room.sides.end(),
                                  [](RoomSide side) { return side != RoomSide::kLimit; });
  const auto begin = static_cast<std::size_t>(other == room.sides.end() ? 0 : other - room.sides.begin());

  // A short run is a gap in the walls
  for (std::size_t k = 0; k < count;) {
    double gap_m = 0.0;
    std::size_t end = k;
    for (; end < count && room.sides[(begin + end) % count] == RoomSide::kLimit; ++end)
      gap_m += (room.outline[(begin + end + 1) % count] - room.outline[(begin + end) % count]).norm();

    if (gap_m > kLongestGap_m) {
      room.closed = false;
    } else {
      for (std::size_t j = k; j < end; ++j) room.sides[(begin + j) % count] = RoomSide::kGap;
    }
    k = std::max(end, k + 1);
  }
}

/// The place inside that is farthest from the outline and from holes, of a grid.
Eigen::Vector2d label_place_in(const std::vector<PlanOutline>& rings) {
  constexpr int kSteps = 24;
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : rings.front()) box.extend(p);
  Eigen::Vector2d best = box.center();
  double farthest = -1.0;

  // Middles of a grid over the room
  for (int k = 0; k < kSteps * kSteps; ++k) {
    const Eigen::Array2d part((k % kSteps + 0.5) / kSteps, (k / kSteps + 0.5) / kSteps);
    const Eigen::Vector2d place = box.min().array() + part * box.sizes().array();
    if (!is_inside(rings.front(), place)) continue;
    double distance = 1e300;

    // Distance to the nearest ring; places in a hole do not count
    for (const PlanOutline& ring : rings) {
      if (&ring != &rings.front() && is_inside(ring, place)) distance = -1.0;
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Eigen::Vector2d side = ring[(i + 1) % ring.size()] - ring[i];
        const double t = std::clamp(side.dot(place - ring[i]) / side.squaredNorm(), 0.0, 1.0);
        distance = std::min(distance, (place - ring[i] - t * side).norm());
      }
    }

    // The first of equal places stays
    if (distance <= farthest + 1e-9) continue;
    farthest = distance;
    best = place;
  }

  return best;
}

/// True if it is a room: a camera was in it, or it is walled for the most part.
bool is_room(const WallRoom& room, const FreeSpace& space) {
  constexpr double kSmallest_m2 = 0.8;
  constexpr double kLeastWalled = 0.25;
  if (room.area_m2 < kSmallest_m2) return false;
  double walled_m = 0.0;
  for (std::size_t i = 0; i < room.sides.size(); ++i) {
    if (room.sides[i] == RoomSide::kWall)
      walled_m += (room.outline[(i + 1) % room.outline.size()] - room.outline[i]).norm();
  }
  const auto& cameras = space.cameras();
  const bool entered = std::any_of(cameras.begin(), cameras.end(), [&](const Eigen::Vector2d& place) {
    return is_inside(room.outline, place);
  });
  return walled_m > (entered ? kLeastWalled : 0.6) * room.perimeter_m();
}

}  // namespace

double WallRoom::perimeter_m() const {
  double sum = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i)
    sum += (outline[(i + 1) % outline.size()] - outline[i]).norm();
  return sum;
}

/// Rooms as connected cells that are inside, the largest first.
std::vector<WallRoom> rooms_in(const Eigen::AlignedBox2d& box, const std::vector<WallLine>& walls,
                               const std::vector<WallLine>& closings, const std::vector<WallDoor>& doors,
                               const FreeSpace& space) {
  const std::vector<PlanOutline> openings = openings_of(doors);
  std::vector<WallLine> all = walls;
  all.insert(all.end(), closings.begin(), closings.end());
  const std::vector<RoomCell> cells = cells_of(box, all, openings, space);
  const std::vector<CellBorder> borders = borders_of(cells);

  // Labels of the cells
  const std::vector<double> walled = walled_shares(borders, all, openings);
  const std::vector<bool> inside = inside_cells(cells, borders, walled, walls);
  const std::vector<int> room_of = room_numbers(cells, borders, walled, inside);

  // Outline of each room, without needless corners
  std::vector<WallRoom> rooms;
  const int count = room_of.empty() ? 0 : *std::max_element(room_of.begin(), room_of.end()) + 1;
  for (int number = 0; number < count; ++number) {
    std::vector<PlanOutline> rings = outlines_of(limits_of(number, room_of, borders));
    if (rings.empty()) continue;
    for (PlanOutline& ring : rings) straighten(ring);
    std::stable_sort(rings.begin(), rings.end(),
                     [](const PlanOutline& a, const PlanOutline& b) { return area_of(a) > area_of(b); });

    // Connected cells that are no room are dropped
    WallRoom room;
    room.outline = rings.front();
    room.area_m2 = area_of(room.outline);
    name_sides({walls, closings, openings}, room);
    if (!is_room(room, space)) continue;
    room.label = label_place_in(rings);
    rooms.push_back(std::move(room));
  }

  // Rooms are numbered by area
  std::stable_sort(rooms.begin(), rooms.end(),
                   [](const WallRoom& a, const WallRoom& b) { return a.area_m2 > b.area_m2; });
  return rooms;
}

}  // namespace plumbline::plans
