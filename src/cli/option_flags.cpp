// SPDX-License-Identifier: BSD-3-Clause
#include "option_flags.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <utility>
#include <vector>

#include "empty_values.hpp"

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
      return spec.length == 0 ? "N,N,..."
                              : fmt::format("{}", fmt::join(std::vector<std::string>(spec.length, "N"), ","));
    case core::OptionType::kTextOrList:
      return "FILE|[...]";
  }

  return "VALUE";
}

/// "1,2 3,4" and "[1, 2, 3, 4]" alike, in brackets.
std::string as_list(const std::string& text) {
  if (text.empty() || text.front() == '[') return text;
  std::string list = "[";
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool between = text[i] == ' ' && i > 0 && i + 1 < text.size() &&
                         std::isdigit(static_cast<unsigned char>(text[i - 1])) != 0 &&
                         (std::isdigit(static_cast<unsigned char>(text[i + 1])) != 0 || text[i + 1] == '-' ||
                          text[i + 1] == '.');
    list += between ? ',' : text[i];
  }
  return list + "]";
}

}  // namespace

/// One flag for each option of the table.
void OptionFlags::add_flags() {
  for (const core::OptionSpec& spec : table_.specs()) {
    const bool shows_default = !spec.default_value.empty() && spec.default_value != "\"\"";
    const std::string help =
        shows_default ? fmt::format("{} (default: {})", spec.help, spec.default_value) : spec.help;
    CLI::Option* flag = command_->add_option(flag_name(spec.key), help)->type_name(value_name(spec));
    if (spec.empty == core::EmptyValue::kAllowed) may_be_empty(flag);
  }
}

/// Values pass the checks of configuration files.
core::Result<void> OptionFlags::apply() {
  core::ConfigProblems problems;
  for (const core::OptionSpec& spec : table_.specs()) {
    const std::string name = flag_name(spec.key);
    const CLI::Option& flag = *command_->get_option(name);
    if (flag.count() == 0) continue;
    core::ConfigNode value;
    value.kind = core::ConfigNode::Kind::kScalar;
    value.scalar = flag.as<std::string>();
    if (spec.type == core::OptionType::kNumbers) {
      if (auto list = core::parse_yaml(as_list(value.scalar), "")) value = std::move(*list);
    }
    core::ConfigProblems found;
    table_.set(spec.key, value, "", found);
    for (core::ConfigProblem& problem : found) problems.push_back({{}, name, std::move(problem.what)});
  }
  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));
  return {};
}

std::set<std::string> OptionFlags::given() const {
  std::set<std::string> keys;
  for (const core::OptionSpec& spec : table_.specs()) {
    if (command_->get_option(flag_name(spec.key))->count() > 0) keys.insert(spec.key);
  }
  return keys;
}

}  // namespace plumbline::cli
