// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/stage.hpp"

#include <algorithm>
#include <system_error>

#include "graph/graph_parts.hpp"

namespace plumbline::pipeline {

std::filesystem::path CheckContext::find(const std::string& file) const {
  if (file.empty()) return {};
  std::error_code ignored;
  for (const auto& folder : {pipeline_folder, pipelines_folder}) {
    const std::filesystem::path candidate = folder / file;  // an absolute `file` replaces the folder
    if (std::filesystem::is_regular_file(candidate, ignored)) return candidate;
  }
  return {};
}

std::filesystem::path CheckContext::find(const std::string& file, const core::ConfigMark& mark) const {
  if (mark.file == kCommandLineFile) {
    std::error_code ignored;
    const std::filesystem::path candidate = std::filesystem::current_path(ignored) / file;
    if (!file.empty() && std::filesystem::is_regular_file(candidate, ignored)) return candidate;
  }
  const bool in_a_file = mark.line > 0 && !mark.file.empty();
  return CheckContext{in_a_file ? std::filesystem::path(mark.file).parent_path() : pipeline_folder,
                      pipelines_folder, filters}
      .find(file);
}

bool StageType::is_source() const {
  const auto per_frame = [](const Port& port) { return port.type.rate == Rate::kFrame; };
  return std::none_of(inputs.begin(), inputs.end(), per_frame) &&
         std::any_of(outputs.begin(), outputs.end(), per_frame);
}

std::vector<core::OptionSpec> StageType::options() const {
  const std::unique_ptr<Stage> stage = make();
  core::OptionTable table;
  stage->declare(table);
  return table.specs();
}

void StageRegistry::add(StageType type) {
  if (find(type.name) != nullptr) throw std::logic_error("stage type registered twice: " + type.name);
  types_.push_back(std::make_shared<const StageType>(std::move(type)));
}

StageTypePtr StageRegistry::find(const std::string& name) const {
  for (const auto& type : types_) {
    if (type->name == name) return type;
  }
  return nullptr;
}

void StageRegistry::add_tap(StageType type) {
  if (type.inputs.size() != 1 || !type.outputs.empty()) throw std::logic_error("not a tap: " + type.name);
  if (find_tap(type.inputs[0].type) != nullptr) throw std::logic_error("tapped twice: " + type.name);
  taps_.push_back(std::make_shared<const StageType>(std::move(type)));
}

StageTypePtr StageRegistry::find_tap(const PortType& type) const {
  for (const auto& tap : taps_) {
    if (tap->inputs[0].type == type) return tap;
  }
  return nullptr;
}

std::vector<std::string> StageRegistry::names() const {
  std::vector<std::string> names;
  for (const auto& type : types_) names.push_back(type->name);
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace plumbline::pipeline
