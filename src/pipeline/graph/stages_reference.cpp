// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "graph/option_levels.hpp"
#include "plumbline/core/option_schema.hpp"
#include "plumbline/pipeline/reference.hpp"

namespace plumbline::pipeline {
namespace {

constexpr const char* kIntroduction =
    "<!-- Made by `plumbline pipelines describe`; a test compares. -->\n"
    "# Stages\n\n"
    "The stages that `stages:` of a [pipeline file](../guide/pipelines.md) may list. Lengths, angles and "
    "times "
    "may carry a unit\n"
    "(`5 mm`, `10 deg`, `0.5 s`); without one a number is in the unit of its default. `plumbline pipelines "
    "describe STAGE --all`\n"
    "also shows the advanced options.\n";

constexpr const char* kTaps =
    "\n## Taps\n\n"
    "`taps:` of a pipeline writes what flows through a port to the result folder. By the type of the "
    "port:\n\n"
    "| port type | file | what is written |\n|---|---|---|\n";

std::string rate_text(Rate rate) { return rate == Rate::kFrame ? "each frame" : "once, at the end"; }

std::string ports(const StageType& type) {
  if (type.inputs.empty() && type.outputs.empty()) return "";
  std::string text = "| port | | type | |\n|---|---|---|---|\n";
  for (const Port& port : type.inputs) {
    text += fmt::format("| `{}` | {} | {} | {} |\n", port.name,
                        port.required ? "input" : "input, may be left open", port.type.name,
                        rate_text(port.type.rate));
  }
  for (const Port& port : type.outputs) {
    text +=
        fmt::format("| `{}` | output | {} | {} |\n", port.name, port.type.name, rate_text(port.type.rate));
  }
  return text;
}

std::string tap_row(const StageType& tap) {
  std::string file;
  for (const core::OptionSpec& spec : tap.options()) {
    if (spec.key == "file") file = spec.help;
  }
  return fmt::format("| {} | {} | {} |\n", tap.name, file, tap.help);
}

}  // namespace

std::vector<core::OptionSpec> shown_options(const StageType& type, bool all) {
  std::vector<core::OptionSpec> shown;
  for (core::OptionSpec& spec : type.options()) {
    const OptionLevel level = option_level(type.name, spec.key);
    if (level == OptionLevel::kBasic || (all && level == OptionLevel::kAdvanced))
      shown.push_back(std::move(spec));
  }
  return shown;
}

std::string stage_reference(const StageType& type, bool all) {
  std::string text = fmt::format("## {}\n\n{}.\n\n{}", type.name, type.help, ports(type));
  const std::string table = core::options_as_markdown(shown_options(type, all));
  return table.empty() ? text : text + "\n" + table;
}

std::string stages_reference(const StageRegistry& registry, bool all) {
  std::string text = kIntroduction;
  for (const StageTypePtr& type : registry.types()) text += "\n" + stage_reference(*type, all);
  text += kTaps;
  for (const StageTypePtr& tap : registry.taps()) text += tap_row(*tap);
  text += "\nTaps of frames and features take `every: N` as well: each N-th frame only.\n";
  return text;
}

}  // namespace plumbline::pipeline
