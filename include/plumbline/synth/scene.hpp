// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A world as its YAML file describes it: flat faces, lamps and the robots' paths through it.
// World frame: metres, z up, the floor at z = 0 by custom.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/config.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/synth/options.hpp"
#include "plumbline/synth/plan.hpp"

namespace plumbline::synth {

/// A convex flat polygon with its own texture frame. Point (u, v) in metres is origin + u u_axis + v v_axis.
struct Face {
  Eigen::Vector3d origin;
  Eigen::Vector3d u_axis;                ///< unit
  Eigen::Vector3d v_axis;                ///< unit, perpendicular to u_axis
  Eigen::Vector3d normal;                ///< unit, outwards: u_axis x v_axis
  std::vector<Eigen::Vector2d> polygon;  ///< counter-clockwise seen from outside, (u, v) metres
  std::string material;                  ///< a name that material_names() lists
  int seed = 0;                          ///< distinguishes prints of the same material
  double stretch_u = 0.0;                ///< one copy of the texture covers this many metres; 0 = tiles
  double stretch_v = 0.0;
  int object = -1;  ///< index into Scene::objects

  [[nodiscard]] Eigen::Vector3d at(double u, double v) const { return origin + u * u_axis + v * v_axis; }
  /// Bounds of the polygon, (u, v).
  [[nodiscard]] Eigen::AlignedBox2d bounds() const;
  /// True if (u, v) lies in the polygon; `slack`: twice the area, m^2, by which an edge may be missed.
  [[nodiscard]] bool contains(const Eigen::Vector2d& uv, double slack = 0.0) const;
};

/// Object that a face belongs to, for messages.
struct Object {
  std::string type;  ///< "wall", "desk", ...
  std::string name;  ///< from the file, or type and number
  core::ConfigMark mark;
};

/// A rectangle that gives light (a ceiling lamp, a window).
struct Lamp {
  Eigen::Vector3d center;
  Eigen::Vector3d half_u;
  Eigen::Vector3d half_v;
  Eigen::Vector3d normal;  ///< unit, direction of the light
  double power = 1.0;
  double reach = 0.0;  ///< m: the light fades to nothing there; 0: no limit
};

struct Waypoint {
  Eigen::Vector3d position;
  std::optional<Eigen::Vector3d> look;  ///< point looked at; none: along the path
  double pitch_rad = 0.0;               ///< added to the viewing direction, positive looks up
  double yaw_rad = 0.0;                 ///< added to the viewing direction, positive to the left
  core::ConfigMark mark;
};

struct RobotPath {
  std::string name;
  std::vector<Waypoint> waypoints;  ///< at least 2
  bool closed = false;              ///< the path continues from the last waypoint to the first
  double speed = 0.5;               ///< m/s
  double turn_rate = 0.6;           ///< rad/s, slower where the camera has to turn faster
};

/// A person at one time; feet that carry it stay where they are.
struct FigurePose {
  Eigen::Vector3d hip;      ///< between the joints of the legs
  double yaw = 0.0;         ///< where it looks, rad from +x
  Eigen::Vector3d foot[2];  ///< soles below the ankles, left and right
};

/// Someone who walks to and fro on a straight line, a body of 0.5 x 0.3 m with a head, 1.7 m high; or, with a
/// day, a person with arms and legs.
struct Walker {
  Eigen::Vector3d from;  ///< middle of the feet
  Eigen::Vector3d to;    ///< at least 1 cm away
  double speed = 0.7;    ///< m/s
  std::string material = "fabric";
  core::ConfigMark mark;
  std::vector<FigurePose> day;  ///< of a person: poses 0.04 s apart, the last one like the first; it repeats
  bool carries = false;         ///< of a person: a box in the hands

  /// Position of the feet, t seconds after the first frame.
  [[nodiscard]] Eigen::Vector3d at(double t) const;
  /// Pose of a person, t seconds after the first frame.
  [[nodiscard]] FigurePose pose(double t) const;
};

/// The leaf of a door that turns: faces [first, first + count) of one object.
struct DoorLeaf {
  std::size_t first = 0;
  std::size_t count = 0;
  Eigen::Vector3d hinge;  ///< foot of the axis; a leaf opens clockwise, seen from above
  double open_rad = 0.0;
};

/// A leaf that swings to another angle and back at times; or a drawer of a desk that slides out and back; or
/// a lift's cab or a leaf of its doors.
struct MovingDoor {
  std::size_t leaf = 0;                             ///< index into Scene::leaves
  int opening = 0;                                  ///< index into Plan::openings
  std::string drawer;                               ///< its name, or that of a part of a lift; empty: a door
  Eigen::Vector3d slide = Eigen::Vector3d::Zero();  ///< m, of a drawer, whose "angles" are shares of it
  double lit = 1.0;                                 ///< share of `slide` at which its light is computed
  std::vector<Face> body;                           ///< of a drawer, behind its front; where it is pulled out
  double rest_rad = 0.0;                            ///< how far it is open else
  double other_rad = 0.0;                           ///< where it swings to
  double swing = 1.5;                               ///< s that it takes to swing there, and back
  double hold = 3.0;                                ///< s that it stays there
  std::vector<double> starts;  ///< s after the first frame, rising; of the first round if there are several
  std::vector<double> shares;  ///< of a part of a lift: of `slide`, kShareStep apart from the first frame on

  static constexpr double kShareStep = 0.02;  ///< s

  /// Angle from shut, t seconds after the first frame.
  [[nodiscard]] double angle(double t) const;
};

/// One difference from the world as it was made.
struct SceneChange {
  std::string kind;               ///< moved, added, removed, wall, door, light
  std::string thing;              ///< name of the object
  std::vector<std::string> with;  ///< names of what stands on it and goes with it
  Eigen::AlignedBox3d before;     ///< empty if it was not there
  Eigen::AlignedBox3d after;      ///< empty if it is gone
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  double turn_rad = 0.0;  ///< about the vertical through the middle of `before`; of a leaf about its hinge
  double factor = 1.0;    ///< of all light
};

/// An AprilTag on a wall.
struct WallTag {
  int id = 0;
  Eigen::Vector3d middle;
  Eigen::Vector3d corners[4];  ///< of the black square, clockwise from the upper left one
};

struct Scene {
  std::string name;
  std::string description;
  std::filesystem::path file;
  std::vector<Object> objects;
  std::vector<Face> faces;
  std::vector<Lamp> lamps;
  double ambient = 0.35;              ///< share of light without direction
  double light_pitch = 0.06;          ///< m between the points of faces where light is computed
  Motion motion = Motion::kHandheld;  ///< when the options do not choose
  std::vector<RobotPath> robots;      ///< at least one
  std::vector<Walker> walkers;        ///< the options say how many of them are filmed
  std::vector<Event> events;
  std::vector<DoorLeaf> leaves;
  std::vector<MovingDoor> moving_doors;  ///< those of the options
  std::vector<SceneChange> changes;      ///< those of the options, done
  std::vector<WallTag> tags;             ///< those of the options; of a number that hangs twice both
  std::optional<Plan> plan;              ///< of a world made from a number
};

/// `name_or_file`: a shipped scene (a file of `scenes_folder` without .yaml) or a path. All problems of the
/// file are reported together as file:line:column: key: what is wrong; an unknown name comes with a
/// suggestion.
core::Result<Scene> load_scene(const std::string& name_or_file, const std::filesystem::path& scenes_folder);

/// The same from YAML text; `file_name` is for messages.
core::Result<Scene> parse_scene(const std::string& yaml, const std::string& file_name);

/// Materials a scene file may name, sorted.
const std::vector<std::string>& material_names();

}  // namespace plumbline::synth
