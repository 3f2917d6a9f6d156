// SPDX-License-Identifier: BSD-3-Clause
#include "text_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <fstream>

#include "plumbline/core/git_lfs.hpp"
#include "plumbline/core/shortage.hpp"

namespace plumbline::dataset {

/// Words without empty ones: separators may repeat.
std::vector<std::string> split_words(std::string_view text, std::string_view separators) {
  std::vector<std::string> words;
  for (std::size_t from = 0; (from = text.find_first_not_of(separators, from)) != std::string_view::npos;) {
    const std::size_t to = std::min(text.find_first_of(separators, from), text.size());
    words.emplace_back(text.substr(from, to - from));
    from = to;
  }
  return words;
}

core::Result<std::vector<RawLine>> read_raw_lines(const std::filesystem::path& file, std::size_t most) {
  errno = 0;
  std::ifstream stream(file);
  if (const std::string shortage = stream ? "" : core::shortage_of(errno); !shortage.empty())
    return core::output_error(fmt::format("{}: cannot be read: {}", file.string(), shortage));
  std::error_code ignored;
  if (!stream || std::filesystem::is_directory(file, ignored)) {
    return core::input_error(fmt::format("{}: cannot be read: missing, or no permission", file.string()));
  }

  // Only the first line has a mark of UTF-8
  std::vector<RawLine> lines;
  std::string text;
  for (int number = 1; lines.size() < most && std::getline(stream, text); ++number) {
    if (number == 1 && text.compare(0, 3, "\xEF\xBB\xBF") == 0) text.erase(0, 3);
    if (number == 1 && core::begins_as_lfs_pointer(text))
      return core::input_error(fmt::format("{}: {}", file.string(), core::kLfsPointer));
    lines.push_back({number, text});
  }
  return lines;
}

/// Lines with words, without comments.
core::Result<std::vector<TextLine>> read_lines(const std::filesystem::path& file) {
  const auto raw = read_raw_lines(file);
  if (!raw) return tl::unexpected(raw.error());
  std::vector<TextLine> lines;
  for (const RawLine& line : *raw) {
    TextLine words{line.number, split_words(line.text)};
    if (!words.words.empty() && words.words.front().front() != '#') lines.push_back(std::move(words));
  }
  return lines;
}

}  // namespace plumbline::dataset
