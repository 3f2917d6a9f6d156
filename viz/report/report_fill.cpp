// SPDX-License-Identifier: BSD-3-Clause
#include "report_fill.hpp"

#include <algorithm>
#include <cmath>

#include "report_data.hpp"

namespace plumbline::report {
namespace {

using Json = nlohmann::ordered_json;

double scale_of(const std::string& unit) {
  if (unit == "mm") return 1e3;
  if (unit == "%") return 100.0;
  return unit == "deg" ? 180.0 / M_PI : 1.0;
}

/// The value of a field, "/pointer" or "/pointer:format".
std::string value_of(const Json& json, const std::string& field) {
  const std::size_t colon = field.find(':');
  const std::string pointer = field.substr(0, colon);
  if (colon == std::string::npos) return count_text(number_at(json, pointer));
  const std::string format = field.substr(colon + 1);
  if (format == "text") return text_at(json, pointer);

  const int decimals = format[0] - '0';
  const bool shown = format.size() > 1 && format[1] == ' ';
  const std::string unit = format.substr(std::min(format.size(), shown ? std::size_t{2} : std::size_t{1}));
  return number_text(scale_of(unit) * number_at(json, pointer), decimals, shown ? unit : "");
}

std::string heads(const std::vector<std::pair<const char*, const char*>>& columns) {
  std::string text;
  for (const auto& [head, pattern] : columns) text += (text.empty() ? "" : "|") + std::string(head);
  return text;
}

}  // namespace

std::string filled(const Json& json, const std::string& pattern) {
  std::string text;
  for (std::size_t at = 0; at < pattern.size();) {
    const std::size_t open = std::min(pattern.find('{', at), pattern.size());
    text += pattern.substr(at, open - at);
    if (open == pattern.size()) break;

    // A name in braces becomes its value.
    const std::size_t close = pattern.find('}', open);
    text += value_of(json, pattern.substr(open + 1, close - open - 1));
    at = close + 1;
  }
  return text;
}

Facts filled_facts(const Json& json, std::initializer_list<std::pair<const char*, const char*>> facts) {
  Facts values;
  for (const auto& [label, pattern] : facts) values.emplace_back(label, filled(json, pattern));
  return values;
}

JsonTable::JsonTable(const std::vector<std::pair<const char*, const char*>>& columns)
    : table_(heads(columns)) {
  for (const auto& [head, pattern] : columns) patterns_.emplace_back(pattern);
}

void JsonTable::row(const Json& json, std::vector<std::string> cells, const std::string& kind) {
  while (cells.size() < patterns_.size()) cells.push_back(filled(json, patterns_[cells.size()]));
  table_.row(cells, kind);
}

}  // namespace plumbline::report
