// SPDX-License-Identifier: BSD-3-Clause
#include <array>

#include "plumbline/core/text.hpp"
#include "plumbline/viz/svg_chart.hpp"

namespace plumbline::viz {
namespace {

/// Bytes of the character at the start of `text`, 0 if it is not allowed in a document.
std::size_t character_at(std::string_view text) {
  const auto [code, bytes] = core::first_character(text);
  const bool no_character = (code & 0xFFFEU) == 0xFFFEU || (code >= 0xFDD0 && code <= 0xFDEF);
  const bool control = core::is_control(code) && code != '\n' && code != '\t';
  return no_character || control ? 0 : bytes;
}

}  // namespace

std::string markup_text(std::string_view text) {
  static constexpr std::string_view kMarkup = "&<>\"'";
  static constexpr std::array<const char*, 5> kEntities{"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"};
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = character_at(text);

    // Markup is escaped, invalid UTF-8 replaced.
    const std::size_t markup = kMarkup.find(text.front());
    if (markup != std::string_view::npos) {
      out += kEntities[markup];
    } else {
      out += length > 0 ? text.substr(0, length) : std::string_view("\xEF\xBF\xBD");
    }
    text.remove_prefix(length > 0 ? length : 1);
  }
  return out;
}

}  // namespace plumbline::viz
