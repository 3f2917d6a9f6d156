// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The true plan of a generated world: rooms by their wall faces, walls, openings and things.
// Frame: that of the scene, metres.
#include <Eigen/Core>
#include <string>
#include <vector>

namespace plumbline::synth {

/// A straight wall by its middle line; the faces of all rooms along it are half its thickness away.
struct PlanWall {
  Eigen::Vector2d origin;
  Eigen::Vector2d direction;  ///< unit
  double thickness = 0.12;
  bool outer = false;  ///< nothing is behind it

  [[nodiscard]] Eigen::Vector2d at(double s) const { return origin + s * direction; }
  [[nodiscard]] double along(const Eigen::Vector2d& p) const { return direction.dot(p - origin); }
};

/// One face of a wall, from corner to corner of a room that lies on the left of from -> to.
struct PlanFace {
  Eigen::Vector2d from;
  Eigen::Vector2d to;
  int wall = 0;
};

struct PlanRoom {
  std::string kind;  ///< "kitchen", "corridor", ...
  int storey = 0;
  std::vector<PlanFace> faces;  ///< counter-clockwise and closed: the faces' ends are the room's outline
  double height = 2.6;
  std::string floor_material;
  std::string wall_material;
  std::string accent_material;  ///< of the first face

  [[nodiscard]] std::vector<Eigen::Vector2d> outline() const;
  [[nodiscard]] double area() const;  ///< m^2 between the faces
  [[nodiscard]] bool contains(const Eigen::Vector2d& p) const;
};

enum class OpeningKind { kDoor, kPassage, kWindow, kHalfWall, kNiche };
enum class Leaf { kNone, kShut, kAjar, kOpen, kSliding };

/// An opening of a wall: the space between its jambs from `sill` to `head`.
struct PlanOpening {
  OpeningKind kind = OpeningKind::kDoor;
  Leaf leaf = Leaf::kNone;
  int wall = 0;
  double from = 0.0;  ///< m along the wall: the faces of the jambs
  double to = 0.0;
  double sill = 0.0;  ///< m above the floor
  double head = 2.0;
  double depth = 0.12;    ///< m, the wall's thickness; of a niche its own
  double open_rad = 0.0;  ///< of a leaf that turns
  int like = -1;          ///< opening of which this is a copy
  int front = 0;          ///< room into which the leaf opens, or which has the window or niche
  int back = -1;          ///< room behind it; -1: none

  [[nodiscard]] double width() const { return to - from; }
  /// People can walk through: no sill, no leaf in the way.
  [[nodiscard]] bool passable() const {
    return back >= 0 && sill < 0.05 && leaf != Leaf::kShut && leaf != Leaf::kAjar;
  }
};

/// Furniture and columns: the outline on the floor, and the heights between which it stands or hangs.
struct PlanThing {
  std::string name;  ///< of the object
  std::string type;
  std::vector<Eigen::Vector2d> outline;  ///< counter-clockwise
  double bottom = 0.0;
  double top = 1.0;
  int room = 0;
};

struct Plan {
  std::string kind;
  int number = 0;
  std::vector<PlanWall> walls;
  std::vector<PlanRoom> rooms;
  std::vector<PlanOpening> openings;
  std::vector<PlanThing> things;
  std::vector<double> storeys = {0.0};  ///< heights of their floors, m
  std::vector<int> alike;               ///< rooms with the same walls and furniture
  bool copies = false;                  ///< these have the same posters as well

  /// The middle of an opening, within its wall.
  [[nodiscard]] Eigen::Vector2d middle(const PlanOpening& o) const {
    return walls[static_cast<std::size_t>(o.wall)].at(0.5 * (o.from + o.to));
  }
};

/// Area of a closed outline, positive if it is counter-clockwise.
double signed_area(const std::vector<Eigen::Vector2d>& outline);

}  // namespace plumbline::synth
