// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/text.hpp"

#include <algorithm>
#include <cctype>

namespace plumbline::core {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string ending_of(const std::filesystem::path& file) { return lower(file.extension().string()); }

}  // namespace plumbline::core
