// SPDX-License-Identifier: BSD-3-Clause
#include "empty_values.hpp"

namespace plumbline::cli {
namespace {

const char* const kMayBeEmpty = "may be empty";

bool takes_empty(const CLI::Option& option) {
  return option.get_type_name().find(kMayBeEmpty) != std::string::npos;
}

}  // namespace

const char* const kEmptyValue =
    "is empty; give a value, or leave it out (is a variable of the shell not set?)";

CLI::Option* may_be_empty(CLI::Option* option) {
  return option->check([](const std::string& /*text*/) { return std::string(); }, kMayBeEmpty);
}

void refuse_empty_values(CLI::App& command) {
  for (CLI::Option* option : command.get_options()) {
    if (option->get_items_expected_max() == 0 || takes_empty(*option)) continue;  // a flag has no value

    // As the first check of all, so that no other one words it differently.
    option->transform(CLI::Validator(
        [](std::string& text) { return text.empty() ? std::string(kEmptyValue) : std::string(); }, ""));
  }
  for (CLI::App* below : command.get_subcommands([](CLI::App* /*any*/) { return true; }))
    refuse_empty_values(*below);
}

/// The first flag of the command that ends with an equals sign.
std::string empty_assignment(const CLI::App& app, int argc, const char* const* argv) {
  const CLI::App* command = &app;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") break;
    const auto named =
        command->get_subcommands([&](const CLI::App* below) { return below->get_name() == word; });
    if (!named.empty()) command = named.front();

    const std::size_t equals = word.find('=');
    if (word.rfind("--", 0) != 0 || equals == std::string::npos || equals + 1 != word.size()) continue;
    const std::string name = word.substr(0, equals);
    if (command->get_option_no_throw(name) != nullptr) return name;
  }
  return {};
}

}  // namespace plumbline::cli
