// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "reference/command_reference.hpp"

namespace plumbline::cli {

/// The manual page of a command, section 1, in the language of man(7). `program` is the whole program, to
/// which others are pointed to.
std::string man_page(const CommandReference& command, const CommandReference& program);

}  // namespace plumbline::cli
