// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A map as a page in the browser shows it: points with their layers, paths, lines, the plan.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/geometry/pose_samples.hpp"

namespace plumbline::viewer {

/// Mapping of a layer's values to colours.
enum class Scale {
  kLinear,       ///< from `low` to `high`
  kLogarithmic,  ///< the same, by the logarithm; 0 < low
  kCategory,     ///< whole numbers, with their meanings in `names`
  kView          ///< whole numbers: the keyframe (its place in Scene::keyframes) that saw the point best
};

/// A value of every point besides position and colour.
struct Layer {
  std::string key;    ///< of letters, unique: "confidence"
  std::string label;  ///< for people: "Confidence"
  std::string unit;   ///< "m", or empty
  Scale scale = Scale::kLinear;
  double low = 0.0;  ///< values below are shown and kept as `low`; likewise `high`
  double high = 1.0;
  int steps = 32;                       ///< that the range is kept in, at most 254; of categories nothing
  std::vector<std::string> names = {};  ///< of categories 0, 1, ...
  std::vector<float> values = {};       ///< one a point; NaN: not known
};

/// Points of one map; metres.
struct Points {
  std::string name;
  std::vector<std::array<float, 3>> positions;      ///< finite
  std::array<double, 3> shift{};                    ///< a point is at shift + its position
  std::vector<std::array<std::uint8_t, 3>> colors;  ///< red, green, blue; one a point
  std::vector<std::array<float, 3>> normals;        ///< unit, NaN: not known; empty: of no point
  std::vector<Layer> layers;
  std::size_t of = 0;  ///< points that these were thinned from; 0: they are all
  bool colored = true;
};

/// The way of one robot's camera, in the order of time.
struct CameraPath {
  int robot = 0;  ///< its colour
  std::string name;
  std::vector<double> stamps;  ///< seconds
  std::vector<geometry::Rigid3> world_from_camera;
};

struct Keyframe {
  int robot = 0;
  double stamp = 0.0;
  geometry::Rigid3 world_from_camera;
  std::string jpeg;  ///< small picture; empty: there is none
  std::optional<geometry::PoseSamples> in_camera =
      {};  ///< errors that the pose may have, in the camera's axes
};

using Segment = std::pair<Eigen::Vector3d, Eigen::Vector3d>;

/// A tie between two places of the path: a loop of one robot, or a merge of two.
struct Arc {
  bool merge = false;
  Eigen::Vector3d from, to;
};

struct Scene {
  std::string name;
  std::string frame;           ///< one line for people: which frame coordinates are in
  bool z_up = true;            ///< else y is down, and the page turns the map upright for the eye alone
  double floor_m = 0.0;        ///< height of the floor; known only where z is up
  std::vector<Points> clouds;  ///< one, or two that are shown over one another
  std::string placing;         ///< of two: a sentence for people, how they were laid together and how well
  std::vector<CameraPath> paths;
  std::vector<Keyframe> keyframes;
  std::vector<Segment> lines;
  std::vector<Arc> arcs;
  double plan_height_m = 0.0;                                  ///< that the plan was cut at
  std::vector<Segment> walls, doors;                           ///< of the plan, at its height
  std::vector<std::pair<Eigen::Vector3d, std::string>> rooms;  ///< where a text stands
  std::string live;  ///< address of a stream of server-sent events; empty: the scene is whole
};

}  // namespace plumbline::viewer
