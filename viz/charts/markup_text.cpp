// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstdint>

#include "plumbline/viz/svg_chart.hpp"

namespace plumbline::viz {
namespace {

/// Bytes of the character at the start of `text`, 0 if it is not allowed in a document.
std::size_t character_at(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t lead = byte(0);
  if (lead < 0x80) return (lead >= 0x20 && lead != 0x7F) || lead == '\n' || lead == '\t' ? 1 : 0;
  const std::size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < length) return 0;
  std::uint32_t code = lead & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
    code = code << 6U | (byte(i) & 0x3FU);
  }
  const bool overlong = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  const bool control = code < 0xA0;
  const bool no_character = (code & 0xFFFEU) == 0xFFFEU || (code >= 0xFDD0 && code <= 0xFDEF);
  return overlong || surrogate || control || no_character || code > 0x10FFFF ? 0 : length;
}

}  // namespace

std::string markup_text(std::string_view text) {
  static constexpr std::string_view kMarkup = "&<>\"'";
  static constexpr std::array<const char*, 5> kEntities{"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"};
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = character_at(text);
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
