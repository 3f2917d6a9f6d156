// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Declared options as flags of a command: `max_depth` becomes --max-depth VALUE.
#include <CLI/CLI.hpp>
#include <set>
#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/core/options.hpp"

namespace plumbline::cli {

class OptionFlags {
 public:
  /// Adds a flag for each option of `options`. Options and command must outlive this.
  template <typename Options>
  void add(CLI::App& command, Options& options) {
    command_ = &command;
    options.declare(table_);
    add_flags();
  }

  /// Applies the values given on the command line; reports all problems at once, each naming its flag.
  core::Result<void> apply();
  /// Keys of the options that were given on the command line.
  [[nodiscard]] std::set<std::string> given() const;

 private:
  void add_flags();

  CLI::App* command_ = nullptr;
  core::OptionTable table_;
};

}  // namespace plumbline::cli
