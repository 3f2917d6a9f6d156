// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A pipeline file as a checked graph of stages. docs/guide/pipelines.md describes pipeline files.
//
//   description: what this pipeline is for
//   include: rgbd.yaml                   # begin with the stages of another file
//   remove: [refine]                     # but without these
//   stages:
//     read: {type: read}
//     features:
//       type: features
//       inputs: {frame: read}            # input: stage, or stage.port when it gives several of the kind
//       points: 1000                     # an option of the stage
//   taps:
//     - {port: fuse.cloud, file: raw.ply}  # write what flows through a port
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
  std::string name;  ///< of a tap: "tap:stage.port"
  StageTypePtr type;
  std::unique_ptr<Stage> stage;
  core::OptionTable options;
  std::vector<std::optional<OutputRef>> inputs;  ///< one per input port; none = optional and left open
  bool tap = false;                              ///< only writes what it reads
};

/// Checked: every stage type known, every required input connected to a port of its type, no cycle, one
/// source, nothing unused, every option in range, every file written once.
struct Graph {
  std::filesystem::path file;  ///< file that it was read from
  std::string description;
  std::vector<Node> nodes;  ///< each after all it reads from; otherwise in file order, taps last

  [[nodiscard]] const Node& source() const;
  [[nodiscard]] std::size_t stage_count() const;  ///< taps do not count
};

/// Reads and checks a whole pipeline file and what it includes; nothing is started. `overrides` are
/// "stage.key=value" texts of the command line, later ones win; their problems read "--set stage.key: ...".
/// All problems are reported at once.
core::Result<Graph> load_graph(const std::filesystem::path& file, const StageRegistry& registry,
                               const std::filesystem::path& pipelines_folder,
                               const std::vector<std::string>& overrides = {});

/// The same from YAML text; `file` is for messages and for files named relative to it.
core::Result<Graph> parse_graph(const std::string& yaml, const std::filesystem::path& file,
                                const StageRegistry& registry, const std::filesystem::path& pipelines_folder,
                                const std::vector<std::string>& overrides = {});

/// The effective configuration: every option of every stage; load_graph reads it back.
std::string to_yaml(const Graph& graph);

/// The graph in Graphviz's DOT language: boxes are stages, arrows carry the names of port types, dashed ones
/// flow once after the last frame.
std::string to_dot(const Graph& graph);

}  // namespace plumbline::pipeline
