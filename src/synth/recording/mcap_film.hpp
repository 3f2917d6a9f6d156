// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A recording as an MCAP file.
#include <filesystem>

#include "plumbline/dataset/body_readings.hpp"
#include "recording/job.hpp"

namespace plumbline::synth {

/// Returns the number of frames in the file; fewer than the source has if stopped, and no file if that is
/// none.
core::Result<std::size_t> write_mcap(const RecordingJob& job, const std::filesystem::path& file,
                                     const dataset::BodyReadings& body);

}  // namespace plumbline::synth
