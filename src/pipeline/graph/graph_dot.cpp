// SPDX-License-Identifier: BSD-3-Clause
// A graph in Graphviz's DOT language.
#include <fmt/format.h>

#include "graph/graph_parts.hpp"
#include "plumbline/pipeline/graph.hpp"

namespace plumbline::pipeline {
namespace {

/// Stages whose name contains their type need no second line.
std::string label(const Node& node) {
  if (node.tap) return node.options.specs().empty() ? node.name : node.options.value("file");
  return node.name == node.type->name ? node.name : node.name + "\\n(" + node.type->name + ")";
}

std::string box(const Node& node) {
  std::string escaped;
  for (const char c : label(node)) escaped += c == '"' ? "\\\"" : std::string(1, c);
  const char* style = node.tap                 ? ", shape=note, fillcolor=\"#fff4d6\""
                      : node.type->is_source() ? ", fillcolor=\"#d9ead3\""
                      : node.type->exports     ? ", fillcolor=\"#f4dcd6\""
                                               : "";
  return fmt::format("  {} [label=\"{}\"{}];\n", quoted(node.name), escaped, style);
}

}  // namespace

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "\"";
}

std::string to_dot(const Graph& graph) {
  std::string text =
      "digraph pipeline {\n  rankdir=LR;\n"
      "  node [shape=box, style=\"rounded,filled\", fillcolor=\"#dce6f4\", fontname=\"sans-serif\"];\n"
      "  edge [fontname=\"sans-serif\", fontsize=10];\n";
  if (!graph.description.empty()) {
    text += fmt::format("  label={};\n  fontname=\"sans-serif\";\n", quoted(graph.description));
  }

  for (const Node& node : graph.nodes) text += box(node);

  // Solid edges carry a value for each frame, dashed ones a single value after the last frame.
  for (const Node& node : graph.nodes) {
    for (const auto& input : node.inputs) {
      if (!input) continue;
      const Node& giver = graph.nodes[input->node];
      const PortType& type = giver.type->outputs[input->port].type;
      text += fmt::format("  {} -> {} [label={}{}];\n", quoted(giver.name), quoted(node.name),
                          quoted(type.name), type.rate == Rate::kEnd ? ", style=dashed" : "");
    }
  }

  return text + "}\n";
}

}  // namespace plumbline::pipeline
