// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Whether text is well-formed XML as our pages are: tags closed in order, attributes quoted, entities known.
#include <cctype>
#include <set>
#include <string>
#include <vector>

namespace plumbline::testing_markup {

/// Where `text` is not well-formed; empty when it is.
inline std::string malformed_at(const std::string& text) {
  const auto here = [&](std::size_t at) {
    return "at byte " + std::to_string(at) + ": " + text.substr(at, 60);
  };
  static const std::set<std::string> kEntities{"amp", "lt", "gt", "quot", "#39"};
  std::vector<std::string> open;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '&') {
      const std::size_t end = text.find(';', i);
      if (end == std::string::npos || kEntities.count(text.substr(i + 1, end - i - 1)) == 0) return here(i);
    }
    if (text[i] != '<') continue;
    const std::size_t tag = i;
    if (text.compare(i, 9, "<!DOCTYPE") == 0) {
      i = text.find('>', i);
      continue;
    }
    const bool closing = text[++i] == '/';
    std::size_t name_end = i += closing ? 1U : 0U;
    while (name_end < text.size() && (std::isalnum(static_cast<unsigned char>(text[name_end])) != 0))
      ++name_end;
    const std::string name = text.substr(i, name_end - i);
    if (name.empty()) return here(tag);
    std::size_t end = name_end;
    for (bool quoted = false; end < text.size() && (quoted || text[end] != '>'); ++end) {
      if (text[end] == '"') quoted = !quoted;
      if (text[end] == '<') return here(tag);  // neither in an attribute nor in a tag
    }
    if (end >= text.size()) return here(tag);
    i = end;
    if (closing) {
      if (open.empty() || open.back() != name) return here(tag);
      open.pop_back();
    } else if (text[end - 1] != '/') {
      open.push_back(name);
      if (name == "style" || name == "script") i = text.find("</" + name + ">", end) - 1;
    }
  }
  return open.empty() ? std::string() : "not closed: " + open.back();
}

inline std::size_t count_of(const std::string& what, const std::string& text) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

}  // namespace plumbline::testing_markup
