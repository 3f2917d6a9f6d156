// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Opens the INPUT of a command, whatever its kind.
#include <filesystem>
#include <memory>
#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::pipeline {

/// A recording, "synth:SCENE?..." filmed on demand, or the address of a live camera ("ros2://0") where
/// options.live.open can open one. `scenes_folder` holds the shipped scenes.
core::Result<std::unique_ptr<dataset::FrameSource>> open_input(const std::string& input,
                                                               const dataset::OpenOptions& options,
                                                               const std::filesystem::path& scenes_folder,
                                                               const core::Executor& executor,
                                                               core::Log& log);

}  // namespace plumbline::pipeline
