// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "reference/command_reference.hpp"

namespace plumbline::cli {

/// The manual page of a command, section 1, in the language of man(7). `program`: the whole program, to which
/// the pages of its commands refer.
std::string man_page(const CommandReference& command, const CommandReference& program);

}  // namespace plumbline::cli
