// SPDX-License-Identifier: BSD-3-Clause
// Stages of a pipeline's tree, made and with their options read.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "graph/graph_parts.hpp"

namespace plumbline::pipeline {
namespace {

using core::ConfigNode;
using core::ConfigProblems;
using Kind = ConfigNode::Kind;

bool is_stage_name(const std::string& name) {
  const auto allowed = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  return !name.empty() && name[0] >= 'a' && name[0] <= 'z' && std::all_of(name.begin(), name.end(), allowed);
}

void read_stage(const StageRegistry& registry, StageSpec& spec, ConfigProblems& problems) {
  const ConfigNode& body = *spec.body;
  if (body.kind != Kind::kMap) {
    problems.push_back({spec.mark, spec.path, "must be a map with a type, e.g. {type: read}"});
    return;
  }

  const ConfigNode* type = body.find("type");
  if (type == nullptr || type->kind != Kind::kScalar) {
    problems.push_back({type != nullptr ? type->mark : spec.mark, spec.path,
                        fmt::format("needs a type (allowed: {})", fmt::join(registry.names(), ", "))});
    return;
  }

  spec.node.type = registry.find(type->scalar);
  if (spec.node.type == nullptr) {
    problems.push_back({type->mark, spec.path + ".type",
                        fmt::format("unknown stage type '{}'{}", type->scalar.substr(0, 40),
                                    core::hint(type->scalar, registry.names()))});
    return;
  }

  // Options are declared by the stage itself; type and inputs are keys of the graph and not among them.
  spec.node.stage = spec.node.type->make();
  spec.node.stage->declare(spec.node.options);
  spec.node.options.set_all(body, spec.path, problems, {"type", "inputs"});
}

}  // namespace

std::size_t find_spec(const StageSpecs& specs, const std::string& name) {
  const auto found =
      std::find_if(specs.begin(), specs.end(), [&](const StageSpec& d) { return d.node.name == name; });
  return static_cast<std::size_t>(found - specs.begin());
}

std::vector<std::string> names_of(const StageSpecs& specs) {
  std::vector<std::string> names;
  for (const StageSpec& spec : specs) {
    if (!spec.node.tap) names.push_back(spec.node.name);
  }
  return names;
}

StageSpecs read_stages(const ConfigNode& root, const StageRegistry& registry, ConfigProblems& problems) {
  StageSpecs specs;
  const ConfigNode* stages = root.find("stages");
  if (stages == nullptr || stages->kind != Kind::kMap || stages->entries.empty()) {
    problems.push_back({stages != nullptr ? stages->mark : root.mark, "stages",
                        "must be a map of stages, e.g. read: {type: read}"});
    return specs;
  }

  for (std::size_t i = 0; i < stages->entries.size(); ++i) {
    const auto& [name, body] = stages->entries[i];
    if (!is_stage_name(name)) {
      problems.push_back({stages->key_marks[i], "stages." + name,
                          "a stage's name is made of a-z, 0-9 and _, a letter first"});
    }

    // A stage with problems is kept: without it, every stage that reads from it would be reported too.
    StageSpec spec;
    spec.node.name = name;
    spec.mark = stages->key_marks[i];
    spec.path = "stages." + name;
    spec.body = &body;
    read_stage(registry, spec, problems);
    specs.push_back(std::move(spec));
  }

  return specs;
}

}  // namespace plumbline::pipeline
