// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/session/options.hpp"
#include "plumbline/session/result.hpp"

namespace plumbline {

/// `plumbline map`: a recording, a bag or "synth:SCENE" in, a result folder out. `output` empty: a temporary
/// folder, which lives as long as the result and its copies. A result that must not be trusted is a result,
/// too: its verdict says why. Errors: kUsage (options, pipeline), kInput (recording), kOutput (folder),
/// kStopped (before there was anything to write).
core::Result<Result> map(const std::string& input, const std::filesystem::path& output = {},
                         const MapOptions& options = {});

/// `plumbline fuse`: result folders of several robots in, their common map out. Errors as of map().
core::Result<Result> fuse(const std::vector<std::filesystem::path>& maps,
                          const std::filesystem::path& output = {}, const FuseOptions& options = {});

/// `plumbline filter`: the cloud after a chain of filters: a shipped name ("map"), a file, or the list of
/// filters itself ("[{type: voxel_grid, leaf: 2 cm}]"). Of the options `filters`, `pipelines_folder` and
/// `threads` count. Errors (kUsage): all mistakes of the chain.
core::Result<cloud::CloudPtr> filter(const cloud::CloudConstPtr& cloud, const std::string& chain,
                                     const RunOptions& options = {});

/// The folder of the shipped pipelines, with cameras/, filters/ and scenes/: `chosen`, or if that is empty
/// share/plumbline/pipelines above the program or library that holds this code, or those of the source tree
/// it was built from. Errors (kUsage): not there.
core::Result<std::filesystem::path> find_pipelines(const std::filesystem::path& chosen = {});

/// A shipped calibration ("tum_fr1"), or a camera file of any program that is known. Errors (kUsage): no such
/// camera, or the file does not tell all that is needed.
core::Result<sensor::Camera> find_camera(const std::string& name_or_file,
                                         const std::filesystem::path& pipelines_folder = {});

}  // namespace plumbline
