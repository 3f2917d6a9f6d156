// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Parts of a pipeline that another visit of a finished map runs.
#include <string>

#include "plumbline/pipeline/graph.hpp"

namespace plumbline::pipeline {

/// Name of the stage that joining() adds, and of its type.
inline constexpr const char* kVisitStage = "visit";

/// The pipeline up to its map.db, without refinement, as YAML. Error (kUsage): nothing is tracked or stored.
core::Result<std::string> mapping_part(const Graph& graph);

/// The pipeline from merging on, which begins with finished maps and has a stage `visit` behind refinement,
/// as YAML. Error (kUsage): no maps are merged.
core::Result<std::string> joining_part(const Graph& graph);

}  // namespace plumbline::pipeline
