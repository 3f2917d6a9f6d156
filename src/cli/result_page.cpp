// SPDX-License-Identifier: BSD-3-Clause
#include "result_page.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "plumbline/core/json.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kWidth = 110;
constexpr std::size_t kListedObjects = 4;  ///< lists of more objects, such as robots, are counted

/// The text in lines of kWidth, broken at spaces; further lines are indented. A word that is longer stays
/// whole.
std::string wrapped(const std::string& text) {
  std::string lines;
  std::size_t column = 0;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    begin = end + 1;

    if (column > 0 && column + 1 + word.size() > kWidth) {
      lines += "\n   ";
      column = 3;
    }
    lines += (lines.empty() ? "" : " ") + word;
    column += word.size() + 1;
  }
  return lines + "\n";
}

/// "57 entries of from, to, inliers", for a list that is too long to be read.
std::string counted(const Json& list) {
  std::string fields;
  if (!list.empty() && list.front().is_object()) {
    for (const auto& [name, value] : list.front().items()) fields += (fields.empty() ? "" : ", ") + name;
  }
  return fmt::format("{} entries{}{}", list.size(), fields.empty() ? "" : ": ", fields);
}

/// One line per value; long lists are counted.
void add(const Json& value, const std::string& name, std::string& page) {
  if (value.is_object()) {
    for (const auto& [key, below] : value.items()) add(below, name.empty() ? key : name + "." + key, page);
    return;
  }

  const std::string text = value.is_string() ? value.get<std::string>() : core::json_text(value, -1);
  const bool list = value.is_array() && name.size() + 2 + text.size() > kWidth;
  if (list && value.size() <= kListedObjects && value.front().is_object()) {
    for (std::size_t i = 0; i < value.size(); ++i) add(value[i], fmt::format("{}[{}]", name, i), page);
    return;
  }
  page += wrapped(core::printable(name + ": " + (list ? counted(value) : text)));
}

}  // namespace

std::string result_page(const Json& summary) {
  std::string page;
  add(summary, "", page);
  return page;
}

}  // namespace plumbline::cli
