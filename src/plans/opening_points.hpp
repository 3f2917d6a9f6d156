// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Points of a cloud near an opening.
#include <optional>
#include <vector>

#include "plumbline/plans/plan.hpp"

namespace plumbline::plans {

/// Points near an opening, in its own axes: s along the wall from the first jamb, h in front of its face, z
/// over the floor; normals likewise.
struct NearPoints {
  std::vector<Eigen::Vector3d> places;
  std::vector<Eigen::Vector3d> normals;
};

/// Points up to `reach_m` from the opening, in front, behind and beside.
NearPoints points_near(const cloud::Cloud& cloud, double floor_m, const WallDoor& door,
                       double reach_m = 0.35);
/// The most frequent of places along a line, as the median of those near it; nothing: too few.
std::optional<double> main_place(const std::vector<double>& places);
/// Moves the jambs to where their faces were seen, which lie between the faces of the wall: leaves do not.
void measure_jambs(const NearPoints& points, WallDoor& door);

}  // namespace plumbline::plans
