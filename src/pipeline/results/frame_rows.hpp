// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Lines of frames.csv (docs/reference/files.md): the only place that writes and reads them.
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/mapping/slam.hpp"
#include "plumbline/pipeline/data.hpp"

namespace plumbline::pipeline {

/// True if a frame shows nothing: hardly any depth, or a picture without contrast and corners.
bool shows_nothing(const sensor::RgbdFrame& frame, std::size_t corners);

/// The row of a frame that the tracker got; `robot`: first column, empty: there is none.
FrameRow row_of(std::size_t frame, const mapping::FrameReport& report, bool shows_nothing,
                const std::string& robot);
/// The names of its columns, comma-separated, without the robot's.
std::string row_column_names();

/// A row as a line of the file.
std::string to_line(const FrameRow& row);
/// Reads a line that row_of() and to_line() made; none: it is damaged.
std::optional<FrameRow> read_line(const std::string& line);
/// One line for every frame of the run, the unreadable ones too; `columns`: names of FrameRow::columns.
/// Errors (kOutput).
core::Result<void> write_frame_rows(const std::filesystem::path& file, const std::string& columns,
                                    const std::vector<FrameRow>& rows, std::size_t frames);

}  // namespace plumbline::pipeline
