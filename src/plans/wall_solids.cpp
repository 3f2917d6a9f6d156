// SPDX-License-Identifier: BSD-3-Clause
// Walls as solids: what lies behind their faces.
#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <cmath>

#include "wall_steps.hpp"

namespace plumbline::plans {
namespace {

namespace bg = boost::geometry;
using SolidPoint = bg::model::d2::point_xy<double>;
using SolidPolygon = bg::model::polygon<SolidPoint, false>;  // counter-clockwise
using SolidArea = bg::model::multi_polygon<SolidPolygon>;

constexpr double kSolidStep_m =
    1e-4;  ///< coordinates are whole numbers of it, so that sides that meet are equal

/// A part of a face with one thickness behind it; 0: the other face was not seen.
struct SolidPart {
  double s0, s1, thickness;
};

/// A face's distance from the next one behind it along its line, between the places where that changes.
std::vector<SolidPart> thickness_along(const WallLine& wall, const std::vector<WallLine>& walls, double s0,
                                       double s1) {
  constexpr double kThinnest_m = 0.02;
  std::vector<SolidPart> behind;
  std::vector<double> cuts{s0, s1};

  // Faces opposite, within the thickness of a wall
  for (const WallLine& other : walls) {
    const double distance = wall.offset_m - wall.normal.dot(other.at(0.5 * (other.s0 + other.s1)));
    if (wall.normal.dot(other.normal) > -0.99 || distance < kThinnest_m || distance > kThickestWall_m)
      continue;
    const SolidPart part{wall.along().dot(other.at(other.s1)), wall.along().dot(other.at(other.s0)),
                         distance};
    behind.push_back(part);

    for (const double s : {part.s0, part.s1}) {
      if (s > s0 && s < s1) cuts.push_back(s);
    }
  }

  // Between two cuts the nearest face behind is the same
  std::sort(cuts.begin(), cuts.end());
  std::vector<SolidPart> parts;

  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double middle = 0.5 * (cuts[i] + cuts[i + 1]);
    double thickness = 0.0;
    for (const SolidPart& part : behind) {
      if (part.s0 < middle && part.s1 > middle && (thickness == 0.0 || part.thickness < thickness))
        thickness = part.thickness;
    }
    parts.push_back({cuts[i], cuts[i + 1], thickness});
  }

  return parts;
}

/// Lets the ends of a wall that meet another wall's face go on through that wall.
void extend_to_corners(const WallLine& wall, const std::vector<WallLine>& walls, double unit,
                       std::vector<SolidPart>& parts) {
  for (std::size_t end = 0; end < 2 && !parts.empty(); ++end) {
    if (wall.corner[end] < 0) continue;
    const WallLine& other = walls[static_cast<std::size_t>(wall.corner[end])];
    const Eigen::Vector2d out = (end == 0 ? -1.0 : 1.0) * wall.along();
    if (other.normal.dot(out) > -0.5) continue;
    const double thickness = other.thickness_m > 0.0 ? other.thickness_m : kAssumedThickness_m * unit;
    if (end == 0 && parts.front().s0 == wall.s0) parts.front().s0 -= thickness;
    if (end == 1 && parts.back().s1 == wall.s1) parts.back().s1 += thickness;
  }
}

/// The area together with the part of the wall, on whole coordinates.
SolidArea united(const SolidArea& area, const WallLine& wall, const SolidPart& part, double thickness,
                 const Eigen::Vector2d& origin) {
  SolidPolygon quad;
  for (const auto& [s, depth] : {std::pair(part.s0, thickness), std::pair(part.s1, thickness),
                                 std::pair(part.s1, 0.0), std::pair(part.s0, 0.0)}) {
    const Eigen::Array2d p = ((wall.at(s) - depth * wall.normal - origin) / kSolidStep_m).array().round();
    bg::append(quad.outer(), SolidPoint(p.x(), p.y()));
  }
  bg::correct(quad);
  SolidArea result;
  bg::union_(area, quad, result);
  return result;
}

/// Adds the polygons of an area, simplified, in metres.
void add_solids(const SolidArea& area, bool assumed, const Eigen::Vector2d& origin,
                std::vector<WallSolid>& solids) {
  constexpr double kStraight_m = 0.003, kSmallest_m2 = 0.002;
  SolidArea simple;
  bg::simplify(area, simple, kStraight_m / kSolidStep_m);

  // Slivers come from rounding
  for (const SolidPolygon& polygon : simple) {
    if (bg::area(polygon) * kSolidStep_m * kSolidStep_m < kSmallest_m2) continue;
    WallSolid solid;
    solid.assumed = assumed;

    // boost's rings repeat their first point
    const auto add = [&](const auto& ring) {
      if (ring.size() < 4) return;
      auto& points = solid.rings.emplace_back();
      for (std::size_t i = 0; i + 1 < ring.size(); ++i)
        points.emplace_back(origin + kSolidStep_m * Eigen::Vector2d(ring[i].x(), ring[i].y()));
    };

    add(polygon.outer());
    for (const auto& ring : polygon.inners()) add(ring);
    if (!solid.rings.empty()) solids.push_back(std::move(solid));
  }
}

}  // namespace

/// Parts of the wall between openings and gaps.
std::vector<std::pair<double, double>> solid_pieces(const WallLine& wall) {
  std::vector<WallOpening> openings = wall.openings;
  openings.insert(openings.end(), wall.gaps.begin(), wall.gaps.end());
  std::sort(openings.begin(), openings.end(),
            [](const WallOpening& a, const WallOpening& b) { return a.s0 < b.s0; });

  // Openings may overlap
  std::vector<std::pair<double, double>> pieces;
  double from = wall.s0;
  for (const WallOpening& opening : openings) {
    if (opening.s0 > from) pieces.emplace_back(from, opening.s0);
    from = std::max(from, opening.s1);
  }
  if (wall.s1 > from) pieces.emplace_back(from, wall.s1);
  return pieces;
}

/// Solids of all walls: as thick as observed, else as assumed.
std::vector<WallSolid> wall_solids(const WallPlan& plan, double unit) {
  if (plan.walls.empty()) return {};
  const Eigen::Vector2d origin = plan.walls.front().at(plan.walls.front().s0);
  SolidArea known, assumed;

  // Each piece between openings has the thickness behind it
  for (const WallLine& wall : plan.walls) {
    std::vector<SolidPart> parts;
    for (const auto& [s0, s1] : solid_pieces(wall)) {
      const auto more = thickness_along(wall, plan.walls, s0, s1);
      parts.insert(parts.end(), more.begin(), more.end());
    }

    // Assumed thickness only where none was observed
    extend_to_corners(wall, plan.walls, unit, parts);
    const double other_m = wall.thickness_m > 0.0 ? wall.thickness_m : kAssumedThickness_m * unit;
    for (const SolidPart& part : parts) {
      SolidArea& area = part.thickness > 0.0 ? known : assumed;
      area = united(area, wall, part, part.thickness > 0.0 ? part.thickness : other_m, origin);
    }
  }

  // Assumed solids end where observed ones begin
  SolidArea rest;
  bg::difference(assumed, known, rest);
  std::vector<WallSolid> solids;
  add_solids(known, false, origin, solids);
  add_solids(rest, true, origin, solids);
  return solids;
}

}  // namespace plumbline::plans
