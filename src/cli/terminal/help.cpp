// SPDX-License-Identifier: BSD-3-Clause
#include "terminal/help.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <utility>
#include <vector>

#include "plumbline/core/config.hpp"

namespace plumbline::cli {
namespace {

/// "HZ (0 to 1000)" for "HZ:FLOAT in [0 - 1000]", "tum|stray" for "TEXT:{tum,stray}".
std::string plain_type(std::string type) {
  static const std::vector<std::pair<std::regex, const char*>> rules = {
      {std::regex(R"(:(INT|UINT|FLOAT) in \[(\S+) - (\S+)\])"), " ($2 to $3)"},
      {std::regex(":FLOAT \\[TIME\\]"), ""},
      {std::regex(":NONNEGATIVE"), " (0 or more)"},
      {std::regex(":POSITIVE"), " (above 0)"},
      {std::regex(":may be empty"), " (may be empty)"},
      {std::regex("^U?INT\\b"), "N"},
      {std::regex("^FLOAT\\b"), "NUMBER"}};
  for (const auto& [pattern, plain] : rules) type = std::regex_replace(type, pattern, plain);

  const std::size_t open = type.find('{');
  if (open == std::string::npos) return type;
  type = type.substr(open + 1, type.find('}', open) - open - 1);
  std::replace(type.begin(), type.end(), ',', '|');
  return type;
}

/// "plumbline evaluate cloud"
std::string full_name(const CLI::App& command) {
  return command.get_parent() == nullptr ? command.get_name()
                                         : full_name(*command.get_parent()) + " " + command.get_name();
}

/// A word that was meant as an option.
bool is_flag(const std::string& word) { return word.size() > 1 && word.front() == '-'; }

std::string command_problem(const CLI::App& group, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::App* command :
       group.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); }))
    names.push_back(command->get_name());
  return fmt::format("there is no command '{}'{}", word, core::hint(word, names));
}

/// CLI11's own words, with numbers as people write them.
std::string plain_error(const std::string& text) {
  const std::string whole = std::regex_replace(text, std::regex(R"((\d)\.0{6}\b)"), "$1");
  return std::regex_replace(whole, std::regex(R"(Value (\S+) not in range 0 to \d{20,})"),
                            "'$1' is too small, or not a number");
}

/// A suggestion for a flag that does not exist.
std::string option_problem(const CLI::App& command, const std::string& word) {
  const std::string flag = word.substr(0, word.find('='));
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }

  const std::string near = core::did_you_mean(flag, names);
  std::string text = fmt::format("there is no option {}{}", flag,
                                 near.empty() ? "" : fmt::format("; did you mean {}?", near));
  if (command.get_option_no_throw("--set") != nullptr)
    text += "; options of stages are given by --set STAGE.OPTION=VALUE, see plumbline pipelines describe";
  return text;
}

}  // namespace

std::string PlainHelp::make_option_opts(const CLI::Option* option) const {
  std::string text = CLI::Formatter::make_option_opts(option);
  const std::string type = option->get_type_name();
  const std::size_t at = type.empty() ? std::string::npos : text.find(type);
  return at == std::string::npos ? text : text.replace(at, type.size(), plain_type(type));
}

std::string usage_problem(const CLI::App& app, const CLI::ParseError& error) {
  // The command that was reached
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().back();
  const std::string help = " (see " + full_name(*command) + " --help)";

  // The first unknown word
  const CLI::App* asked = command;  // the one that was given words it does not know
  while (asked->remaining().empty() && asked->get_parent() != nullptr) asked = asked->get_parent();
  const std::vector<std::string> words = asked->remaining();
  const auto flag = std::find_if(words.begin(), words.end(), is_flag);
  const auto word = std::find_if_not(words.begin(), words.end(), is_flag);

  // A missing command comes before unknown flags
  const int code = error.get_exit_code();
  const bool unknown = code == static_cast<int>(CLI::ExitCodes::ExtrasError);
  const bool missing = code == static_cast<int>(CLI::ExitCodes::RequiredError);
  if (missing && command->get_require_subcommand_min() > 0) {
    if (word != words.end()) return command_problem(*command, *word) + help;
    if (flag == words.end()) return "a command is required" + help;
  }

  // Flags are explained first: a word may be the value of one
  if ((unknown || missing) && flag != words.end()) return option_problem(*asked, *flag) + help;
  if (unknown && word != words.end()) return fmt::format("'{}' is one argument too many{}", *word, help);
  return plain_error(error.what()) + help;
}

}  // namespace plumbline::cli
