// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The commands as data, read from the declarations that --help is made from: man pages and completion are
// made of it.
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace plumbline::cli {

/// One flag, option or positional argument.
struct ArgumentReference {
  std::vector<std::string> flags;    ///< "-o", "--output"; empty: a positional argument
  std::string name;                  ///< of a positional: "INPUT"
  std::string value;                 ///< "OUT", "N", "on|off"; empty: a flag that takes none
  std::vector<std::string> choices;  ///< all values that are allowed, where they are a list
  std::string help;
  bool required = false;
  bool repeated = false;  ///< takes several values, or may be given several times

  [[nodiscard]] bool positional() const { return flags.empty(); }
  [[nodiscard]] bool takes_value() const { return positional() || !value.empty(); }
};

struct CommandReference {
  std::vector<std::string> words;  ///< "evaluate", "cloud"; empty: the program itself
  std::string help;                ///< one line
  std::vector<ArgumentReference> arguments;
  std::string footer;  ///< below the help: examples, tables
  std::vector<CommandReference> commands;

  /// "plumbline evaluate cloud", with `separator` between the words.
  [[nodiscard]] std::string name(const std::string& separator) const;
  [[nodiscard]] const CommandReference* find(const std::string& word) const;
};

/// Reference of a command and all below it, without hidden ones.
CommandReference command_reference(const CLI::App& app);

}  // namespace plumbline::cli
