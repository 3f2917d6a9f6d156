// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// How the pairs of a recording are found on disk, one function per layout.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

struct Layout {
  std::string format;
  std::vector<PairInfo> pairs;  ///< sorted by colour stamp; files with their folder in front
  std::optional<geometry::Trajectory> truth;
};

struct LayoutOptions {
  double max_pair_gap_s = 0.02;
  double fps = 30.0;  ///< for layouts without stamps
  double depth_delay_s = 0.0;
};

/// A stamped file of a list, with its place for messages.
struct StampedFile {
  double stamp = 0.0;
  std::string file;
  int line = 0;
};

/// The FrameSource behind every layout on disk.
std::unique_ptr<FrameSource> make_folder_source(std::string name, Layout layout, sensor::Camera camera);

bool looks_like_tum(const std::filesystem::path& folder);
bool looks_like_seven_scenes(const std::filesystem::path& folder);
bool looks_like_redwood(const std::filesystem::path& folder);

core::Result<Layout> read_tum(const std::filesystem::path& folder, const LayoutOptions& options,
                              core::Log& log);
core::Result<Layout> read_seven_scenes(const std::filesystem::path& folder, const LayoutOptions& options,
                                       core::Log& log);
core::Result<Layout> read_redwood(const std::filesystem::path& folder, const LayoutOptions& options,
                                  core::Log& log);

/// Pairs by when images were taken, depth `depth_delay_s` after its stamps: smallest difference first, each
/// file used once; both lists sorted by stamp. The result has the lists' stamps and is sorted by that of
/// colour.
std::vector<PairInfo> pair_by_stamp(const std::vector<StampedFile>& color,
                                    const std::vector<StampedFile>& depth, double max_gap_s,
                                    double depth_delay_s = 0.0);

/// What to say when pair_by_stamp finds nothing: the nearest gap, both ranges of time, what to do.
std::string no_common_time(const std::string& color_name, const std::vector<StampedFile>& color,
                           const std::string& depth_name, const std::vector<StampedFile>& depth,
                           double max_gap_s);

/// All of a list's files missing is an error that names the first one; some missing is a warning.
core::Result<void> check_files(const std::string& list, const std::vector<StampedFile>& files,
                               core::Log& log);

}  // namespace plumbline::dataset
