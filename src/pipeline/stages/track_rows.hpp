// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What frames.csv says of a tracked frame.
#include <string>

#include "plumbline/mapping/slam.hpp"

namespace plumbline::pipeline {

/// Names of row_columns, comma-separated.
extern const char* const kRowColumns;
std::string row_columns(const mapping::FrameReport& report);

}  // namespace plumbline::pipeline
