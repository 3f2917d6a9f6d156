// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Empty values on the command line: a variable of the shell that was not set, in quotes. An empty secret
// would be none, an empty path the working directory, so that options refuse them unless they say otherwise.
#include <CLI/CLI.hpp>
#include <string>

namespace plumbline::cli {

/// Lets this option take an empty value; --help says so.
CLI::Option* may_be_empty(CLI::Option* option);

/// Makes all other options and arguments of the command, and of those below it, refuse empty values. Called
/// when all are declared.
void refuse_empty_values(CLI::App& command);

/// The name in the first word like "--name=", "" if there is none: CLI11 would take the next word as its
/// value.
std::string empty_assignment(const CLI::App& app, int argc, const char* const* argv);

/// Message about an empty value.
extern const char* const kEmptyValue;

}  // namespace plumbline::cli
