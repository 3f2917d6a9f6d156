// SPDX-License-Identifier: BSD-3-Clause
#include "layout/ground.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <queue>

#include "layout/layout.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;

std::vector<Vector2d> rectangle(const Vector2d& at, double yaw_rad, const Vector2d& lo, const Vector2d& hi) {
  const Eigen::Rotation2Dd turn(yaw_rad);
  return {at + turn * lo, at + turn * Vector2d(hi.x(), lo.y()), at + turn * hi,
          at + turn * Vector2d(lo.x(), hi.y())};
}

Ground::Ground(const Plan& plan, int storey) {
  Eigen::AlignedBox2d box;
  for (const PlanRoom& room : plan.rooms) {
    if (room.storey != storey) continue;
    for (const PlanFace& face : room.faces) box.extend(face.from);
  }
  origin_ = box.min() - Vector2d(0.5, 0.5);
  const Vector2d cells = (box.sizes() + Vector2d(1.0, 1.0)) / kCell;
  free_ = cv::Mat1b::zeros(static_cast<int>(cells.y()) + 1, static_cast<int>(cells.x()) + 1);
  see_ = free_.clone();

  // Floors of the storey's rooms.
  for (const PlanRoom& room : plan.rooms) {
    if (room.storey != storey) continue;
    fill(free_, room.outline(), 1);
    fill(see_, room.outline(), 1);
  }

  // Openings to walk or see through.
  for (const PlanOpening& o : plan.openings) {
    if (plan.rooms[static_cast<std::size_t>(o.front)].storey != storey) continue;
    const PlanWall& wall = plan.walls[static_cast<std::size_t>(o.wall)];
    const double yaw = std::atan2(wall.direction.y(), wall.direction.x()), y = 0.5 * o.depth + kCell;
    const auto between = rectangle(wall.origin, yaw, {o.from, -y}, {o.to, y});
    if (o.passable()) fill(free_, between, 1);
    if (o.back >= 0 && o.leaf != Leaf::kShut && o.leaf != Leaf::kAjar) fill(see_, between, 1);
    if (o.leaf != Leaf::kAjar && o.leaf != Leaf::kOpen) continue;

    // A leaf that stands open blocks the floor.
    for (const PlanFace& face : plan.rooms[static_cast<std::size_t>(o.front)].faces) {
      const auto part = part_of_face(plan, o.front, face, o);
      if (!part) continue;

      // The leaf turns about the hinge.
      const geometry::Rigid3 frame = face_frame(face);
      const double turn = std::atan2(frame.rotation(1, 0), frame.rotation(0, 0)) - o.open_rad;
      const Eigen::Vector3d hinge = frame * Eigen::Vector3d(part->first + 0.01, 0.0, 0.0);
      block(rectangle(hinge.head<2>(), turn, {0.0, -0.05}, {o.width(), 0.06}), true);
    }
  }
  recompute();
}

Ground::Ground(const Scene& scene, double floor) {
  const auto outline = [](const Face& face) {
    std::vector<Vector2d> out;
    for (const Vector2d& uv : face.polygon) out.emplace_back(face.at(uv.x(), uv.y()).head<2>());
    if (signed_area(out) < 0.0) std::reverse(out.begin(), out.end());
    return out;
  };
  const auto is_floor = [&](const Face& face) {
    return face.normal.z() > 0.99 && std::abs(face.origin.z() - floor) < 0.03;
  };

  // Extent of the floor and of the paths.
  Eigen::AlignedBox2d box;
  for (const Face& face : scene.faces) {
    if (!is_floor(face)) continue;
    for (const Vector2d& p : outline(face)) box.extend(p);
  }

  const bool bare = box.isEmpty();  // without a floor people walk on nothing, near the paths
  for (const RobotPath& robot : scene.robots) {
    for (const Waypoint& w : robot.waypoints) {
      for (const double d : {-2.0, 2.0}) box.extend(Vector2d(w.position.head<2>() + Vector2d(d, d)));
    }
  }

  origin_ = box.min();
  const Vector2d cells = box.sizes() / kCell;
  free_ = cv::Mat1b(static_cast<int>(cells.y()) + 1, static_cast<int>(cells.x()) + 1, uchar(bare ? 1 : 0));

  for (const Face& face : scene.faces) {
    if (is_floor(face)) fill(free_, outline(face), 1);
  }

  // Surfaces at body height are obstacles.
  for (const Face& face : scene.faces) {
    double low = 1e9, high = -1e9;
    for (const Vector2d& uv : face.polygon) {
      const double z = face.at(uv.x(), uv.y()).z() - floor;
      low = std::min(low, z);
      high = std::max(high, z);
    }

    if (high < 0.1 || low > 1.8) continue;
    const std::vector<Vector2d> corners = outline(face);
    fill(free_, corners, 0);

    // Upright faces have no area, but edges.
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vector2d edge = corners[(i + 1) % corners.size()] - corners[i];
      const int steps = 1 + static_cast<int>(2.0 * edge.norm() / kCell);
      for (int k = 0; k <= steps; ++k) {
        const cv::Point c = cell_of(corners[i] + static_cast<double>(k) / steps * edge);
        if (cv::Rect({0, 0}, free_.size()).contains(c)) free_(c) = 0;
      }
    }
  }

  see_ = free_.clone();
  recompute();
}

void Ground::fill(cv::Mat1b& grid, const std::vector<Vector2d>& outline, uchar value) const {
  PlanRoom shape;
  Eigen::AlignedBox2d box;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    shape.faces.push_back({outline[i], outline[(i + 1) % outline.size()], 0});
    box.extend(outline[i]);
  }

  // Cells with their middle inside.
  const cv::Rect part =
      cv::Rect(cell_of(box.min()), cell_of(box.max()) + cv::Point(1, 1)) & cv::Rect({0, 0}, grid.size());
  for (int y = part.y; y < part.y + part.height; ++y) {
    for (int x = part.x; x < part.x + part.width; ++x) {
      if (shape.contains(middle_of({x, y}))) grid(y, x) = value;
    }
  }
}

void Ground::block(const std::vector<Vector2d>& outline, bool hides_view) {
  fill(free_, outline, 0);
  if (hides_view) fill(see_, outline, 0);
}

void Ground::unblock(const std::vector<Vector2d>& outline) { fill(free_, outline, 1); }

bool Ground::is_free(const std::vector<Vector2d>& outline) const {
  cv::Mat1b inside(free_.size(), uchar{0});
  fill(inside, outline, 1);
  return cv::countNonZero(inside) > 0 && cv::countNonZero(inside & (free_ == 0)) == 0;
}

Ground furnished_ground(const Plan& plan, int storey) {
  Ground ground(plan, storey);
  for (const PlanThing& thing : plan.things) {
    // Tall things hide the view.
    if (plan.rooms[static_cast<std::size_t>(thing.room)].storey == storey)
      ground.block(thing.outline, thing.top - thing.bottom > 1.4);
  }
  ground.recompute();
  return ground;
}

void Ground::recompute() {
  cv::distanceTransform(free_, distance_, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  distance_ = distance_ * kCell;
}

cv::Point Ground::cell_of(const Vector2d& p) const {
  const Vector2d c = (p - origin_) / kCell;
  return {static_cast<int>(std::floor(c.x())), static_cast<int>(std::floor(c.y()))};
}

Vector2d Ground::middle_of(const cv::Point& c) const {
  return origin_ + kCell * Vector2d(c.x + 0.5, c.y + 0.5);
}

double Ground::clearance(const Vector2d& p) const {
  const cv::Point c = cell_of(p);
  return cv::Rect({0, 0}, distance_.size()).contains(c) ? static_cast<double>(distance_(c)) : 0.0;
}

double Ground::clearance(const Vector2d& a, const Vector2d& b) const {
  const int steps = 1 + static_cast<int>((b - a).norm() / kCell);
  double least = clearance(a);
  for (int i = 1; i <= steps; ++i)
    least = std::min(least, clearance(a + static_cast<double>(i) / steps * (b - a)));
  return least;
}

bool Ground::in_sight(const Vector2d& a, const Vector2d& b) const {
  // About one sample per cell.
  const int steps = 1 + static_cast<int>((b - a).norm() / kCell);
  for (int i = 0; i <= steps; ++i) {
    const cv::Point c = cell_of(a + static_cast<double>(i) / steps * (b - a));
    if (!cv::Rect({0, 0}, see_.size()).contains(c) || see_(c) == 0) return false;
  }
  return true;
}

namespace {

/// Cells with so much clearance, connected with one of them: 1, else 0.
cv::Mat1b flood(const cv::Mat1f& distance, const cv::Point& from) {
  cv::Mat1b known(distance.size(), uchar{0});
  const cv::Rect all({0, 0}, distance.size());
  std::vector<cv::Point> open = {from};
  while (!open.empty()) {
    const cv::Point c = open.back();
    open.pop_back();
    if (!all.contains(c) || known(c) != 0 || distance(c) < static_cast<float>(Ground::kClearance)) continue;
    known(c) = 1;
    for (const cv::Point& step : {cv::Point(1, 0), cv::Point(-1, 0), cv::Point(0, 1), cv::Point(0, -1)})
      open.push_back(c + step);
  }
  return known;
}

}  // namespace

cv::Mat1b Ground::reachable(const Vector2d& from) const { return flood(distance_, cell_of(from)); }

bool Ground::try_block(const std::vector<Vector2d>& outline, bool hides_view,
                       const std::vector<Vector2d>& room, const std::vector<Vector2d>& ways, double least) {
  // The room and its surroundings suffice.
  std::vector<cv::Point> corners;
  corners.reserve(room.size());
  for (const Vector2d& p : room) corners.push_back(cell_of(p));
  const int margin = static_cast<int>(0.8 / kCell);
  const cv::Rect box = cv::boundingRect(corners);
  const cv::Rect part =
      (box + cv::Size(2 * margin, 2 * margin) - cv::Point(margin, margin)) & cv::Rect({0, 0}, free_.size());

  // Blocked on trial.
  const cv::Mat1b before = free_(part).clone();
  fill(free_, outline, 0);

  // Clearance to obstacles.
  cv::Mat1b inside(free_.size(), uchar{0});
  fill(inside, room, 1);
  cv::Mat1f distance;
  cv::distanceTransform(free_(part), distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  distance *= kCell;

  // The ways into the room must stay connected.
  bool connected = !ways.empty();
  cv::Mat1b known;
  for (const Vector2d& way : ways) {
    const cv::Point c = cell_of(way) - part.tl();
    if (known.empty()) known = flood(distance, c);
    connected = connected && known(c) != 0;
  }

  // Undone if too little stays reachable.
  if (!connected || cv::countNonZero(known & inside(part)) < least * cv::countNonZero(inside)) {
    before.copyTo(free_(part));
    return false;
  }

  if (hides_view) fill(see_, outline, 0);
  return true;
}

std::vector<Vector2d> Ground::way(const Vector2d& from, const Vector2d& to) const {
  struct Entry {
    float total, cost;
    int cell;
    bool operator<(const Entry& other) const {
      return std::tie(other.total, other.cell) < std::tie(total, cell);
    }
  };

  const cv::Point start = cell_of(from), goal = cell_of(to);
  if (!walkable(start) || !walkable(goal)) return {};

  // A*, bounded by the straight distance.
  const int columns = free_.cols;
  cv::Mat1f cost(free_.size(), 1e9F);
  cv::Mat1i before(free_.size(), -1);
  std::priority_queue<Entry> open;

  // A cheaper way to a cell replaces the known one.
  const auto push = [&](const cv::Point& c, float value, int from_cell) {
    if (value >= cost(c)) return;
    cost(c) = value;
    before(c) = from_cell;
    const auto d = goal - c;
    open.push(
        {value + std::hypot(static_cast<float>(d.x), static_cast<float>(d.y)), value, c.y * columns + c.x});
  };

  push(start, 0.0F, -1);
  while (!open.empty()) {
    const Entry top = open.top();
    open.pop();

    const cv::Point c(top.cell % columns, top.cell / columns);
    if (top.cost > cost(c)) continue;
    if (c == goal) break;

    // Eight neighbours; narrow places cost more.
    for (int k = 0; k < 9; ++k) {
      const cv::Point n(c.x + k % 3 - 1, c.y + k / 3 - 1);
      if (k == 4 || !walkable(n)) continue;
      const float narrow = std::max(0.0F, 0.6F - distance_(n));
      push(n, top.cost + (k % 2 == 0 ? 1.41421356F : 1.0F) * (1.0F + 12.0F * narrow), top.cell);
    }
  }

  // Back from the goal.
  std::vector<Vector2d> way;
  if (cost(goal) >= 1e9F) return way;
  for (int cell = goal.y * columns + goal.x; cell >= 0; cell = before(cell / columns, cell % columns))
    way.push_back(middle_of({cell % columns, cell / columns}));
  std::reverse(way.begin(), way.end());

  return way;
}

std::vector<Vector2d> Ground::straight_way(const Vector2d& from, const Vector2d& to) const {
  const std::vector<Vector2d> cells = way(from, to);
  if (cells.empty()) return {};
  std::vector<Vector2d> corners = {cells.front()};
  for (std::size_t i = 0; i + 1 < cells.size();) {
    // The farthest cell in line with enough clearance.
    std::size_t best = i + 1;
    double narrow = 1.0;
    for (std::size_t j = i + 1; j < cells.size() && (cells[j] - cells[i]).norm() < 2.0; ++j) {
      narrow = std::min(narrow, clearance(cells[j]));
      if (clearance(cells[i], cells[j]) >= std::min(0.45, narrow)) best = j;
    }
    corners.push_back(cells[best]);
    i = best;
  }
  return corners;
}

}  // namespace plumbline::synth
