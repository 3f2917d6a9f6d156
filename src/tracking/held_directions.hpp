// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which directions of a pose the measurements hold, and the motion model's part in holding the others.
#include <optional>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/optimize/pose_solver.hpp"

namespace plumbline::tracking {

/// Principal directions of the information, rotations counted in units that move the scene as much as a metre
/// of translation does, at 2 m.
struct Directions {
  geometry::Vector6d eigenvalues;  ///< ascending
  geometry::Matrix6d eigenvectors;
};

Directions weigh_directions(const geometry::Matrix6d& information);

/// Information below which a direction is weak. Where surfaces are alone, the noise of their normals seems to
/// hold what it does not: a direction needs its share of the normals. (Without features by choice there is
/// nothing better to go by.)
double weak_below(const geometry::Matrix6d& information, bool surface_alone);

/// The part of a motion (left perturbation of camera_from_world) that lies in the directions weaker than
/// `below`, as a matrix to multiply it with.
geometry::Matrix6d weak_part(const Directions& directions, double below);

/// What no measurement holds is held by the motion model: information of 7 mm in the weak directions only.
/// Beside surfaces alone it is more, so that what uneven normals say does not brake the camera frame by
/// frame. None when nothing is weak.
std::optional<optimize::PosePrior> motion_prior(const geometry::Matrix6d& information,
                                                const geometry::Rigid3& predicted, bool surface_alone);

}  // namespace plumbline::tracking
