// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A recording as an MCAP file.
#include <filesystem>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/dataset/body_readings.hpp"
#include "plumbline/synth/recording.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::synth {

/// Returns the number of frames in the file; fewer than the source has if stopped, and no file if that is
/// none. `progress`: frames of this recording, and all of them.
core::Result<std::size_t> write_mcap(const SynthSource& source, const std::filesystem::path& file,
                                     const dataset::BodyReadings* body, const core::Executor& executor,
                                     const core::StopToken& stop, const Progress& progress, core::Log& log);

}  // namespace plumbline::synth
