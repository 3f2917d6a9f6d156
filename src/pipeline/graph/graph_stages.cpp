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

void read_stage(const StageRegistry& registry, Draft& draft, ConfigProblems& problems,
                std::vector<std::string>& warnings) {
  const ConfigNode& body = *draft.body;
  if (body.kind != Kind::kMap) {
    problems.push_back({draft.mark, draft.path, "must be a map with a type, e.g. {type: read}"});
    return;
  }
  const ConfigNode* type = body.find("type");
  if (type == nullptr || type->kind != Kind::kScalar) {
    problems.push_back({type != nullptr ? type->mark : draft.mark, draft.path,
                        fmt::format("needs a type (allowed: {})", fmt::join(registry.names(), ", "))});
    return;
  }
  draft.node.type = registry.find(type->scalar);
  if (draft.node.type == nullptr) {
    problems.push_back({type->mark, draft.path + ".type",
                        fmt::format("unknown stage type '{}'{}", type->scalar.substr(0, 40),
                                    core::hint(type->scalar, registry.names()))});
    return;
  }
  draft.node.stage = draft.node.type->make();
  draft.node.stage->declare(draft.node.options);
  std::vector<std::string> others{"type", "inputs"};
  for (const auto& [key, value] : body.entries) {
    if (!is_retired(key)) continue;
    others.push_back(key);
    warnings.push_back(fmt::format("{}.{}: has no effect", draft.path, key));
  }
  draft.node.options.set_all(body, draft.path, problems, others);
}

}  // namespace

bool is_retired(const std::string& key) { return key == "solver.max_iterations"; }

std::size_t find_draft(const Drafts& drafts, const std::string& name) {
  const auto found =
      std::find_if(drafts.begin(), drafts.end(), [&](const Draft& d) { return d.node.name == name; });
  return static_cast<std::size_t>(found - drafts.begin());
}

std::vector<std::string> names_of(const Drafts& drafts) {
  std::vector<std::string> names;
  for (const Draft& draft : drafts) {
    if (!draft.node.tap) names.push_back(draft.node.name);
  }
  return names;
}

Drafts read_stages(const ConfigNode& root, const StageRegistry& registry, ConfigProblems& problems,
                   std::vector<std::string>& warnings) {
  Drafts drafts;
  const ConfigNode* stages = root.find("stages");
  if (stages == nullptr || stages->kind != Kind::kMap || stages->entries.empty()) {
    problems.push_back({stages != nullptr ? stages->mark : root.mark, "stages",
                        "must be a map of stages, e.g. read: {type: read}"});
    return drafts;
  }
  for (std::size_t i = 0; i < stages->entries.size(); ++i) {
    const auto& [name, body] = stages->entries[i];
    if (!is_stage_name(name)) {
      problems.push_back({stages->key_marks[i], "stages." + name,
                          "a stage's name is made of a-z, 0-9 and _, a letter first"});
    }
    Draft draft;
    draft.node.name = name;
    draft.mark = stages->key_marks[i];
    draft.path = "stages." + name;
    draft.body = &body;
    read_stage(registry, draft, problems, warnings);
    drafts.push_back(std::move(draft));
  }
  return drafts;
}

}  // namespace plumbline::pipeline
