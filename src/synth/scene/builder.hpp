// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Puts solids together from flat faces: the alphabet of walls and furniture.
#include <string>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/synth/scene.hpp"

namespace plumbline::synth {

/// Upright frame: origin at (x, y, z), x axis turned by yaw from the world's x.
geometry::Rigid3 upright(const Eigen::Vector3d& origin, double yaw_rad);

/// The frame at `at` of another one, turned there.
geometry::Rigid3 placed(const geometry::Rigid3& frame, const Eigen::Vector3d& at,
                        const Eigen::AngleAxisd& turn);

/// Texture of a face.
struct Skin {
  std::string material;
  bool stretched = false;  ///< one copy over the whole face instead of tiling
  int seed = -1;           ///< -1: the object's
};

/// Upright cylinder or cone frustum.
struct Cylinder {
  Eigen::Vector3d bottom{0, 0, 0};                      ///< its centre
  double radius = 0.1, top_radius = 0.1, height = 1.0;  ///< m
  int segments = 24;
};

/// Flat thing on a wall: a print on a board.
struct Panel {
  double width = 0.6, height = 0.85, thickness = 0.008;  ///< m
  std::string print;                                     ///< material of its front
  std::string rim;                                       ///< material of all else
  bool bars = false;                                     ///< a frame around the print
};

/// Adds faces of one object after the other to a scene.
class Builder {
 public:
  explicit Builder(Scene& scene) : scene_(scene) {}

  void begin_object(const std::string& type, const std::string& name, const core::ConfigMark& mark);
  [[nodiscard]] int seed() const { return seed_; }
  [[nodiscard]] Scene& scene() { return scene_; }

  /// Convex flat polygon, counter-clockwise seen from outside; `u_hint` gives the texture's horizontal.
  void polygon(const std::vector<Eigen::Vector3d>& corners, const Eigen::Vector3d& u_hint, const Skin& skin);

  /// Lets a face's texture count from a point, so that pieces of one surface continue each other.
  static void anchor(Face& face, const Eigen::Vector3d& foot);

  /// Axis-parallel box from `lo` to `hi` in the frame `world_from_box`. The front (-y) may have its own skin.
  void box(const geometry::Rigid3& world_from_box, const Eigen::Vector3d& lo, const Eigen::Vector3d& hi,
           const Skin& skin, const Skin* front = nullptr);

  void cylinder(const geometry::Rigid3& world_from_cylinder, const Cylinder& cylinder, const Skin& skin);

 private:
  Scene& scene_;
  int seed_ = 0;
};

// ---- furniture.cpp: things made of boxes; the frame stands on the floor, its -y side is the front ----

void add_desk(Builder& b, const geometry::Rigid3& frame, const Eigen::Vector3d& size,
              const std::string& material);
void add_table(Builder& b, const geometry::Rigid3& frame, const Eigen::Vector3d& size,
               const std::string& material);
void add_chair(Builder& b, const geometry::Rigid3& frame, const std::string& material);
void add_shelf(Builder& b, const geometry::Rigid3& frame, const Eigen::Vector3d& size,
               const std::string& material, bool books);
void add_cabinet(Builder& b, const geometry::Rigid3& frame, const Eigen::Vector3d& size,
                 const std::string& material, int doors);
void add_sofa(Builder& b, const geometry::Rigid3& frame, const Eigen::Vector3d& size,
              const std::string& material);
void add_monitor(Builder& b, const geometry::Rigid3& frame, double width, bool stand);
void add_plant(Builder& b, const geometry::Rigid3& frame, double height);
void add_floor_lamp(Builder& b, const geometry::Rigid3& frame, double height, double power);
void add_ceiling_lamp(Builder& b, const geometry::Rigid3& frame, double width, double depth, double power);
void add_clutter(Builder& b, const geometry::Rigid3& frame, double width, double depth, int count);
void add_curtain(Builder& b, const geometry::Rigid3& frame, double width, double height, double fold,
                 const std::string& material);
/// Centre of its back at the frame's origin, front to -y.
void add_panel(Builder& b, const geometry::Rigid3& frame, const Panel& panel);

// ---- walker.cpp ----

constexpr double kFigureStep = 0.04;  ///< s between the poses of a person's day
constexpr double kHipHeight = 0.84;   ///< m above the soles, standing

/// Parts of a walker that move on their own: 1, or 7 of a person.
int walker_parts(const Walker& walker);
void add_walker(Builder& b, const Walker& walker, int part);
/// Motion of a part from where it is built to where it is t seconds after the first frame.
geometry::Rigid3 walker_motion(const Walker& walker, int part, double t);

// ---- walls.cpp ----

struct Opening {
  double at = 0.0;        ///< m along the wall to the opening's near edge
  double width = 0.9;     ///< m
  double bottom = 0.0;    ///< m above the wall's foot
  double height = 2.1;    ///< m
  bool window = false;    ///< glazed: bright glass and a frame; else a doorway
  double open_rad = 1.4;  ///< of the door leaf; < 0: no leaf
  std::string material = "door";
  core::ConfigMark mark;
};

struct Wall {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
  double bottom = 0.0;
  double height = 2.6;
  double thickness = 0.12;
  std::string material = "plaster";
  std::string skirting;           ///< material of a skirting board on both sides; "" = none
  std::vector<Opening> openings;  ///< sorted by `at`, not overlapping
};

void add_wall(Builder& b, const Wall& wall);

/// The panes of a window, in the frame of a wall: x along it, the middle of its thickness at y = 0.
void add_glass(Builder& b, const geometry::Rigid3& frame, const Opening& o);

/// The leaf of a door, which opens to -y.
void add_leaf(Builder& b, const geometry::Rigid3& frame, const Wall& wall, const Opening& o);

/// Panel `index` of a zigzag through `points`: mitred with its neighbours, so that no seam shows at the
/// corners. Thickness, heights and material are those of `wall`.
void add_zigzag_panel(Builder& b, const Wall& wall, const std::vector<Eigen::Vector2d>& points,
                      std::size_t index);

}  // namespace plumbline::synth
