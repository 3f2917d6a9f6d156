// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The same world another day. Private to the module.
#include <algorithm>

#include "plumbline/synth/scene.hpp"

namespace plumbline::synth {

/// One change that is asked for.
struct Edit {
  std::string move, remove, add, wall;  ///< one of them is set, or `door` or `light`
  int door = -1;
  double light = 0.0;
  std::vector<double> by, at, size;
  double turn_rad = 0.0, yaw_rad = 0.0, shift = 0.0, open_rad = 0.0;
  std::string material = "cardboard";
  core::ConfigMark mark;
};

/// Does edits to a scene and its plan.
class Editor {
 public:
  explicit Editor(Scene& scene) : scene_(scene) {}

  core::Result<void> apply(const Edit& edit);
  /// Takes away what was removed; afterwards the scene is done.
  void finish();

  /// Index of an object by its name; -1: there is none.
  [[nodiscard]] int find(const std::string& name) const;
  /// Outline on the floor along the sides of its first face, counter-clockwise.
  [[nodiscard]] std::vector<Eigen::Vector2d> outline(int object) const;
  [[nodiscard]] Eigen::AlignedBox3d box(int object) const;
  /// A thing and what stands on it.
  [[nodiscard]] std::vector<int> with_company(int object) const;
  [[nodiscard]] bool removed(int object) const {
    return std::find(removed_.begin(), removed_.end(), object) != removed_.end();
  }
  /// Leaf of a door, which is an opening of the plan or else one of all leaves; null: it has none.
  DoorLeaf* leaf(int door);
  /// True if all surfaces that end at a wall are square to it.
  [[nodiscard]] bool square(const std::string& wall) const;

 private:
  struct Slab;
  [[nodiscard]] std::optional<Slab> slab(const std::string& wall) const;
  [[nodiscard]] std::optional<Slab> slab_of_plan(const Plan& plan, const std::string& wall) const;
  [[nodiscard]] std::optional<Slab> slab_of_object(const std::string& wall) const;
  core::Result<void> move(const Edit& edit);
  core::Result<void> remove(const Edit& edit);
  core::Result<void> add(const Edit& edit);
  core::Result<void> shift_wall(const Edit& edit);
  core::Result<void> turn_door(const Edit& edit);
  static tl::unexpected<core::Error> wrong(const Edit& edit, const std::string& what);
  SceneChange& note(const std::string& kind, int object);

  Scene& scene_;
  std::vector<int> removed_;
};

}  // namespace plumbline::synth
