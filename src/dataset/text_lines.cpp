// SPDX-License-Identifier: BSD-3-Clause
#include "text_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

namespace plumbline::dataset {

core::Result<std::vector<TextLine>> read_lines(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::error_code ignored;
  if (!stream || std::filesystem::is_directory(file, ignored)) {
    return core::input_error(fmt::format("{}: cannot be read: missing or no right", file.string()));
  }
  constexpr std::string_view separators = " \t\r\n,\v\f";
  std::vector<TextLine> lines;
  std::string text;
  for (int number = 1; std::getline(stream, text); ++number) {
    if (number == 1 && text.compare(0, 3, "\xEF\xBB\xBF") == 0) text.erase(0, 3);
    TextLine line{number, {}};
    for (std::size_t from = 0; (from = text.find_first_not_of(separators, from)) != std::string::npos;) {
      const std::size_t to = std::min(text.find_first_of(separators, from), text.size());
      line.words.push_back(text.substr(from, to - from));
      from = to;
    }
    if (!line.words.empty() && line.words.front().front() != '#') lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace plumbline::dataset
