// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Errors that the poses of a checked path may have, drawn together.
#include <vector>

#include "plumbline/check/self_check.hpp"
#include "plumbline/geometry/pose_samples.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::check {

/// Errors of a pose of `way`, in its camera's axes: between two anchors they are interpolated. NaN where
/// nothing was checked. The same bytes for the same report.
geometry::PoseSamples samples_of(const CheckReport& report, std::size_t way,
                                 const geometry::StampedPose& pose);

}  // namespace plumbline::check
