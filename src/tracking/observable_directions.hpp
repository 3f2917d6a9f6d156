// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which directions of a pose the measurements constrain, and the motion model's part in constraining the
// degenerate ones (compare Zhang, Kaess, Singh, ICRA 2016).
#include <optional>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/optimize/pose_solver.hpp"

namespace plumbline::tracking {

/// Principal directions of the information; rotations are in units that move the scene as much as a metre of
/// translation does, at 2 m.
struct PrincipalDirections {
  geometry::Vector6d eigenvalues;  ///< ascending
  geometry::Matrix6d eigenvectors;
};

PrincipalDirections principal_directions(const geometry::Matrix6d& information);

/// Information below which a direction is degenerate. With surfaces alone, the noise of their normals seems
/// to hold directions that it does not: a direction then needs its share of the normals. (If features are
/// switched off there is no better criterion.)
double degenerate_below(const geometry::Matrix6d& information, bool surface_only);

/// Takes a motion (left perturbation of camera_from_world) to its part in the directions with less
/// information than `below`.
geometry::Matrix6d projector_onto_degenerate(const PrincipalDirections& directions, double below);

/// Trust in the motion prior.
enum class MotionTrust {
  kUnknown,  ///< contradicted, or nothing is known of the past: 2 cm, where nothing holds better than that
  kLikely,   ///< besides features: 5 mm, in directions that they hold no better
  kSurfaceOnly,  ///< beside surfaces alone: 0.3 mm where these hold nothing, so that what uneven normals say
                 ///< does not brake the camera frame by frame
};

/// Prior by the motion model in the directions that measurements leave unconstrained, and only in these. None
/// if there are none.
std::optional<optimize::PosePrior> motion_prior(const geometry::Matrix6d& information,
                                                const geometry::Rigid3& predicted, MotionTrust trust);

}  // namespace plumbline::tracking
