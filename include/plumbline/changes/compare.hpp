// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Two maps of one place, made on two days, and what has changed between them: `plumbline compare`.
#include <filesystem>
#include <string>

#include "plumbline/changes/changes.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/exports/export.hpp"

namespace plumbline::changes {

/// Which of two maps is the later one.
enum class Order {
  kStamps,  ///< as their stamps say, where both have the time of day and do not overlap; else as given
  kGiven
};

struct CompareRequest {
  std::filesystem::path before, after;  ///< result folders, map.db, or clouds
  std::filesystem::path output;         ///< folder
  ChangeOptions options;
  Order order = Order::kStamps;
  int points = 1500000;         ///< of each map, at most; 0: all
  exports::OpenRecording open;  ///< for small pictures of keyframes in the page; null: none
  bool replace = false;         ///< an earlier comparison may be replaced
};

struct CompareSummary {
  Comparison comparison;
  std::string placing;   ///< a sentence: how the maps were laid together, and how well
  bool swapped = false;  ///< AFTER was the earlier one by its stamps
  std::string text;      ///< for a terminal, several lines
};

/// Lays AFTER over BEFORE, finds what has changed and writes `output`: changes.ply, changes.csv,
/// summary.json, changes.html, pictures (docs/reference/files.md), in BEFORE's frame. Errors: kUntrustworthy:
/// nothing shows how the two lie, or they do not fit; kInput, kUsage, kOutput.
core::Result<CompareSummary> compare_maps(const CompareRequest& request, const core::Executor& executor,
                                          core::Log& log, const exports::ExportProgress& progress);

}  // namespace plumbline::changes
