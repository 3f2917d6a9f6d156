// SPDX-License-Identifier: BSD-3-Clause
// "--set stage.key=value".
#include <fmt/format.h>

#include <string>
#include <utility>

#include "graph/graph_parts.hpp"

namespace plumbline::pipeline {
namespace {

using core::ConfigMark;
using core::ConfigNode;
using core::ConfigProblems;

const ConfigMark kCommandLine{kCommandLineFile, 0, 0};

void place_on_command_line(ConfigNode& node) {
  node.mark = kCommandLine;
  for (ConfigNode& item : node.items) place_on_command_line(item);
  for (auto& [key, value] : node.entries) place_on_command_line(value);
  for (ConfigMark& mark : node.key_marks) mark = kCommandLine;
}

void apply(const std::string& text, StageSpecs& specs, ConfigProblems& problems) {
  const auto refuse = [&](const std::string& path, std::string what) {
    problems.push_back({kCommandLine, path, std::move(what)});
  };

  // Keys contain dots themselves (camera.refine), so the name of the stage ends at the first one.
  const std::size_t equals = text.find('=');
  const std::size_t dot = text.find('.');
  if (equals == std::string::npos || dot == std::string::npos || dot == 0 || dot + 1 >= equals) {
    return refuse(text, "write it as stage.key=value, e.g. --set features.points=off");
  }

  const std::string path = text.substr(0, equals);
  const std::string stage = text.substr(0, dot);
  const std::string key = text.substr(dot + 1, equals - dot - 1);
  auto value = core::parse_yaml(text.substr(equals + 1), path);
  if (!value) return refuse(path, "the value is not valid YAML");

  if (equals + 1 == text.size()) value->kind = ConfigNode::Kind::kScalar;  // "stage.key=" is the empty text
  place_on_command_line(*value);
  const std::size_t target = find_spec(specs, stage);
  if (target == specs.size()) {
    return refuse(path, fmt::format("there is no stage '{}'{}", stage, core::hint(stage, names_of(specs))));
  }

  // The graph has been connected already, from the file alone: options are all that can still change.
  if (key == "type" || key == "inputs") {
    return refuse(path, "only options can be set; change the graph in a pipeline file");
  }

  if (specs[target].node.type == nullptr) return;  // reported already
  specs[target].node.options.set(key, *value, stage, problems);
  specs[target].set.push_back(key);
}

}  // namespace

void apply_overrides(const std::vector<std::string>& texts, StageSpecs& specs, ConfigProblems& problems) {
  for (const std::string& text : texts) apply(text, specs, problems);
}

}  // namespace plumbline::pipeline
