// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace plumbline::core {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string ending_of(const std::filesystem::path& file) { return lower(file.extension().string()); }

Character first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);

  // One byte of ASCII
  if (first < 0x80) return {first, 1};
  const std::size_t bytes = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || bytes > text.size()) return {};

  // Each further byte carries six bits
  std::uint32_t code = first & (0xffU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0U) != 0x80U) return {};
    code = (code << 6) | (byte(i) & 0x3fU);
  }

  // Overlong forms and surrogates are not valid UTF-8
  constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};  // a longer form than needed is none
  const bool surrogate = code >= 0xd800 && code <= 0xdfff;
  return code < kLeast[bytes] || code > 0x10ffff || surrogate ? Character{} : Character{code, bytes};
}

bool is_control(std::uint32_t code) { return code < 0x20 || (code >= 0x7f && code < 0xa0); }

/// Text for a terminal: invalid UTF-8 and control characters are made visible.
std::string printable(std::string_view text, Lines lines) {
  std::string shown;
  while (!text.empty()) {
    const Character c = first_character(text);
    if (c.bytes == 0) {
      shown += "\xef\xbf\xbd";
    } else if (!is_control(c.code) || (lines == Lines::kKept && (c.code == '\n' || c.code == '\t'))) {
      shown += text.substr(0, c.bytes);
    } else {
      shown += c.code == '\n' ? "\\n" : c.code == '\t' ? "\\t" : fmt::format("\\x{:02x}", c.code);
    }
    text.remove_prefix(std::max<std::size_t>(c.bytes, 1));
  }
  return shown;
}

std::string folder_name(std::string_view name) {
  std::string plain = printable(name);
  std::replace(plain.begin(), plain.end(), '/', '_');
  return plain == "." || plain == ".." ? "_" : plain;
}

}  // namespace plumbline::core
