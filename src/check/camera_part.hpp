// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "graph.hpp"
#include "plumbline/check/self_check.hpp"

namespace plumbline::check {

/// Effect of the camera's uncertainty on the anchors, but for the path as a whole.
struct CameraPart {
  double rms_m = 0.0;
  std::vector<geometry::PoseSamples> draws;  ///< by anchor, in the world about its origin; empty: not known
};
CameraPart camera_part(const CheckInput& input, const std::vector<GraphAnchor>& anchors);

}  // namespace plumbline::check
