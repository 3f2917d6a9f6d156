// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Camera files that are plain text, line by line.
#include <string>
#include <string_view>
#include <vector>

namespace plumbline::sensor {

struct CameraLine {
  int number = 0;  ///< counts from 1
  std::vector<std::string> words;
};

/// Lines of words, which are separated by `separators`; comments ('#'), blank lines and a byte order mark are
/// skipped.
std::vector<CameraLine> camera_text_lines(const std::string& text, std::string_view separators);

}  // namespace plumbline::sensor
