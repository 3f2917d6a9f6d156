// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Truth beside a recording, frame by frame.
#include <string>
#include <vector>

#include "plumbline/synth/source.hpp"

namespace plumbline::synth {

/// Text of truth.csv: a row for each of the first frames, as many as `moving` has shares of the picture.
std::string describe_truth(const SynthSource& source, const std::vector<double>& moving);

/// Text of events.csv.
std::string describe_events(const SynthSource& source);

}  // namespace plumbline::synth
