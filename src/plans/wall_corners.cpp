// SPDX-License-Identifier: BSD-3-Clause
// Ends of walls meet where their lines cross.
#include <algorithm>
#include <cmath>

#include "wall_steps.hpp"

namespace plumbline::plans {
namespace {

/// True if the two are seen from one side: each stands in front of the other, or each behind it.
bool make_a_corner(const WallLine& a, const WallLine& b) {
  const bool b_before = a.normal.dot(b.at(0.5 * (b.s0 + b.s1))) > a.offset_m;
  const bool a_before = b.normal.dot(a.at(0.5 * (a.s0 + a.s1))) > b.offset_m;
  return a_before == b_before;
}

constexpr double kCornerReach_m = 0.3;

/// A possible corner, or a face that an end meets.
struct Meeting {
  double distance;
  std::size_t wall;
  int end;
  std::size_t other;
  int other_end;  // 2: the face
  double s;
  double other_s;
};

/// Adds what ends of wall i meet at the place where its line crosses that of wall j.
void add_meetings(const std::vector<WallLine>& walls, std::size_t i, std::size_t j,
                  std::vector<Meeting>& meetings) {
  constexpr double kBeyond_m = 0.08;  // that a wall was seen beyond its corner, by noise
  constexpr double kLeastTurn = 0.5;  // sine of 30 degrees
  Eigen::Matrix2d normals;
  normals.row(0) = walls[i].normal.transpose();
  normals.row(1) = walls[j].normal.transpose();
  if (i == j || std::abs(normals.determinant()) < kLeastTurn) return;

  // Both lines at their crossing
  const Eigen::Vector2d at = normals.inverse() * Eigen::Vector2d(walls[i].offset_m, walls[j].offset_m);
  const double s = walls[i].along().dot(at);
  const double t = walls[j].along().dot(at);

  // Ends near the crossing
  for (int end = 0; end < 2; ++end) {
    const double more = end == 0 ? walls[i].s0 - s : s - walls[i].s1;  // that the wall is longer
    const double off = std::abs(more);
    if (more > kCornerReach_m || more < -kBeyond_m) continue;
    for (int other = 0; other < 2; ++other) {
      const double other_more = other == 0 ? walls[j].s0 - t : t - walls[j].s1;
      if (other_more <= kCornerReach_m && other_more >= -kBeyond_m && make_a_corner(walls[i], walls[j]))
        meetings.push_back({off + std::abs(other_more), i, end, j, other, s, t});
    }

    // An end before the face of a wall is the second choice; behind it, the wall's other face would be met
    const Eigen::Vector2d middle = walls[i].at(0.5 * (walls[i].s0 + walls[i].s1));
    const bool before = walls[j].normal.dot(middle) > walls[j].offset_m;
    if (before && t > walls[j].s0 + kCornerReach_m && t < walls[j].s1 - kCornerReach_m)
      meetings.push_back({off + 2.0 * kCornerReach_m, i, end, j, 2, s, t});
  }
}

/// Moves the ends of a meeting to the crossing, unless one of them is at a corner already.
void join_at(const Meeting& m, std::vector<WallLine>& walls) {
  WallLine& wall = walls[m.wall];
  WallLine& other = walls[m.other];
  if (wall.corner[static_cast<std::size_t>(m.end)] >= 0) return;
  if (m.other_end < 2 && other.corner[static_cast<std::size_t>(m.other_end)] >= 0) return;

  // The wall's end
  wall.corner[static_cast<std::size_t>(m.end)] = static_cast<int>(m.other);
  wall.corner_end[static_cast<std::size_t>(m.end)] = m.other_end;
  (m.end == 0 ? wall.s0 : wall.s1) = m.s;
  if (m.other_end == 2) return;

  // The other's end, unless its face was met
  other.corner[static_cast<std::size_t>(m.other_end)] = static_cast<int>(m.wall);
  other.corner_end[static_cast<std::size_t>(m.other_end)] = m.end;
  (m.other_end == 0 ? other.s0 : other.s1) = m.other_s;
}

}  // namespace

/// Joins ends of walls that meet: with an end of another wall, or with its face.
void join_corners(std::vector<WallLine>& walls) {
  for (WallLine& wall : walls) {
    wall.corner = {-1, -1};
    wall.corner_end = {0, 0};
  }

  // Meetings of all pairs that are not parallel
  std::vector<Meeting> meetings;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (std::size_t j = 0; j < walls.size(); ++j) add_meetings(walls, i, j, meetings);
  }

  // The nearest meetings are taken first
  std::stable_sort(meetings.begin(), meetings.end(),
                   [](const Meeting& a, const Meeting& b) { return a.distance < b.distance; });
  for (const Meeting& m : meetings) join_at(m, walls);
}

/// Extends free ends to walls of which the part that they meet is hidden.
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

      // The nearest line within reach
      for (const WallLine& other : all) {
        const double turn = other.normal.dot(wall.along());
        if (std::abs(turn) < kLeastTurn || other.length() < kShortest_m) continue;

        // Distances to the crossing, and to the wall's visible end
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

}  // namespace plumbline::plans
