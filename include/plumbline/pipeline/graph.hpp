// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A pipeline file as a checked graph of stages.
//
//   description: what this pipeline is for
//   stages:
//     read: {type: read}
//     features:
//       type: features
//       inputs: {frame: read}          # input: stage, or stage.port when it gives several of the kind
//       points: 1000                   # an option of the stage
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/pipeline/stage.hpp"

namespace plumbline::pipeline {

/// Port `port` of the outputs of node `node`.
struct OutputRef {
  std::size_t node = 0;
  std::size_t port = 0;
};

struct Node {
  std::string name;
  const StageType* type = nullptr;  ///< owned by the registry, which outlives the graph
  std::unique_ptr<Stage> stage;
  core::OptionTable options;
  std::vector<std::optional<OutputRef>> inputs;  ///< one per input port; none = optional and left open
};

/// Checked: every stage type known, every required input connected to a port of its type, no cycle, one
/// source, nothing unused, every option in range.
struct Graph {
  std::string description;
  std::vector<Node> nodes;  ///< each after all it reads from; otherwise in file order

  [[nodiscard]] const Node& source() const;
};

/// Reads and checks a whole pipeline file; nothing is started. `overrides` are "stage.key=value" texts of the
/// command line, later ones win; their problems read "--set stage.key: ...". All problems are told at once.
core::Result<Graph> load_graph(const std::filesystem::path& file, const StageRegistry& registry,
                               const std::filesystem::path& pipelines_folder,
                               const std::vector<std::string>& overrides = {});

/// The same from YAML text; `file` is for messages and for files named relative to it.
core::Result<Graph> parse_graph(const std::string& yaml, const std::filesystem::path& file,
                                const StageRegistry& registry, const std::filesystem::path& pipelines_folder,
                                const std::vector<std::string>& overrides = {});

/// The effective configuration: every option of every stage; load_graph reads it back.
std::string to_yaml(const Graph& graph);

/// Shipped pipelines by name or any file by path. Errors (kUsage) suggest the nearest name.
core::Result<std::filesystem::path> find_pipeline(const std::string& name_or_file,
                                                  const std::filesystem::path& pipelines_folder);

/// Names of the pipelines in a folder, sorted.
std::vector<std::string> pipeline_names(const std::filesystem::path& pipelines_folder);

}  // namespace plumbline::pipeline
