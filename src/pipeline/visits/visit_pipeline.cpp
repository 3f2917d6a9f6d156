// SPDX-License-Identifier: BSD-3-Clause
#include "visits/visit_pipeline.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <set>
#include <vector>

#include "plumbline/pipeline/data.hpp"

namespace plumbline::pipeline {
namespace {

/// Gives the output that an input of a stage reads in the new pipeline; empty: it stays open.
using SourceOf = std::function<std::string(const Node&, std::size_t input)>;

std::string part_as_yaml(const Graph& graph, const std::set<std::string>& types, const SourceOf& source_of) {
  std::string text;
  for (const Node& node : graph.nodes) {
    if (node.tap || types.count(node.type->name) == 0) continue;
    text += fmt::format("  {}:\n    type: {}\n", node.name, node.type->name);

    std::vector<std::string> inputs;
    for (std::size_t i = 0; i < node.inputs.size(); ++i) {
      const std::string source = node.inputs[i] ? source_of(node, i) : std::string();
      if (!source.empty()) inputs.push_back(fmt::format("{}: {}", node.type->inputs[i].name, source));
    }

    if (!inputs.empty()) text += fmt::format("    inputs: {{{}}}\n", fmt::join(inputs, ", "));
    for (const core::OptionSpec& spec : node.options.specs())
      text += fmt::format("    {}: {}\n", spec.key, node.options.value(spec.key));
  }
  return text;
}

std::string output_name(const Graph& graph, const OutputRef& from) {
  const Node& giver = graph.nodes[from.node];
  return giver.name + "." + giver.type->outputs[from.port].name;
}

/// Name of the last stage of a type; empty: there is none.
std::string last_of(const Graph& graph, const std::string& type) {
  std::string name;
  for (const Node& node : graph.nodes) {
    if (node.type->name == type) name = node.name;
  }
  return name;
}

core::Result<std::string> named_stage(const Graph& graph, const std::string& type) {
  std::string name = last_of(graph, type);
  if (!name.empty()) return name;
  return core::usage_error(fmt::format(
      "{}: has no stage '{}', which another visit of a map (--into) takes; choose another pipeline",
      graph.file.string(), type));
}

}  // namespace

core::Result<std::string> mapping_part(const Graph& graph) {
  const auto merge = named_stage(graph, "merge");
  if (!merge) return merge;
  for (const char* type : {"track", "cloud", "store"}) {
    if (auto name = named_stage(graph, type); !name) return name;
  }

  const std::set<std::string> types{"read", "features", "track", "cloud", "merge", "store"};
  return "description: a visit by itself\nstages:\n" +
         part_as_yaml(graph, types, [&](const Node& node, std::size_t i) -> std::string {
           const Port& port = node.type->inputs[i];
           if (node.type->name == "store" && port.type == map_port()) return *merge + ".map";
           return port.type == cloud_port() ? std::string() : output_name(graph, *node.inputs[i]);
         });
}

core::Result<std::string> joining_part(const Graph& graph) {
  const auto merge = named_stage(graph, "merge");
  if (!merge) return merge;
  const std::string refine = last_of(graph, "refine");
  const std::set<std::string> types{"merge", "refine", "fuse", "filter", "store", "output"};

  std::string text = "description: another visit of a finished map\nstages:\n  maps:\n    type: maps\n";
  text += part_as_yaml(graph, types, [&](const Node& node, std::size_t i) -> std::string {
    const Port& port = node.type->inputs[i];
    const OutputRef& from = *node.inputs[i];

    if (port.type == keyframe_cloud_port()) return "maps.cloud";
    if (port.type == maps_port()) return "maps.maps";
    if (port.type == map_port() && node.type->name != "refine") return std::string(kVisitStage) + ".map";
    return types.count(graph.nodes[from.node].type->name) != 0 ? output_name(graph, from) : std::string();
  });
  return text + fmt::format("  {}:\n    type: visit\n    inputs: {{map: {}.map}}\n", kVisitStage,
                            refine.empty() ? *merge : refine);
}

}  // namespace plumbline::pipeline
