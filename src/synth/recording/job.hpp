// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Work on the recording of one robot. Private to the module.
#include <cstdint>
#include <filesystem>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/synth/recording.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::synth {

/// Threads, end and listeners of a run.
struct RecordingRun {
  const core::Executor& executor;
  const core::StopToken& stop;
  core::Log& log;
};

/// State of one robot's recording.
struct RecordingJob {
  const SynthSource& source;
  const SynthOptions& options;
  std::filesystem::path folder;
  std::uint64_t seed;
  const RecordingRun& run;
  Progress progress;  ///< frames of this recording, and all of them
};

}  // namespace plumbline::synth
