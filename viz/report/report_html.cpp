// SPDX-License-Identifier: BSD-3-Clause
#include "report_html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace plumbline::report {
namespace {

using viz::markup_text;
const char* const kUnknown = "\u2013";
const char* const kThinSpace = "\u202F";

bool of_numbers(const std::string& column) { return column.rfind('>', 0) == 0; }

}  // namespace

std::string count_text(double count) {
  if (!std::isfinite(count)) return kUnknown;
  const std::string digits = fmt::format("{:.0f}", std::abs(count));
  std::string out = count < -0.5 ? "-" : "";

  // Groups of three digits.
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) out += kThinSpace;
    out += digits[i];
  }
  return out;
}

std::string number_text(double value, int decimals, std::string_view unit) {
  if (!std::isfinite(value)) return kUnknown;
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.find_first_not_of("-0.") == std::string::npos && text[0] == '-') text.erase(0, 1);
  return unit.empty() ? text : fmt::format("{}{}{}", text, kThinSpace, unit);
}

std::string bytes_text(double bytes) {
  if (bytes < 1e3) return number_text(bytes, 0, "bytes");
  if (bytes < 1e6) return number_text(bytes / 1e3, 1, "kB");
  return bytes < 1e9 ? number_text(bytes / 1e6, 1, "MB") : number_text(bytes / 1e9, 2, "GB");
}

HtmlTable::HtmlTable(const std::string& columns) {
  for (std::size_t from = 0; from <= columns.size();) {
    const std::size_t to = std::min(columns.find('|', from), columns.size());
    columns_.push_back(columns.substr(from, to - from));
    from = to + 1;
  }
}

void HtmlTable::row(const std::vector<std::string>& cells, const std::string& kind) {
  body_ += kind.empty() ? "<tr>" : "<tr class=\"" + kind + "\">";
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const std::string text = i < cells.size() ? markup_text(cells[i]) : std::string();
    body_ += (of_numbers(columns_[i]) ? "<td class=\"n\">" : "<td>") + text + "</td>";
  }
  body_ += "</tr>\n";
  ++rows_;
}

std::string HtmlTable::html() const {
  if (rows_ == 0) return {};
  std::string out = "<div class=\"scroll\"><table><thead><tr>";
  for (const std::string& column : columns_) {
    const bool number = of_numbers(column);
    out += (number ? "<th class=\"n\">" : "<th>") + markup_text(column.substr(number ? 1 : 0)) + "</th>";
  }
  return out + "</tr></thead>\n<tbody>" + body_ + "</tbody></table></div>\n";
}

void RobotTable::value(const std::string& name, const std::string& value) {
  auto row = std::find_if(rows_.begin(), rows_.end(), [&](const auto& r) { return r.first == name; });
  if (row == rows_.end()) row = rows_.insert(rows_.end(), {name, {}});
  row->second.resize(names_.size());
  row->second.back() = value;
}

std::string RobotTable::html() const {
  if (names_.empty() || rows_.empty()) return {};
  const bool named = names_.size() > 1 || !names_.front().empty();
  std::string out = "<div class=\"scroll\"><table class=\"facts\">";

  // A single robot needs no name.
  if (named) {
    out += "<thead><tr><th></th>";
    for (const std::string& name : names_) out += "<th class=\"n\">" + markup_text(name) + "</th>";
    out += "</tr></thead>\n";
  }

  // One row per quantity, one cell per robot.
  out += "<tbody>";
  for (const auto& [name, values] : rows_) {
    out += "<tr><th scope=\"row\">" + markup_text(name) + "</th>";
    for (std::size_t i = 0; i < names_.size(); ++i) {
      out += "<td class=\"n\">" + (i < values.size() ? markup_text(values[i]) : std::string()) + "</td>";
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string facts_html(const Facts& facts) {
  std::string out;
  for (const auto& [name, value] : facts) {
    if (value.empty()) continue;
    out += "<tr><th scope=\"row\">" + markup_text(name) + "</th><td>" + markup_text(value) + "</td></tr>\n";
  }
  return out.empty() ? out : "<table class=\"facts\"><tbody>" + out + "</tbody></table>\n";
}

std::string tiles_html(const Facts& facts) {
  std::string out;
  for (const auto& [name, value] : facts) {
    out += "<div><b>" + markup_text(value) + "</b><span>" + markup_text(name) + "</span></div>";
  }
  return "<div class=\"tiles\">" + out + "</div>\n";
}

std::string paragraph(const std::string& text) { return "<p>" + markup_text(text) + "</p>\n"; }
std::string note(const std::string& text) { return "<p class=\"note\">" + markup_text(text) + "</p>\n"; }

std::string folded(const std::string& title, const std::string& html, bool open) {
  return (open ? "<details open=\"open\"><summary>" : "<details><summary>") + markup_text(title) +
         "</summary>\n" + html + "</details>\n";
}

std::string page_html(const std::string& title, const std::string& head_html,
                      const std::vector<Section>& sections, const std::string& foot) {
  std::string contents, body, behind;

  // Sections without text are left out.
  for (const Section& section : sections) {
    if (section.html.empty()) continue;
    contents += fmt::format("<a href=\"#{}\">{}</a>", section.id, markup_text(section.title));
    (section.behind ? behind : body) += fmt::format("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n",
                                                    section.id, markup_text(section.title), section.html);
  }

  // Details are folded.
  if (!behind.empty())
    body += "<details class=\"made\"><summary>How it was made</summary>\n" + behind + "</details>\n";

  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/>\n"
      "<meta name=\"generator\" content=\"{}\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<meta name=\"color-scheme\" content=\"light "
      "dark\"/>\n<title>{}</title>\n<style>\n{}{}</style></head>\n"
      "<body><main>\n{}<nav>{}</nav>\n{}<footer>{}</footer>\n</main></body></html>\n",
      kReportGenerator, markup_text(title), report_style(), viz::svg_chart_style(), head_html, contents, body,
      markup_text(foot));
}

}  // namespace plumbline::report
