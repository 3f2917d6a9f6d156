// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Results on standard output, in which names of files and robots cannot move the cursor or change the title.
#include <fmt/format.h>

#include <string>
#include <utility>

#include "plumbline/core/text.hpp"

namespace plumbline::cli {

/// As fmt::print; what a terminal would obey is escaped, ends of lines and tabs are kept.
template <typename... Args>
void print(fmt::format_string<Args...> format, Args&&... args) {
  const std::string text = fmt::format(format, std::forward<Args>(args)...);
  fmt::print("{}", core::printable(text, core::Lines::kKept));
}

}  // namespace plumbline::cli
