// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Reference of the stages for users and editors, made from the stages' declarations.
#include <string>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/pipeline/stage.hpp"

namespace plumbline::pipeline {

/// JSON Schema (draft 7) of pipeline files. What needs the whole graph (inputs that fit, cycles, files
/// written twice) is beyond a schema and left to load_graph.
std::string pipeline_schema(const StageRegistry& registry);

/// Schema of one stage's map.
std::string stage_schema(const StageType& type, const StageRegistry& registry);

/// Options of one stage that are shown, in the order of their declaration; `all`: the advanced ones, too.
std::vector<core::OptionSpec> shown_options(const StageType& type, bool all = false);

/// Ports and options of one stage as Markdown, a section of stages_reference.
std::string stage_reference(const StageType& type, bool all = false);

/// docs/reference/stages.md: every stage, port type and tap.
std::string stages_reference(const StageRegistry& registry, bool all = false);

}  // namespace plumbline::pipeline
