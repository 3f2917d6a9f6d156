// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Columns of frames.csv behind `frame` and `state` (docs/reference/files.md), declared once.
#include <string>

#include "plumbline/mapping/slam.hpp"

namespace plumbline::pipeline {

/// Values of a tracked frame, comma-separated.
std::string row_columns(const mapping::FrameReport& report);
/// The names of these columns, comma-separated.
std::string row_column_names();

}  // namespace plumbline::pipeline
