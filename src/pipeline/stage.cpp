// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/stage.hpp"

#include <algorithm>
#include <system_error>

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

bool StageType::is_source() const {
  const auto per_frame = [](const Port& port) { return port.type.rate == Rate::kFrame; };
  return std::none_of(inputs.begin(), inputs.end(), per_frame) &&
         std::any_of(outputs.begin(), outputs.end(), per_frame);
}

void StageRegistry::add(StageType type) {
  if (find(type.name) != nullptr) throw std::logic_error("stage type registered twice: " + type.name);
  types_.push_back(std::make_unique<const StageType>(std::move(type)));
}

const StageType* StageRegistry::find(const std::string& name) const {
  for (const auto& type : types_) {
    if (type->name == name) return type.get();
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
