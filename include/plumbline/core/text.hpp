// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Words and endings whose capitals do not matter; text of others made fit to be shown.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace plumbline::core {

/// The text with ASCII's capitals as small letters.
std::string lower(std::string text);

/// The ending of a file's name in small letters, with its point: ".ply"; "": it has none.
std::string ending_of(const std::filesystem::path& file);

/// A character of UTF-8: its code and its number of bytes; 0 bytes: the text does not begin with one.
struct Character {
  std::uint32_t code = 0;
  std::size_t bytes = 0;
};
/// The first character of a text that is not empty.
Character first_character(std::string_view text);
/// C0, DEL and C1: a terminal would obey them.
bool is_control(std::uint32_t code);

/// Ends of lines are escaped if they are part of a name, and kept if they are part of the text.
enum class Lines { kEscaped, kKept };

/// The text as a terminal, a log or a picture may show it, whatever names of files and robots hold: valid
/// UTF-8, each other byte as U+FFFD, and control characters, which a terminal would obey, as "\n" or "\x1b".
std::string printable(std::string_view text, Lines lines = Lines::kEscaped);

/// A name of a recording or a robot that is printable, and that a folder may have: "/" becomes "_", as do "."
/// and "..".
std::string folder_name(std::string_view name);

}  // namespace plumbline::core
