// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "graph.hpp"
#include "plumbline/core/random.hpp"

namespace plumbline::check {

/// A number of variance 1, nearly normal: of sums of twelve even ones, which are the same on every machine.
double normal(core::SplitMix& random);

/// The motions that the graph found as far as they count in report.expected_m, and its draws for what remains
/// of that; empty where there is no graph.
std::vector<AnchorSamples> possible_errors(const CheckReport& report, const std::vector<GraphAnchor>& anchors,
                                           const GraphReport& graph);

}  // namespace plumbline::check
