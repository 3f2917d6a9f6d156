// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/graph.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <system_error>

#include "graph/graph_parts.hpp"

namespace plumbline::pipeline {
namespace {

using core::ConfigNode;
using core::ConfigProblems;
using Kind = ConfigNode::Kind;

/// A stage's own checks only know the stage's position; a problem of one of its keys is reported at the key.
void check_stage(StageSpec& spec, const CheckContext& context, ConfigProblems& problems) {
  ConfigProblems found;
  spec.node.stage->check(context, spec.mark, spec.path, found);
  for (core::ConfigProblem& problem : found) {
    const std::string prefix = spec.path + ".";
    if (problem.path.compare(0, prefix.size(), prefix) == 0) {
      const std::string key = problem.path.substr(prefix.size());
      const ConfigNode* value = spec.body->find(key);
      if (std::find(spec.set.begin(), spec.set.end(), key) != spec.set.end()) {
        problem.mark = {kCommandLineFile, 0, 0};
        problem.path = spec.node.name + "." + key;
      } else if (value != nullptr) {
        problem.mark = value->mark;
      }
    }
    problems.push_back(std::move(problem));
  }
}

void read_description(const ConfigNode& root, Graph& graph, ConfigProblems& problems) {
  const ConfigNode* text = root.find("description");
  if (text == nullptr) return;
  if (text->kind != Kind::kScalar) problems.push_back({text->mark, "description", "must be a text"});
  graph.description = text->scalar;
}

void assemble(const std::vector<std::size_t>& order, StageSpecs& specs, Graph& graph) {
  std::map<std::size_t, std::size_t> place;  // spec -> node
  for (const std::size_t d : order) {
    place[d] = graph.nodes.size();
    graph.nodes.push_back(std::move(specs[d].node));
    for (auto& input : graph.nodes.back().inputs) {
      if (input) input->node = place.at(input->node);
    }
  }
}

core::Result<Graph> build_graph(std::optional<ConfigNode> own, const std::filesystem::path& file,
                                const StageRegistry& registry, const std::filesystem::path& pipelines_folder,
                                const std::vector<std::string>& overrides, ConfigProblems problems) {
  const auto refuse = [&] { return tl::unexpected(core::to_error(problems)); };
  if (!own) return refuse();

  Graph graph;
  graph.file = file;
  const auto root = with_includes(std::move(*own), file, pipelines_folder, problems);
  if (!root) return refuse();

  // All steps add to one list of problems, so that a user sees every mistake of a file at once.
  read_description(*root, graph, problems);
  StageSpecs specs = read_stages(*root, registry, problems);
  connect(specs, problems);
  add_taps(*root, registry, specs, problems);
  apply_overrides(overrides, specs, problems);

  // Stages are checked after --set, as they must see the values that the run will use.
  const CheckContext context{file.parent_path(), pipelines_folder, &registry.filters()};
  for (StageSpec& spec : specs) {
    if (spec.node.stage) check_stage(spec, context, problems);
  }

  const std::vector<std::size_t> order = checked_order(specs, problems);
  check_files(specs, problems);
  if (!problems.empty()) return refuse();
  assemble(order, specs, graph);
  return graph;
}

/// "stage.port" that an input reads from.
std::string port_name(const Graph& graph, const OutputRef& from) {
  const Node& giver = graph.nodes[from.node];
  return giver.name + "." + giver.type->outputs[from.port].name;
}

/// "key: value", lists of maps with a line for each.
std::string option_as_yaml(const Node& node, const std::string& key) {
  const std::string value = node.options.value(key);
  const auto tree = core::parse_yaml(value, key);
  if (!tree || tree->kind != Kind::kSequence || tree->items.empty() || tree->items[0].kind != Kind::kMap) {
    return fmt::format("    {}: {}\n", key, value);
  }
  std::string text = fmt::format("    {}:\n", key);
  for (const ConfigNode& item : tree->items) text += fmt::format("      - {}\n", core::to_flow_yaml(item));
  return text;
}

std::string stage_as_yaml(const Graph& graph, const Node& node) {
  std::string text = fmt::format("  {}:\n    type: {}\n", node.name, node.type->name);
  std::vector<std::string> inputs;
  for (std::size_t i = 0; i < node.inputs.size(); ++i) {
    if (!node.inputs[i]) continue;
    inputs.push_back(fmt::format("{}: {}", node.type->inputs[i].name, port_name(graph, *node.inputs[i])));
  }
  if (!inputs.empty()) text += fmt::format("    inputs: {{{}}}\n", fmt::join(inputs, ", "));
  for (const core::OptionSpec& spec : node.options.specs()) {
    text += option_as_yaml(node, spec.key);
  }
  return text;
}

std::string tap_as_yaml(const Graph& graph, const Node& node) {
  std::string text = fmt::format("  - port: {}\n", port_name(graph, *node.inputs[0]));
  for (const core::OptionSpec& spec : node.options.specs()) {
    text += option_as_yaml(node, spec.key);
  }
  return text;
}

}  // namespace

const Node& Graph::source() const {
  for (const Node& node : nodes) {
    if (node.type->is_source()) return node;
  }
  throw std::logic_error("a checked graph has a source");
}

std::size_t Graph::stage_count() const {
  return static_cast<std::size_t>(
      std::count_if(nodes.begin(), nodes.end(), [](const Node& node) { return !node.tap; }));
}

core::Result<Graph> load_graph(const std::filesystem::path& file, const StageRegistry& registry,
                               const std::filesystem::path& pipelines_folder,
                               const std::vector<std::string>& overrides) {
  ConfigProblems problems;
  auto root = core::read_yaml(file, problems);
  return build_graph(std::move(root), file, registry, pipelines_folder, overrides, std::move(problems));
}

core::Result<Graph> parse_graph(const std::string& yaml, const std::filesystem::path& file,
                                const StageRegistry& registry, const std::filesystem::path& pipelines_folder,
                                const std::vector<std::string>& overrides) {
  ConfigProblems problems;
  auto root = core::parse_yaml(yaml, file.string(), problems);
  return build_graph(std::move(root), file, registry, pipelines_folder, overrides, std::move(problems));
}

std::string to_yaml(const Graph& graph) {
  std::string text;
  if (!graph.description.empty()) {
    ConfigNode description;
    description.kind = Kind::kScalar;
    description.quoted = true;
    description.scalar = graph.description;
    std::replace(description.scalar.begin(), description.scalar.end(), '\n', ' ');
    text += fmt::format("description: {}\n", core::to_flow_yaml(description));
  }
  text += "stages:\n";
  std::string taps;
  for (const Node& node : graph.nodes) {
    (node.tap ? taps : text) += node.tap ? tap_as_yaml(graph, node) : stage_as_yaml(graph, node);
  }
  return taps.empty() ? text : text + "taps:\n" + taps;
}

}  // namespace plumbline::pipeline
