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

/// True if a frame shows nothing: hardly any depth, or a picture without contrast and corners.
bool shows_nothing(const sensor::RgbdFrame& frame, std::size_t corners);

/// Values of a tracked frame, comma-separated; `blind`: it shows nothing.
std::string row_columns(const mapping::FrameReport& report, bool blind);
/// The flag that row_columns() was given.
bool was_blind(const std::string& columns);
/// The names of these columns, comma-separated.
std::string row_column_names();
/// One line for every frame of the run, the unreadable ones too; `columns`: names of FrameRow::columns.
/// Errors (kOutput).
core::Result<void> write_frame_rows(const std::filesystem::path& file, const std::string& columns,
                                    const std::vector<FrameRow>& rows, std::size_t frames);

}  // namespace plumbline::pipeline
