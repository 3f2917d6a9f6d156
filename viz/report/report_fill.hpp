// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Tables and facts of a report, declared as texts with JSON pointers in them.
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "report_html.hpp"

namespace plumbline::report {

/// `pattern` with the values of `json` in its fields: "{/verified} of {/tried}". A field is a JSON pointer,
/// with a format after a colon unless it is a count: decimals and unit ("2 σ"), or "text". Units mm, deg and
/// % are converted from metres, radians and shares; without the blank ("1mm") the unit is left out.
std::string filled(const nlohmann::ordered_json& json, const std::string& pattern);

/// Facts by label and pattern.
Facts filled_facts(const nlohmann::ordered_json& json,
                   std::initializer_list<std::pair<const char*, const char*>> facts);

/// A table with a row for each JSON object.
class JsonTable {
 public:
  /// Heads as HtmlTable has them, and the patterns of their cells.
  explicit JsonTable(const std::vector<std::pair<const char*, const char*>>& columns);
  /// `cells`: texts of the first columns, instead of their patterns.
  void row(const nlohmann::ordered_json& json, std::vector<std::string> cells = {},
           const std::string& kind = {});
  [[nodiscard]] std::size_t rows() const { return table_.rows(); }
  [[nodiscard]] std::string html() const { return table_.html(); }

 private:
  std::vector<std::string> patterns_;
  HtmlTable table_;
};

}  // namespace plumbline::report
