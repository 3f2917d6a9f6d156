// SPDX-License-Identifier: BSD-3-Clause
#include "option_flags.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

namespace plumbline::cli {
namespace {

std::string flag_name(const std::string& key) {
  std::string name = "--" + key;
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

std::string value_name(const core::OptionSpec& spec) {
  switch (spec.type) {
    case core::OptionType::kBoolean:
      return "on|off";
    case core::OptionType::kInteger:
      return "N";
    case core::OptionType::kNumber:
      return "NUMBER";
    case core::OptionType::kText:
      return "TEXT";
    case core::OptionType::kChoice:
      return fmt::format("{}", fmt::join(spec.choices, "|"));
    case core::OptionType::kNumbers:
      return "[N, ...]";
    case core::OptionType::kTextOrList:
      return "FILE|[...]";
  }
  return "VALUE";
}

}  // namespace

OptionFlags::OptionFlags(CLI::App& app, core::OptionTable& table, const std::vector<std::string>& left_out)
    : table_(table) {
  for (const core::OptionSpec& spec : table.specs()) {
    if (std::find(left_out.begin(), left_out.end(), spec.key) != left_out.end()) continue;
    auto flag = std::make_unique<Flag>();
    flag->key = spec.key;
    flag->type = spec.type;
    const bool shows_default = !spec.default_value.empty() && spec.default_value != "\"\"";
    flag->option =
        app.add_option(
               flag_name(spec.key), flag->text,
               shows_default ? fmt::format("{} (default: {})", spec.help, spec.default_value) : spec.help)
            ->type_name(value_name(spec));
    flags_.push_back(std::move(flag));
  }
}

core::Result<void> OptionFlags::apply() {
  core::ConfigProblems problems;
  for (const auto& flag : flags_) {
    if (flag->option->count() == 0) continue;
    core::ConfigNode value;
    value.kind = core::ConfigNode::Kind::kScalar;
    value.scalar = flag->text;
    if (flag->type == core::OptionType::kNumbers) {
      auto list = core::parse_yaml(flag->text, "");
      if (list) value = std::move(*list);
    }
    core::ConfigProblems found;
    table_.set(flag->key, value, "", found);
    for (core::ConfigProblem& problem : found) {
      problem.mark = {};
      problem.path = flag_name(flag->key);
      problems.push_back(std::move(problem));
    }
  }
  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));
  return {};
}

}  // namespace plumbline::cli
