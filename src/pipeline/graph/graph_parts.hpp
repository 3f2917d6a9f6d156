// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The steps from a pipeline file to a Graph, one file each. All of them add to the problems and continue.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/config.hpp"
#include "plumbline/pipeline/graph.hpp"

namespace plumbline::pipeline {

/// A stage or tap of the file, from which a Node is made.
struct StageSpec {
  Node node;
  core::ConfigMark mark;
  std::string path;
  const core::ConfigNode* body = nullptr;
  std::vector<std::size_t> reads_from;  ///< specs; also where only the port is wrong, for the cycle check
  std::vector<std::string> set;         ///< keys that the command line gave
  bool dangling = false;                ///< has an input that leads nowhere: the stage it meant is not unused
};
using StageSpecs = std::vector<StageSpec>;

/// The "file" of marks of values that stand on the command line.
inline constexpr const char* kCommandLineFile = "--set";

inline const std::vector<std::string> kTopKeys{"description", "include", "remove", "stages", "taps", "run"};

/// Index of the stage of that name; specs.size() when there is none.
std::size_t find_spec(const StageSpecs& specs, const std::string& name);
std::vector<std::string> names_of(const StageSpecs& specs);

/// graph_dot.cpp: text between quotation marks, as Graphviz and YAML read it.
std::string quoted(const std::string& text);

/// graph_include.cpp: the file's tree with the stages and taps of the files it includes; marks keep naming
/// the file that contains each part. None if too little can be read to continue.
std::optional<core::ConfigNode> with_includes(core::ConfigNode own, const std::filesystem::path& file,
                                              const std::filesystem::path& pipelines_folder,
                                              core::ConfigProblems& problems);

/// graph_stages.cpp: the stages of a tree, made and their options read. `root` must outlive the specs.
StageSpecs read_stages(const core::ConfigNode& root, const StageRegistry& registry,
                       core::ConfigProblems& problems);

/// graph_connect.cpp: resolves the inputs of every stage.
void connect(StageSpecs& specs, core::ConfigProblems& problems);

/// graph_taps.cpp: adds the taps of a tree behind the stages.
void add_taps(const core::ConfigNode& root, const StageRegistry& registry, StageSpecs& specs,
              core::ConfigProblems& problems);

/// graph_set.cpp: "stage.key=value" texts of the command line.
void apply_overrides(const std::vector<std::string>& texts, StageSpecs& specs,
                     core::ConfigProblems& problems);

/// graph_shape.cpp: an order in which every stage comes after those it reads from; cycles, unused stages,
/// missing and second sources are problems.
std::vector<std::size_t> checked_order(const StageSpecs& specs, core::ConfigProblems& problems);

/// graph_files.cpp: no file is written twice.
void check_files(const StageSpecs& specs, core::ConfigProblems& problems);

}  // namespace plumbline::pipeline
