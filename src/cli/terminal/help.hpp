// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The text of --help, and messages on command lines that cannot be understood.
#include <CLI/CLI.hpp>
#include <string>

namespace plumbline::cli {

/// CLI11's help with types and ranges in words.
class PlainHelp : public CLI::Formatter {
 public:
  [[nodiscard]] std::string make_option_opts(const CLI::Option* option) const override;
};

/// Message on a command line that `app` does not take: what is wrong, and the nearest name that exists.
std::string usage_problem(const CLI::App& app, const CLI::ParseError& error);

}  // namespace plumbline::cli
