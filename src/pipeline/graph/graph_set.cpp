// SPDX-License-Identifier: BSD-3-Clause
// "--set stage.key=value".
#include <fmt/format.h>

#include <string>
#include <utility>

#include "graph/graph_parts.hpp"
#include "plumbline/core/renamed_options.hpp"

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

/// "stage.key=value" with the name that the option has now.
std::string renamed(const std::string& text, std::vector<std::string>& warnings) {
  const std::size_t dot = text.find('.'), equals = text.find('=');
  if (dot == std::string::npos || equals == std::string::npos || equals < dot) return text;
  const std::string path = text.substr(0, equals);
  const std::string now = core::renamed_setting(path.substr(0, dot), path.substr(dot + 1));
  if (now != path) warnings.push_back(fmt::format("--set {}: is called {} now", path, now));
  return now + text.substr(equals);
}

void apply(const std::string& text, StageSpecs& specs, ConfigProblems& problems,
           std::vector<std::string>& warnings) {
  const auto refuse = [&](const std::string& path, std::string what) {
    problems.push_back({kCommandLine, path, std::move(what)});
  };
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
  if (key == "type" || key == "inputs") {
    return refuse(path, "only options can be set; change the graph in a pipeline file");
  }
  if (specs[target].node.type == nullptr) return;  // reported already
  if (is_retired(key)) return warnings.push_back(fmt::format("--set {}: has no effect", path));
  specs[target].node.options.set(key, *value, stage, problems);
  specs[target].set.push_back(key);
}

}  // namespace

void apply_overrides(const std::vector<std::string>& texts, StageSpecs& specs, ConfigProblems& problems,
                     std::vector<std::string>& warnings) {
  for (const std::string& text : texts) apply(renamed(text, warnings), specs, problems, warnings);
}

}  // namespace plumbline::pipeline
