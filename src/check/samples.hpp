// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "camera_part.hpp"
#include "plumbline/core/random.hpp"

namespace plumbline::check {

/// A number of variance 1, nearly normal: of sums of twelve even ones, which are the same on every machine.
double normal(core::SplitMix& random);

/// 32 numbers of mean square 1, other ones for each `number`.
std::array<double, geometry::kPoseSamples> factors_of(std::size_t number);

/// The motions that the graph found as far as they count in report.expected_m, those of the camera, and draws
/// of the graph for what remains of that; empty where there is no graph.
std::vector<AnchorSamples> possible_errors(const CheckReport& report, const std::vector<GraphAnchor>& anchors,
                                           const GraphReport& graph, const CameraPart& camera);

}  // namespace plumbline::check
