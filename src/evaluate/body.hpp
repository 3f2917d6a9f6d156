// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The constant pose of the camera in a body, such as a marker or an IMU, whose poses the truth holds.
#include <optional>
#include <string>
#include <vector>

#include "path_alignment.hpp"
#include "plumbline/core/error.hpp"

namespace plumbline::evaluate {

/// Pose of the camera in the body, from "x,y,z,qx,qy,qz,qw". Errors (kUsage): not such a pose.
core::Result<geometry::Rigid3> parse_body(const std::string& text);

/// Pose of the camera in the body, by hand-eye calibration: X of A X = X B for the motions A of the body and
/// B of the camera between matched poses, first the rotation (Park and Martin 1994), then the lever, both by
/// least squares with weights against outliers. `scaled`: the estimate's lengths are off by a factor, which
/// is estimated with the lever. Errors (kInput): the motion does not determine it.
core::Result<geometry::Rigid3> fit_body(const std::vector<MatchedPose>& poses, bool scaled);

/// The errors before and after the body's pose is removed from the truth.
BodyReport body_report(const std::vector<MatchedPose>& poses, TrajectoryAlignment align,
                       const geometry::Rigid3& body_from_camera);
/// The body, where the motion determines one that explains a good part of the errors.
std::optional<BodyReport> notable_body(const std::vector<MatchedPose>& poses, TrajectoryAlignment align);
/// One sentence about a body that was found and not removed.
std::string body_warning(const BodyReport& body);

}  // namespace plumbline::evaluate
