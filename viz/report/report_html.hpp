// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pieces of an HTML page. All given text is escaped here, except where it is called HTML.
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plumbline/viewer/page.hpp"
#include "plumbline/viz/svg_chart.hpp"

namespace plumbline::report {

/// "1 519 937"; like all of these, a dash if not known (NaN).
std::string count_text(double count);
/// Number with its unit: "12.3 ms".
std::string number_text(double value, int decimals, std::string_view unit = {});
/// "54.7 MB"
std::string bytes_text(double bytes);

using viewer::base64;

class HtmlTable {
 public:
  /// The columns' heads, with units and '|' between; those of numbers, which stand to the right, begin with
  /// '>': "file|>size".
  explicit HtmlTable(const std::string& columns);
  /// `kind`: CSS class of the row.
  void row(const std::vector<std::string>& cells, const std::string& kind = {});
  [[nodiscard]] std::size_t rows() const { return rows_; }
  /// Empty when there are no rows.
  [[nodiscard]] std::string html() const;

 private:
  std::vector<std::string> columns_;
  std::size_t rows_ = 0;
  std::string body_;
};

/// Table with a column for each robot; without heads for a single robot without a name.
class RobotTable {
 public:
  /// A robot's column, to be filled from the top.
  void robot(const std::string& name) { names_.push_back(name); }
  /// Adds a value of the latest robot.
  void value(const std::string& name, const std::string& value);
  [[nodiscard]] std::string html() const;

 private:
  std::vector<std::string> names_;
  std::vector<std::pair<std::string, std::vector<std::string>>> rows_;
};

using Facts = std::vector<std::pair<std::string, std::string>>;
/// Name and value, line by line; those without a value are left out.
std::string facts_html(const Facts& facts);
/// The same in large type, in one row.
std::string tiles_html(const Facts& facts);
std::string paragraph(const std::string& text);
std::string note(const std::string& text);
/// Section that can be folded up to its title; folded unless `open`.
std::string folded(const std::string& title, const std::string& html, bool open = false);

/// A part of the page with its place in the table of contents.
struct Section {
  std::string id;
  std::string title;
  std::string html;     ///< empty: the part is left out
  bool behind = false;  ///< of how the result was made: folded, behind all others
};

/// Text by which a file is recognised as a report.
inline const char* const kReportGenerator = "plumbline report";

/// CSS of the page: light, dark and on paper.
const char* report_style();

/// The whole page.
std::string page_html(const std::string& title, const std::string& head_html,
                      const std::vector<Section>& sections, const std::string& foot);

}  // namespace plumbline::report
