// SPDX-License-Identifier: BSD-3-Clause
#include "camera_files/text_words.hpp"

#include <algorithm>

namespace plumbline::sensor {

/// Words by line; comments and empty lines are left out.
std::vector<CameraLine> camera_text_lines(const std::string& text, std::string_view separators) {
  std::vector<CameraLine> lines;
  std::size_t begin = text.compare(0, 3, "\xEF\xBB\xBF") == 0 ? 3 : 0;
  for (int number = 1; begin < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line(text.data() + begin, end - begin);
    line = line.substr(0, line.find('#'));
    CameraLine words{number, {}};
    for (std::size_t from = 0; (from = line.find_first_not_of(separators, from)) != std::string_view::npos;) {
      const std::size_t to = std::min(line.find_first_of(separators, from), line.size());
      words.words.emplace_back(line.substr(from, to - from));
      from = to;
    }
    if (!words.words.empty()) lines.push_back(std::move(words));
    begin = end + 1;
  }
  return lines;
}

}  // namespace plumbline::sensor
