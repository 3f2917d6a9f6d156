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
geometry::Matrix6d weak_projection(const Directions& directions, double below);

/// What the motion model is worth.
enum class Motion {
  kUnknown,  ///< it was refuted, or nothing is known of the past: 2 cm, where nothing holds better than that
  kLikely,   ///< beside features: 5 mm, where they hold no better than that
  kAlone,    ///< beside surfaces alone: 0.3 mm where these hold nothing, so that what uneven normals say does
             ///< not brake the camera frame by frame
};

/// What measurements leave open is held by the motion model, in these directions only. None when there are
/// none.
std::optional<optimize::PosePrior> motion_prior(const geometry::Matrix6d& information,
                                                const geometry::Rigid3& predicted, Motion motion);

}  // namespace plumbline::tracking
