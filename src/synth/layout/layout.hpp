// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The steps by which a number becomes a world; each draws from its own stream of random numbers.
#include "layout/ground.hpp"
#include "layout/subdivision.hpp"
#include "plumbline/synth/scene.hpp"
#include "scene/builder.hpp"
#include "scene/random.hpp"

namespace plumbline::synth {

class CameraPath;

/// Cells of a home, an office or a ring of corridors; cells of the kind "outside" are no rooms. `alike`:
/// rooms of an office that have the same shape; `hall`: one of its rooms is 20 m long.
Subdivision draw_cells(const std::string& kind, int alike, bool hall, Rng& rng);

constexpr double kSlab = 0.3;  ///< m of concrete between storeys

/// The storeys of a building have the corridor and the stairs in common.
struct BuildingFrame {
  Eigen::Vector2d size;              ///< between the middles of the outer walls
  double low = 5.0, corridor = 2.0;  ///< m in y: the rooms below the corridor, and it
  double stairs = 2.8;               ///< m in x, below the corridor
  double outer = 0.36;               ///< m, thickness
  double height = 2.7;               ///< m, largest of a room
  double pitch = 3.0;                ///< m from floor to floor
};

/// Cells of one storey.
Subdivision draw_storey(const BuildingFrame& frame, int rooms, int alike, bool hall, Rng& rng);

/// A building of several storeys with stairs; nothing if this attempt failed.
bool build_building(const SynthOptions& options, std::uint64_t seed, Scene& scene, Plan& plan);

/// The shaft of a lift and the lobbies before it, which are open to the corridor at the largest y.
struct LiftShaft {
  Eigen::AlignedBox2d box;  ///< m, inner faces of both
  double door = 0.0;        ///< m: y of the wall between them, on the lobbies' side

  [[nodiscard]] double middle() const { return box.center().x(); }
  [[nodiscard]] double back() const;  ///< y of the cab's back
};

/// Lobby of one storey, whose floor is at 0, up to the next one's floor or the highest ceiling.
void build_lift_storey(const LiftShaft& shaft, int index, bool lowest, bool highest, double height,
                       Builder& b);

/// The cab and its doors, which move (Scene::moving_doors).
void add_lift(const LiftShaft& shaft, const std::vector<double>& storeys, Scene& scene);

/// The way from a lobby into the cab, and out on another storey, with the heights of both.
std::vector<Eigen::Vector3d> lift_ride(const LiftShaft& shaft, double from, double to);

/// Moves the lift as its rider needs it.
void run_lift(const SynthOptions& options, const CameraPath& path, Scene& scene);

/// The camera's path over all storeys of a building; empty if it finds none.
RobotPath plan_building_path(const Plan& plan, Route route, int robot, Rng& rng);

/// Copies the openings of the first of the plan's like rooms to the others; false if not all rooms can be
/// walked to afterwards.
bool make_alike(Plan& plan);

/// All rooms can be walked to.
bool connected(const Plan& plan);

/// Rooms with their kinds, heights and materials; false if one has no shape of a room.
bool add_rooms(const Subdivision& cells, Rng& rng, Plan& plan);

/// Doors that connect all rooms, and more of them, passages, windows, half-height walls and niches; false if
/// rooms stay apart.
bool add_openings(Rng& rng, Plan& plan);

/// Walls, floors, ceilings, doors and windows as faces, and lamps.
void build_shell(const Plan& plan, Rng& rng, Builder& builder);

/// Furniture and columns; whatever would stand in the way of people is left out.
void furnish(Plan& plan, Ground& ground, Rng& rng, Builder& builder);

/// Furniture of a type; the frame stands on the floor, its -y side is the front. Other types add nothing.
void add_thing(Builder& b, const std::string& type, const geometry::Rigid3& frame,
               const Eigen::Vector3d& size, const std::string& material);

/// The middles of all ways through that a room has.
std::vector<Eigen::Vector2d> ways_of(const Plan& plan, int room);

/// Does the changes that the options ask for, and writes them into the scene and its plan. Errors: kUsage,
/// kInput.
core::Result<void> apply_changes(const SynthOptions& options, Scene& scene);

/// The camera's path, which ends where it began; empty if it finds none.
RobotPath plan_path(const Plan& plan, const Ground& ground, Route route, int robot, Rng& rng,
                    const std::optional<Eigen::Vector2d>& start = {});

/// Frame of a face: origin at its right end seen from the room, x to its left end, y into the wall, z up.
geometry::Rigid3 face_frame(const PlanFace& face);

/// The part of a face that an opening takes, m from the origin of face_frame; nothing if it is elsewhere.
std::optional<std::pair<double, double>> part_of_face(const Plan& plan, int room, const PlanFace& face,
                                                      const PlanOpening& opening);

}  // namespace plumbline::synth
