// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pictures of graphs, laid out and drawn by Graphviz; needs no display.
#include <filesystem>
#include <string>

#include "plumbline/core/error.hpp"

namespace plumbline::viz {

/// Draws a graph of the DOT language to .png, .svg or .pdf; the file appears whole or not at all. Errors:
/// kUsage (another ending, text that is not DOT), kOutput (the file cannot be written). Not thread-safe:
/// Graphviz is not.
core::Result<void> draw_graph(const std::string& dot, const std::filesystem::path& file);

}  // namespace plumbline::viz
