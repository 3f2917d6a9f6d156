// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Declared options as flags of a command: `max_depth` becomes --max-depth VALUE.
#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/options.hpp"

namespace plumbline::cli {

class OptionFlags {
 public:
  /// Adds a flag for every option of `table` but those in `left_out`. Table and app outlive this.
  OptionFlags(CLI::App& app, core::OptionTable& table, const std::vector<std::string>& left_out = {});

  /// Sets what was given on the command line; all problems at once, each naming its flag.
  core::Result<void> apply();

 private:
  struct Flag {
    std::string key;
    core::OptionType type;
    std::string text;
    CLI::Option* option = nullptr;
  };
  core::OptionTable& table_;
  std::vector<std::unique_ptr<Flag>> flags_;
};

}  // namespace plumbline::cli
