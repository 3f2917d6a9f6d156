// SPDX-License-Identifier: BSD-3-Clause
// Leaves of doors that stand open, and windows.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "opening_points.hpp"
#include "wall_steps.hpp"

namespace plumbline::plans {
namespace {

/// A point that stands upright beside an opening and is no wall: place and normal along and in front of it.
struct Upright {
  Eigen::Vector2d at, normal;
  double z;
};

/// Points next to the opening that may belong to a leaf: upright, at its height and not on a wall.
std::vector<Upright> upright_beside(const NearPoints& points, const WallDoor& door,
                                    const std::vector<WallLine>& walls) {
  constexpr double kAtWall_m = 0.045;
  const Eigen::Vector2d along = (door.jambs[1] - door.jambs[0]).normalized();
  const Eigen::Vector2d front(along.y(), -along.x());
  std::vector<Upright> found;

  // Outside the thickness of the wall that has the door
  for (std::size_t i = 0; i < points.places.size(); ++i) {
    const Eigen::Vector3d& p = points.places[i];
    const Eigen::Vector3d& n = points.normals[i];
    if (std::abs(n.z()) > 0.4 || p.z() < 0.3 || p.z() > 1.8 ||
        (p.y() < kAtWall_m && p.y() > -door.depth_m() - kAtWall_m))
      continue;

    // Other walls near by are not leaves
    const Eigen::Vector2d place = door.jambs[0] + p.x() * along + p.y() * front;
    const bool at_wall = std::any_of(walls.begin(), walls.end(), [&](const WallLine& wall) {
      const double s = wall.along().dot(place);
      return std::abs(wall.normal.dot(place) - wall.offset_m) < kAtWall_m && s > wall.s0 - 0.1 &&
             s < wall.s1 + 0.1;
    });
    if (!at_wall) found.push_back({p.head<2>(), n.head<2>(), p.z()});
  }
  return found;
}

/// Share of a leaf's width that something upright fills at an angle from a hinge; 0 where it goes on behind.
double filled_share(const std::vector<Upright>& points, const Eigen::Vector2d& hinge,
                    const Eigen::Vector2d& way, double width) {
  constexpr double kBin_m = 0.05, kOff_m = 0.05, kLeastTall_m = 0.7;
  constexpr std::size_t kMostBins = 32;
  std::array<std::pair<double, double>, kMostBins> heights;
  heights.fill({1e300, -1e300});
  const Eigen::Vector2d across(-way.y(), way.x());

  // Range of heights in each bin along the leaf
  for (const Upright& p : points) {
    const double r = way.dot(p.at - hinge);
    if (r < 0.0 || r >= kMostBins * kBin_m || std::abs(across.dot(p.at - hinge)) > kOff_m ||
        std::abs(across.dot(p.normal)) < 0.9)
      continue;
    auto& [low, high] = heights[static_cast<std::size_t>(r / kBin_m)];
    low = std::min(low, p.z);
    high = std::max(high, p.z);
  }

  // Something longer than the leaf's width is no leaf
  double filled = 0.0, all = 0.0, beyond = 0.0;
  for (std::size_t i = 0; i < kMostBins; ++i) {
    const double r = (static_cast<double>(i) + 0.5) * kBin_m;
    const double here = heights[i].second - heights[i].first > kLeastTall_m ? 1.0 : 0.0;
    if (r > 0.1 && r < width - 0.05) filled += here, all += 1.0;
    if (r > width + 0.08 && r < width + 0.3) beyond += here;
  }
  return beyond > 1.0 || all == 0.0 ? 0.0 : filled / all;
}

/// Height up to which, or above which, wall is seen in the opening; nothing: it is not.
std::optional<double> edge_of(const NearPoints& points, const WallDoor& door, double cut_m, bool below) {
  constexpr double kFace_m = 0.03;
  std::vector<double> level, face;
  for (std::size_t i = 0; i < points.places.size(); ++i) {
    const Eigen::Vector3d& p = points.places[i];
    const Eigen::Vector3d& n = points.normals[i];
    if (p.x() < 0.05 || p.x() > door.width_m - 0.05 || (p.z() < cut_m) != below || p.z() < 0.05) continue;
    if ((below ? 1.0 : -1.0) * n.z() > 0.8 && p.y() < 0.0 && p.y() > -0.3) level.push_back(p.z());
    if (n.y() > 0.8 && std::abs(p.y()) < kFace_m) face.push_back(below ? p.z() : -p.z());
  }
  if (const auto edge = main_place(level)) return edge;
  if (face.size() < 100) return std::nullopt;
  const auto last = face.begin() + static_cast<std::ptrdiff_t>(face.size() - face.size() / 50);
  std::nth_element(face.begin(), last - 1, face.end());
  return below ? *(last - 1) : -*(last - 1);
}

}  // namespace

void find_leaves(const cloud::Cloud& cloud, double floor_m, const std::vector<WallLine>& walls,
                 std::vector<WallDoor>& doors) {
  constexpr double kLeastFilled = 0.7, kWidest_m = 1.3;
  constexpr int kStep_deg = 2, kFirst_deg = 16, kLast_deg = 170;

  for (WallDoor& door : doors) {
    if (door.kind != OpeningKind::kDoor || door.width_m > kWidest_m) continue;

    // Points within the reach of the leaf
    const auto points = upright_beside(points_near(cloud, floor_m, door, door.width_m + 0.3), door, walls);
    double best = kLeastFilled;

    // Both hinges, both sides, all angles
    for (int hinge = 0; hinge < 2; ++hinge) {
      for (const bool front : {true, false}) {
        const Eigen::Vector2d at(hinge == 0 ? 0.0 : door.width_m, front ? 0.0 : -door.depth_m());
        for (int degrees = kFirst_deg; degrees <= kLast_deg; degrees += kStep_deg) {
          const double angle = degrees * M_PI / 180.0;
          const Eigen::Vector2d way((hinge == 0 ? 1.0 : -1.0) * std::cos(angle),
                                    (front ? 1.0 : -1.0) * std::sin(angle));

          const double filled = filled_share(points, at, way, door.width_m);
          if (filled <= best) continue;
          best = filled;
          door.hinge = hinge;
          door.opens_front = front;
        }
      }
    }
  }
}

std::vector<WallDoor> windows_of(const cloud::Cloud& cloud, double floor_m, double cut_m,
                                 std::vector<WallLine>& walls) {
  constexpr double kLowestSill_m = 0.05;
  std::vector<WallDoor> windows;

  for (WallLine& wall : walls) {
    for (WallOpening& gap : wall.gaps) {
      if (gap.to_floor) continue;
      WallDoor window;
      window.kind = OpeningKind::kWindow;
      window.jambs = {wall.at(gap.s0), wall.at(gap.s1)};
      window.far_jambs = window.jambs;
      window.width_m = gap.s1 - gap.s0;
      const NearPoints points = points_near(cloud, floor_m, window);
      measure_jambs(points, window);

      // A hole in the wall has edges; a screen on it has none that look into it.
      const auto sill = edge_of(points, window, cut_m, true), head = edge_of(points, window, cut_m, false);
      if ((!window.jamb_seen[0] && !window.jamb_seen[1]) || !sill || *sill < kLowestSill_m) continue;
      window.sill_m = *sill;
      window.head_m = head.value_or(0.0);

      // The same window seen from the wall's other face
      const Eigen::Vector2d middle = 0.5 * (window.jambs[0] + window.jambs[1]);
      const bool again = std::any_of(windows.begin(), windows.end(), [&](const WallDoor& other) {
        return (0.5 * (other.jambs[0] + other.jambs[1]) - middle).norm() < kThickestWall_m;
      });
      gap = {wall.along().dot(window.jambs[0]), wall.along().dot(window.jambs[1])};
      if (!again) windows.push_back(window);
    }
  }

  find_far_sides(walls, windows);
  return windows;
}

void cut_walls_at(const std::vector<WallDoor>& openings, std::vector<WallLine>& walls) {
  constexpr double kSquare = 0.05, kOff_m = 0.04, kEnd_m = 0.3;
  for (const WallDoor& door : openings) {
    const Eigen::Vector2d way = (door.jambs[1] - door.jambs[0]).normalized();
    for (WallLine& wall : walls) {
      const bool on_near = std::abs(wall.normal.dot(door.jambs[0]) - wall.offset_m) < kOff_m;
      const bool on_far = std::abs(wall.normal.dot(door.far_jambs[0]) - wall.offset_m) < kOff_m;
      if (std::abs(wall.normal.dot(way)) > kSquare || (!on_near && !on_far)) continue;
      double s0 = wall.along().dot(door.jambs[0]), s1 = wall.along().dot(door.jambs[1]);
      if (s0 > s1) std::swap(s0, s1);

      // An end in the opening, or a little before it, is at the jamb.
      if (wall.corner[1] < 0 && wall.s1 > s0 - kEnd_m && wall.s1 < s1 && wall.s0 < s0) wall.s1 = s0;
      if (wall.corner[0] < 0 && wall.s0 < s1 + kEnd_m && wall.s0 > s0 && wall.s1 > s1) wall.s0 = s1;

      // The opening replaces those that were found before
      for (auto* parts : {&wall.openings, &wall.gaps}) {
        parts->erase(std::remove_if(parts->begin(), parts->end(),
                                    [&](const WallOpening& part) {
                                      return std::min(part.s1, s1) - std::max(part.s0, s0) >
                                                 0.5 * (part.s1 - part.s0) ||
                                             std::min(part.s1, s1) - std::max(part.s0, s0) > 0.5 * (s1 - s0);
                                    }),
                     parts->end());
      }

      auto& parts = door.kind == OpeningKind::kWindow ? wall.gaps : wall.openings;
      if (s1 > wall.s0 && s0 < wall.s1) parts.push_back({std::max(s0, wall.s0), std::min(s1, wall.s1)});
      std::sort(parts.begin(), parts.end(),
                [](const WallOpening& a, const WallOpening& b) { return a.s0 < b.s0; });
    }
  }
}

}  // namespace plumbline::plans
