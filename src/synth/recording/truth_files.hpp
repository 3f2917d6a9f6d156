// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Truth beside a recording, frame by frame.
#include <memory>
#include <string>
#include <vector>

#include "plumbline/synth/source.hpp"

namespace plumbline::synth {

/// Text of truth.csv: a row for each of the first frames, as many as `moving` has shares of the picture.
std::string describe_truth(const SynthSource& source, const std::vector<double>& moving);

/// Text of events.csv.
std::string describe_events(const SynthSource& source);

/// Text of rig.yaml, as `plumbline map --rig` reads it: the cameras of one body relative to the first one.
/// `folders`: names of their recordings.
std::string describe_rig(const std::vector<std::unique_ptr<SynthSource>>& cameras,
                         const std::vector<std::string>& folders);

}  // namespace plumbline::synth
