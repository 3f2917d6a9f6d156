// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Columns of frames.csv behind `frame` and `state` (docs/reference/files.md), declared once.
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/mapping/slam.hpp"
#include "plumbline/pipeline/data.hpp"

namespace plumbline::pipeline {

/// Values of a tracked frame, comma-separated.
std::string row_columns(const mapping::FrameReport& report);
/// The names of these columns, comma-separated.
std::string row_column_names();
/// One line for every frame of the run, the unreadable ones too; `columns`: names of FrameRow::columns.
/// Errors (kOutput).
core::Result<void> write_frame_rows(const std::filesystem::path& file, const std::string& columns,
                                    const std::vector<FrameRow>& rows, std::size_t frames);

}  // namespace plumbline::pipeline
