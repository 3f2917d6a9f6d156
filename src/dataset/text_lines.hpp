// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Lines of a text file as words, the way every list in this module is read.
#include <cstddef>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::dataset {

struct TextLine {
  int number = 0;  ///< counts from 1
  std::vector<std::string> words;
};

/// An unchanged line, without its end.
struct RawLine {
  int number = 0;  ///< counts from 1
  std::string text;
};

inline constexpr std::string_view kWordSeparators = " \t\r\n,\v\f";

/// Words between the separators.
std::vector<std::string> split_words(std::string_view text, std::string_view separators = kWordSeparators);

/// All lines, or the first `most`, comments and blank ones too, without a byte order mark. Error (kInput):
/// cannot be read.
core::Result<std::vector<RawLine>> read_raw_lines(const std::filesystem::path& file,
                                                  std::size_t most = std::numeric_limits<std::size_t>::max());

/// Words are separated by blanks, tabs or commas. Comments ('#'), blank lines, a byte order mark and
/// carriage returns are passed over.
core::Result<std::vector<TextLine>> read_lines(const std::filesystem::path& file);

/// For lists that are to be in the order of time.
inline constexpr auto kByStamp = [](const auto& a, const auto& b) { return a.stamp < b.stamp; };

}  // namespace plumbline::dataset
