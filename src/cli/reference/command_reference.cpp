// SPDX-License-Identifier: BSD-3-Clause
#include "reference/command_reference.hpp"

#include <algorithm>
#include <cctype>

namespace plumbline::cli {
namespace {

/// Parts between separators; empty ones count.
std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(at, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

/// False for placeholders, which begin with a capital: "on|off" is a list of choices, "NAME|FILE" is not.
bool is_literal(const std::string& word) {
  return !word.empty() &&
         std::none_of(word.begin(), word.end(), [](unsigned char c) { return std::isupper(c); });
}

/// The list in "TEXT:{tum,7scenes}" or "prior|given|ignore"; empty: any value may be given.
std::vector<std::string> choices_in(const std::string& type) {
  const std::size_t open = type.find('{');
  const std::string value = type.substr(0, type.find(':'));

  if (value.find('|') != std::string::npos) {
    std::vector<std::string> words = split(value, '|');
    return std::all_of(words.begin(), words.end(), is_literal) ? words : std::vector<std::string>();
  }

  if (open == std::string::npos) return {};
  return split(type.substr(open + 1, type.find('}', open) - open - 1), ',');
}

/// Flags, value and choices of an option.
ArgumentReference argument_reference(const CLI::Option& option) {
  ArgumentReference argument;
  for (const std::string& name : option.get_snames()) argument.flags.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) argument.flags.push_back("--" + name);
  argument.name = argument.flags.empty() ? option.get_name(true) : argument.flags.back();
  argument.help = option.get_description();
  argument.required = option.get_required();

  if (option.get_items_expected_max() == 0) return argument;
  const std::string type = option.get_type_name();
  argument.value = type.substr(0, type.find(':'));
  argument.choices = choices_in(type);
  argument.repeated = option.get_items_expected_max() > 1;
  return argument;
}

void add_commands(const CLI::App& app, CommandReference& reference) {
  for (const CLI::App* command :
       app.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); })) {
    CommandReference below = command_reference(*command);
    reference.commands.push_back(std::move(below));
  }
}

}  // namespace

std::string CommandReference::name(const std::string& separator) const {
  std::string text = "plumbline";
  for (const std::string& word : words) text += separator + word;
  return text;
}

const CommandReference* CommandReference::find(const std::string& word) const {
  const auto found = std::find_if(commands.begin(), commands.end(), [&](const CommandReference& command) {
    return command.words.back() == word;
  });
  return found == commands.end() ? nullptr : &*found;
}

/// The command with all that it contains.
CommandReference command_reference(const CLI::App& app) {
  CommandReference reference;
  for (const CLI::App* a = &app; a->get_parent() != nullptr; a = a->get_parent())
    reference.words.insert(reference.words.begin(), a->get_name());
  reference.help = app.get_description();
  reference.footer = app.get_footer();

  for (const CLI::Option* option :
       app.get_options([](const CLI::Option* o) { return !o->get_group().empty(); }))
    reference.arguments.push_back(argument_reference(*option));
  add_commands(app, reference);
  return reference;
}

}  // namespace plumbline::cli
