// SPDX-License-Identifier: BSD-3-Clause
#include "layout/subdivision.hpp"

#include <map>

namespace plumbline::synth {

using Eigen::Vector2d;

namespace {

std::size_t next(std::size_t i, std::size_t n) { return i + 1 == n ? 0 : i + 1; }

}  // namespace

double signed_area(const std::vector<Vector2d>& outline) {
  double twice = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i)
    twice += cross(outline[i], outline[next(i, outline.size())]);
  return 0.5 * twice;
}

std::vector<Vector2d> PlanRoom::outline() const {
  std::vector<Vector2d> corners;
  for (const PlanFace& face : faces) corners.push_back(face.from);
  return corners;
}

double PlanRoom::area() const { return signed_area(outline()); }

bool PlanRoom::contains(const Vector2d& p) const {
  bool inside = false;
  for (const PlanFace& f : faces) {
    // Parity of the edges crossed by a ray.
    if ((f.from.y() > p.y()) == (f.to.y() > p.y())) continue;
    const double share = (p.y() - f.from.y()) / (f.to.y() - f.from.y());
    if (p.x() < f.from.x() + share * (f.to.x() - f.from.x())) inside = !inside;
  }
  return inside;
}

Subdivision::Subdivision(const Vector2d& size, double thickness) {
  points_ = {{0.0, 0.0}, {size.x(), 0.0}, size, {0.0, size.y()}};
  cells.push_back({{0, 1, 2, 3}, {0, 1, 2, 3}, ""});
  for (std::size_t i = 0; i < 4; ++i) {
    walls.push_back({points_[i], (points_[next(i, 4)] - points_[i]).normalized(), thickness, true});
  }
}

int Subdivision::insert_point(int a, int b, const Vector2d& p) {
  const int point = static_cast<int>(points_.size());
  points_.push_back(p);

  // Cells on both sides of the edge get the point.
  for (Cell& cell : cells) {
    for (std::size_t i = 0; i < cell.points.size(); ++i) {
      const int from = cell.points[i], to = cell.points[next(i, cell.points.size())];
      if (std::minmax(from, to) != std::minmax(a, b)) continue;
      cell.points.insert(cell.points.begin() + static_cast<long>(i) + 1, point);
      cell.walls.insert(cell.walls.begin() + static_cast<long>(i), cell.walls[i]);
      break;
    }
  }
  return point;
}

std::optional<int> Subdivision::split(int index, const Vector2d& point, const Vector2d& direction,
                                      double thickness) {
  constexpr double kSnap = 0.02;  // m: the line goes through a corner that is so near
  const Vector2d unit = direction.normalized();
  const auto side = [&](int p) {
    const double d = cross(unit, points_[static_cast<std::size_t>(p)] - point);
    return std::abs(d) < kSnap ? 0.0 : d;
  };

  // New corners on the crossed edges.
  const std::vector<int> before = cells[static_cast<std::size_t>(index)].points;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const int a = before[i], b = before[next(i, before.size())];
    const double da = side(a), db = side(b);
    if (da * db >= 0.0) continue;

    const Vector2d &pa = points_[static_cast<std::size_t>(a)], &pb = points_[static_cast<std::size_t>(b)];
    insert_point(a, b, pa + da / (da - db) * (pb - pa));
  }

  // Corners on either side of the line.
  const Cell whole = cells[static_cast<std::size_t>(index)];
  const int wall = static_cast<int>(walls.size());
  Cell left, right;
  left.kind = right.kind = whole.kind;
  for (std::size_t i = 0; i < whole.points.size(); ++i) {
    const double here = side(whole.points[i]), there = side(whole.points[next(i, whole.points.size())]);

    // Corners on the line belong to both sides.
    if (here >= 0.0) {
      left.points.push_back(whole.points[i]);
      left.walls.push_back(here == 0.0 && there < 0.0 ? wall : whole.walls[i]);
    }

    if (here <= 0.0) {
      right.points.push_back(whole.points[i]);
      right.walls.push_back(here == 0.0 && there > 0.0 ? wall : whole.walls[i]);
    }
  }

  // A line that only touches divides nothing.
  if (left.points.size() < 3 || right.points.size() < 3) return std::nullopt;
  walls.push_back({point, unit, thickness, false});
  cells[static_cast<std::size_t>(index)] = right;
  cells.push_back(left);
  return static_cast<int>(cells.size()) - 1;
}

bool Subdivision::merge(int into, int from) {
  Cell &a = cells[static_cast<std::size_t>(into)], &b = cells[static_cast<std::size_t>(from)];

  // Edges of both cells, with their direction.
  std::map<std::pair<int, int>, int> edges;
  for (const Cell* cell : {&a, &b}) {
    for (std::size_t i = 0; i < cell->points.size(); ++i) {
      edges[{cell->points[i], cell->points[next(i, cell->points.size())]}] = cell->walls[i];
    }
  }

  // Shared edges cancel.
  std::map<int, std::pair<int, int>> after;  // of a point: the next one and the wall to it
  double shared = 0.0;
  for (const auto& [edge, wall] : edges) {
    if (edges.count({edge.second, edge.first}) != 0) {
      shared += 0.5 * (points_[static_cast<std::size_t>(edge.first)] -
                       points_[static_cast<std::size_t>(edge.second)])
                          .norm();
      continue;
    }

    if (!after.emplace(edge.first, std::make_pair(edge.second, wall)).second) return false;
  }
  constexpr double kLeastShared = 1.4;  // m: less would leave a gap between two rooms
  if (shared < kLeastShared) return false;

  // The outline, in one round.
  Cell merged;
  merged.kind = a.kind;
  const int first = after.begin()->first;
  for (int at = first; merged.points.empty() || at != first; at = after.at(at).first) {
    merged.points.push_back(at);
    merged.walls.push_back(after.at(at).second);
  }

  // A second outline would be a hole.
  if (merged.points.size() != after.size()) return false;
  a = std::move(merged);
  b = {};

  return true;
}

std::optional<std::vector<PlanFace>> Subdivision::faces(const Cell& cell) const {
  struct Run {
    Vector2d point, direction;  // of the face's line
    int wall;
  };
  std::vector<Run> runs;
  const std::size_t n = cell.points.size();

  // A face for each run along one wall.
  for (std::size_t i = 0; i < n; ++i) {
    if (cell.walls[i] == cell.walls[i == 0 ? n - 1 : i - 1]) continue;
    const Vector2d& a = points_[static_cast<std::size_t>(cell.points[i])];
    const Vector2d& b = points_[static_cast<std::size_t>(cell.points[next(i, n)])];
    const PlanWall& wall = walls[static_cast<std::size_t>(cell.walls[i])];
    const Vector2d d = wall.direction.dot(b - a) > 0.0 ? wall.direction : Vector2d(-wall.direction);
    runs.push_back({wall.origin + 0.5 * wall.thickness * Vector2d(-d.y(), d.x()), d, cell.walls[i]});
  }

  // Corners where successive faces meet.
  std::vector<PlanFace> faces;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Run &before = runs[i == 0 ? runs.size() - 1 : i - 1], &run = runs[i];
    const double sine = cross(before.direction, run.direction);
    if (std::abs(sine) < 0.2) return std::nullopt;
    const double s = cross(run.point - before.point, run.direction) / sine;
    const Vector2d corner = before.point + s * before.direction;
    faces.push_back({corner, corner, run.wall});
  }

  // Faces must keep a length and a direction.
  for (std::size_t i = 0; i < faces.size(); ++i) {
    faces[i].to = faces[next(i, faces.size())].from;
    if (runs[i].direction.dot(faces[i].to - faces[i].from) < 0.3) return std::nullopt;
  }
  return faces;
}

Eigen::AlignedBox2d Subdivision::bounds(const Cell& cell) const {
  Eigen::AlignedBox2d box;
  for (const int p : cell.points) box.extend(points_[static_cast<std::size_t>(p)]);
  return box;
}

double Subdivision::area(const Cell& cell) const {
  std::vector<Vector2d> outline;
  for (const int p : cell.points) outline.push_back(points_[static_cast<std::size_t>(p)]);
  return signed_area(outline);
}

}  // namespace plumbline::synth
