// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A result folder as one HTML page: the map, whether to trust it, pictures, paths, tables.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"

namespace plumbline::report {

struct ReportRequest {
  std::filesystem::path result;  ///< folder of map or fuse
  std::filesystem::path output;  ///< empty: report.html in the folder
  std::filesystem::path truth;   ///< empty: none. A recording, a folder of recordings by robot, or a TUM file
  std::filesystem::path other;   ///< a second result, shown over the map to walk through; empty: none
  std::size_t points = 1500000;  ///< of the map to walk through, at most, thinned by voxels; 0: all
  std::string title;             ///< of the page; empty: the folder's name
  std::string client, address, date;  ///< for the first page; empty: left out
  std::filesystem::path logo;         ///< PNG, JPEG or SVG for the first page; empty: none
  bool replace = false;               ///< an earlier report, and nothing else, may be replaced
};

struct ReportSummary {
  std::filesystem::path file;
  std::uint64_t bytes = 0;
  std::vector<std::string> missing;  ///< missing parts of the page, with reasons; one line each
};

/// Writes the page: one file that holds its pictures and needs nothing else, the same bytes for the same
/// folder. Missing or damaged parts of the folder are left out and reported, on the page and in `missing`.
/// Errors: kInput (no result, an interrupted run, summary.json damaged, no truth that fits), kUsage (the file
/// exists), kOutput (cannot be written; nothing is left behind).
core::Result<ReportSummary> write_report(const ReportRequest& request, const core::Executor& executor,
                                         core::Log& log);

}  // namespace plumbline::report
