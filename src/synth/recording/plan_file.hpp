// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// plan.json: the true plan of a world that was made from a number.
#include <optional>
#include <string>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/synth/scene.hpp"

namespace plumbline::synth {

/// Shares of the surface that the cameras saw, as reference.ply counts them.
struct PlanCoverage {
  double all = 0.0;                ///< of the samples of reference.ply
  std::vector<double> wall_faces;  ///< of each face of a wall, room by room: without skirting and casings
  std::vector<double> jambs;       ///< of each opening
};

/// Text of the file; `starts`: the first pose world_from_camera of each robot. Without coverage its keys are
/// left out.
std::string describe_plan(const Plan& plan, const std::vector<geometry::Rigid3>& starts,
                          const std::optional<PlanCoverage>& coverage);

/// changes.json: what is different from the world as it was made.
std::string describe_changes(const Scene& scene);

}  // namespace plumbline::synth
