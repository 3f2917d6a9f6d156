// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Alignment of an estimated path with the true one.
#include <vector>

#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/geometry/alignment.hpp"

namespace plumbline::evaluate {

/// A pose of the estimate and the true one at its stamp, each in its own world.
struct MatchedPose {
  double stamp;
  geometry::Rigid3 estimate;
  geometry::Rigid3 truth;
};

/// The alignment; its scale is 1 except with kSim3.
geometry::ScaledRigid3 align_path(const std::vector<MatchedPose>& poses, TrajectoryAlignment align);
/// A pose of the estimate in the world of the truth.
geometry::Rigid3 aligned(const geometry::ScaledRigid3& alignment, const geometry::Rigid3& pose);

/// The scale of an alignment with kSim3, and how well it is known.
ScaleReport scale_report(const std::vector<MatchedPose>& poses, double scale);

}  // namespace plumbline::evaluate
