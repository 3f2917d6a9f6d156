// SPDX-License-Identifier: BSD-3-Clause
// The sheet around a plan: frame, title block, legend, scale bar, grid and tables.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "drawings/plan_drawing.hpp"

namespace plumbline::exports {
namespace {

struct PaperSize {
  const char* name;
  double long_mm, short_mm;
};
constexpr std::array<PaperSize, 5> kPapers{
    {{"A4", 297, 210}, {"A3", 420, 297}, {"A2", 594, 420}, {"A1", 841, 594}, {"A0", 1189, 841}}};

// Millimetres on paper: margins, of which the left one is for filing; the column beside the drawing.
constexpr double kLeft_mm = 20.0, kMargin_mm = 10.0, kColumn_mm = 92.0, kInside_mm = 9.0;
constexpr double kText_mm = 1.8, kLine_mm = 3.9, kHead_mm = 6.5;

/// Writes in millimetres from the lower left corner of the paper.
class SheetWriter {
 public:
  SheetWriter(Drawing& drawing, std::size_t layer) : drawing_(drawing), layer_(layer) {}

  [[nodiscard]] Eigen::Vector2d at(double x, double y) const {
    return drawing_.sheet.low + drawing_.sheet.mm() * Eigen::Vector2d(x, y);
  }
  void line(double x0, double y0, double x1, double y1, bool dashed = false) {
    drawing_.line(layer_, at(x0, y0), at(x1, y1), dashed);
  }
  void box(double x0, double y0, double x1, double y1) {
    drawing_.lines.push_back({layer_, {at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1)}, true});
  }
  /// A text whose left end and middle line are there.
  void text(double x, double y, const std::string& words, double height_mm = kText_mm) {
    DrawnText drawn{layer_, Eigen::Vector2d::Zero(), height_mm * drawing_.sheet.mm(), 0.0, words};
    drawn.at = at(x, y) + Eigen::Vector2d(0.5 * drawn.width_m(), 0.0);
    if (!words.empty()) drawing_.texts.push_back(drawn);
  }
  /// The text's words in lines that are no longer than so.
  [[nodiscard]] static std::vector<std::string> lines_of(const std::string& text, double width_mm,
                                                         double height_mm = kText_mm) {
    std::vector<std::string> lines{""};
    for (std::size_t from = 0; from < text.size();) {
      const std::size_t to = std::min(text.find(' ', from), text.size());
      const std::string word = text.substr(from, to - from);
      const std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
      if (DrawnText{0, Eigen::Vector2d::Zero(), height_mm, 0.0, longer}.width_m() <= width_mm ||
          lines.back().empty()) {
        lines.back() = longer;
      } else {
        lines.push_back(word);
      }
      from = to + 1;
    }
    return lines;
  }

 private:
  Drawing& drawing_;
  std::size_t layer_;
};

/// Rows of the title block: name and lines of text.
struct TitleRow {
  std::string name;
  std::vector<std::string> lines;
  double height_mm;  ///< of the text
};

constexpr double kName_mm = 23.0;  ///< column of the names

/// Rows of the title block; values are broken to the width of the column.
std::vector<TitleRow> title_rows(const SheetFacts& facts, const DrawingSheet& sheet) {
  std::vector<TitleRow> rows;
  const auto add = [&](const std::string& name, const std::string& value, double height_mm) {
    const double width_mm = kColumn_mm - (name.empty() ? 6.0 : kName_mm + 4.0);
    if (!value.empty()) rows.push_back({name, SheetWriter::lines_of(value, width_mm, height_mm), height_mm});
  };
  add("", facts.title, 3.5);
  for (const auto& [name, value] : facts.rows) add(name, value, kText_mm);
  add("Scale", fmt::format("1:{} on {}", sheet.scale, sheet.paper), kText_mm);
  return rows;
}

double height_of(const TitleRow& row) {
  return (row.height_mm + 1.6) * static_cast<double>(row.lines.size()) + 1.8;
}
double height_of(const SheetTable& table) {
  return kHead_mm + kLine_mm * static_cast<double>(table.rows.size() + 1) + 3.0;
}

/// The title block from its lower left corner upwards; its height.
double draw_title(SheetWriter& writer, double x, double y, const std::vector<TitleRow>& rows) {
  double top = y;
  for (auto row = rows.rbegin(); row != rows.rend(); ++row) {
    const double height = height_of(*row);
    writer.box(x, top, x + kColumn_mm, top + height);
    double line = top + height - 1.7 - 0.5 * row->height_mm;
    writer.text(x + 2.0, line, row->name);
    for (const std::string& text : row->lines) {
      writer.text(x + (row->name.empty() ? 3.0 : kName_mm), line, text, row->height_mm);
      line -= row->height_mm + 1.6;
    }
    top += height;
  }
  return top - y;
}

/// A part of a table, downwards from its upper left corner; its height.
double draw_table(SheetWriter& writer, double x, double y, const SheetTable& table, std::size_t first,
                  std::size_t count) {
  writer.text(x, y - 3.0, table.title + (first > 0 ? ", continued" : ""), 2.5);
  y -= kHead_mm;
  const auto row = [&](const auto& cell) {
    double column = x;
    for (std::size_t i = 0; i < table.columns.size(); ++i) {
      writer.text(column, y - 0.5 * kLine_mm, cell(i));
      column += table.columns[i].second;
    }
    y -= kLine_mm;
    writer.line(x, y, x + kColumn_mm, y);
  };
  row([&](std::size_t i) { return table.columns[i].first; });
  for (std::size_t k = first; k < first + count; ++k) row([&](std::size_t i) { return table.rows[k][i]; });
  return kHead_mm + kLine_mm * static_cast<double>(count + 1) + 3.0;
}

/// Signs that the drawing has, each with what it means.
std::vector<std::pair<std::string, std::string>> legend_of(const Drawing& drawing, const PlanLayers& layers) {
  const auto has = [&](const auto& things, std::size_t layer) {
    return std::any_of(things.begin(), things.end(), [&](const auto& thing) { return thing.layer == layer; });
  };
  std::vector<std::pair<std::string, std::string>> legend;
  if (!drawing.areas.empty()) legend.emplace_back("wall", "Wall, both faces seen");
  if (has(drawing.lines, layers.assumed))
    legend.emplace_back("assumed",
                        fmt::format("Other face not seen: {:g} m assumed", plans::kAssumedThickness_m));
  if (has(drawing.lines, layers.door)) legend.emplace_back("door", "Door with its leaf where that was seen");
  if (has(drawing.symbols, layers.glazing)) legend.emplace_back("window", "Window; dashed: open at the cut");
  if (has(drawing.lines, layers.area))
    legend.emplace_back("limit", "Wall that is assumed, or limit of what was seen");
  if (has(drawing.lines, layers.furniture))
    legend.emplace_back("furniture", "Furniture, 0.15 to 1.8 m over the floor");
  return legend;
}

/// The legend: a sample of each sign with its meaning.
void draw_legend(Drawing& drawing, SheetWriter& writer, std::size_t layer, double x, double y,
                 const std::vector<std::pair<std::string, std::string>>& legend) {
  for (const auto& [sign, text] : legend) {
    const double middle = y - 0.5 * kLine_mm, low = middle - 1.2, high = middle + 1.2;
    const std::vector<Eigen::Vector2d> ring{writer.at(x, low), writer.at(x + 14, low),
                                            writer.at(x + 14, high), writer.at(x, high)};
    const Eigen::Vector2d side = ring[1] - ring[0], up = ring[3] - ring[0];

    // Samples are drawn as the plan draws them
    if (sign == "wall") {
      drawing.areas.push_back({layer, {ring}, 1.2 * drawing.sheet.mm()});
      drawing.lines.push_back({layer, ring, true});
    } else if (sign == "assumed") {
      drawing.lines.push_back({layer, ring, true, false, true});
      drawing.line(layer, ring[0], ring[1]);
    } else if (sign == "window") {
      drawing.symbols.push_back({layer, 1, ring[0], side, up});
    } else if (sign == "furniture") {
      drawing.lines.push_back({layer, ring, true});
    } else if (sign == "door") {
      const Eigen::Vector2d hinge = writer.at(x + 5.0, middle - 1.5);
      drawing.symbols.push_back({layer, 0, hinge, 0.22 * side, {0.0, 0.22 * side.x()}});
    } else {
      drawing.line(layer, writer.at(x, middle), writer.at(x + 14, middle), true);
    }

    // Text next to the sample
    writer.text(x + 17.0, middle, text);
    y -= kLine_mm + 0.6;
  }
}

/// A bar of whole metres, and an arrow to the north or along x.
void draw_scale(const Drawing& drawing, SheetWriter& writer, const PlanStyle& style, bool georeferenced,
                double x, double y) {
  constexpr std::array<double, 9> kBars_m{0.5, 1, 2, 5, 10, 20, 50, 100, 200};

  // The shortest bar of more than 25 mm
  const double metre_mm = style.unit / drawing.sheet.mm();
  const double bar_m =
      *std::find_if(kBars_m.begin(), kBars_m.end() - 1, [&](double m) { return m * metre_mm > 25.0; });
  for (int i = 0; i < 2; ++i) {
    const double from = x + 0.5 * i * bar_m * metre_mm;
    writer.box(from, y - (i + 1) * 0.8, from + 0.5 * bar_m * metre_mm, y - i * 0.8);
  }
  writer.text(x + bar_m * metre_mm + 2.0, y - 0.8, style.number(bar_m, bar_m < 1.0 ? 1 : 0) + " m");

  // Georeferenced plans have north up
  const double tip = x + kColumn_mm - 8.0;
  const bool north = georeferenced;
  writer.line(tip - (north ? 0.0 : 14.0), y - 7.0, tip, y + (north ? 7.0 : -7.0));
  for (const double off : {-1.2, 1.2})
    writer.line(tip, y + (north ? 7.0 : -7.0), tip + (north ? off : -3.0), y + (north ? 4.0 : -7.0 + off));
  writer.text(tip + (north ? 1.8 : 1.2), y + (north ? 5.0 : -7.0), north ? "N" : "x");
  if (north) return;

  // Other plans show both axes
  writer.line(tip - 14.0, y - 7.0, tip - 14.0, y + 7.0);
  for (const double off : {-1.2, 1.2}) writer.line(tip - 14.0, y + 7.0, tip - 14.0 + off, y + 4.0);
  writer.text(tip - 12.5, y + 6.0, "y");
}

/// Whole multiples of a step from `low` on, below `high`.
std::vector<double> multiples(double step, double low, double high) {
  const auto first = static_cast<int>(std::ceil(low / step));
  std::vector<double> values;
  for (int k = first; k * step < high; ++k) values.push_back(k * step);
  return values;
}

/// Crosses each some metres, and their coordinates along the frame of the drawing.
void draw_coordinates(Drawing& drawing, SheetWriter& writer, const PlanLayers& layers, double right_mm,
                      double top_mm) {
  constexpr std::array<double, 9> kSteps_m{1, 2, 5, 10, 20, 50, 100, 200, 500};

  // Steps of more than 38 mm
  const double mm = drawing.sheet.mm();
  const double step =
      *std::find_if(kSteps_m.begin(), kSteps_m.end() - 1, [&](double m) { return m / mm > 38.0; });
  const Eigen::Vector2d low = writer.at(kLeft_mm, kMargin_mm), high = writer.at(right_mm, top_mm);
  const double edge = kInside_mm * mm;
  SheetWriter grid(drawing, layers.grid);

  // Values along the lower and the left edge
  for (const int axis : {0, 1}) {
    for (const double value : multiples(step, low[axis] + 2.0 * edge, high[axis] - 2.0 * edge)) {
      const double along = (value - drawing.sheet.low[axis]) / mm;
      DrawnText text{layers.grid, Eigen::Vector2d::Zero(), kText_mm * mm, axis == 0 ? 0.0 : 0.5 * M_PI,
                     fmt::format("{:.0f}", value)};
      text.at = axis == 0 ? writer.at(along, kMargin_mm + 4.0) : writer.at(kLeft_mm + 4.0, along);
      drawing.texts.push_back(text);

      // Marks at both edges
      axis == 0 ? grid.line(along, kMargin_mm, along, kMargin_mm + 2.0)
                : grid.line(kLeft_mm, along, kLeft_mm + 2.0, along);
      axis == 0 ? grid.line(along, top_mm - 2.0, along, top_mm)
                : grid.line(right_mm - 2.0, along, right_mm, along);
    }
  }

  // Crosses within the drawing
  const std::vector<double> ys = multiples(step, low.y() + 2.0 * edge, high.y() - edge);
  for (const double x : multiples(step, low.x() + 2.0 * edge, high.x() - edge)) {
    for (const double y : ys) {
      drawing.line(layers.grid, {x - 1.5 * mm, y}, {x + 1.5 * mm, y});
      drawing.line(layers.grid, {x, y - 1.5 * mm}, {x, y + 1.5 * mm});
    }
  }
}

/// The column's parts, and how many columns they need.
struct SheetColumn {
  std::vector<TitleRow> title;
  std::vector<std::pair<std::string, std::string>> legend;
  double foot_mm = 0.0;  ///< height of title block, scale and legend
  int columns = 1;
};

SheetColumn column_of(const SheetFacts& facts, const Drawing& drawing, const PlanLayers& layers,
                      const std::vector<SheetTable>& tables) {
  SheetColumn column;
  column.title = title_rows(facts, drawing.sheet);
  column.legend = legend_of(drawing, layers);
  for (const TitleRow& row : column.title) column.foot_mm += height_of(row);
  column.foot_mm += 26.0 + (kLine_mm + 0.6) * static_cast<double>(column.legend.size());

  // Tables fill the columns from the right, the others from edge to edge.
  const double inner = drawing.sheet.height_mm - 2.0 * kMargin_mm;
  double room = inner - column.foot_mm;

  for (const SheetTable& table : tables) {
    double need = height_of(table) + 2.0 * kHead_mm;
    while (need > room) {
      need -= std::max(0.0, room - 3.0 * kHead_mm);
      room = inner;
      ++column.columns;
      if (column.columns > 20) return column;
    }
    room -= need;
  }

  return column;
}

/// Draws the tables from the column at the right to the left; `x`: of the right column, mm.
void draw_tables(SheetWriter& writer, const DrawingSheet& sheet, const std::vector<SheetTable>& tables,
                 double x, double foot_mm) {
  const double top = sheet.height_mm - kMargin_mm - 1.0;
  double y = top, low = kMargin_mm + foot_mm;
  for (const SheetTable& table : tables) {
    for (std::size_t first = 0; first < table.rows.size();) {
      const auto fits = static_cast<std::ptrdiff_t>((y - low - kHead_mm - 3.0) / kLine_mm) - 1;
      if (fits < std::min<std::ptrdiff_t>(3, static_cast<std::ptrdiff_t>(table.rows.size()))) {
        x -= kColumn_mm + 3.0;
        y = top;
        low = kMargin_mm;
        continue;
      }
      const std::size_t count = std::min(table.rows.size() - first, static_cast<std::size_t>(fits));
      y -= draw_table(writer, x, y, table, first, count);
      first += count;
    }
  }
}

}  // namespace

std::vector<int> sheet_scales(const SheetOptions& options) {
  if (options.scale > 0) return {options.scale};
  return {20, 50, 100, 200, 500, 1000, 2000, 5000};
}

bool put_on_sheet(const SheetOptions& options, const SheetFacts& facts, const PlanStyle& style,
                  const PlanLayers& layers, const std::vector<SheetTable>& tables, Drawing& drawing) {
  constexpr int kSmallestOnA3 = 200;  // smaller scales come after larger paper
  const auto [low, high] = drawing.bounds();
  const double mm = drawing.sheet.mm();
  for (const PaperSize& paper : kPapers) {
    if (!options.paper.empty() ? paper.name != options.paper : std::string(paper.name) == "A4") continue;
    const bool larger = std::string(paper.name) != "A3";
    if (options.paper.empty() && options.scale == 0 && larger && drawing.sheet.scale < kSmallestOnA3)
      continue;

    // Lying or upright, whichever holds the drawing first
    for (const bool upright : {false, true}) {
      drawing.sheet.paper = paper.name;
      drawing.sheet.width_mm = upright ? paper.short_mm : paper.long_mm;
      drawing.sheet.height_mm = upright ? paper.long_mm : paper.short_mm;
      const SheetColumn column = column_of(facts, drawing, layers, tables);
      const double right = drawing.sheet.width_mm - kMargin_mm - column.columns * (kColumn_mm + 3.0);
      const double top = drawing.sheet.height_mm - kMargin_mm;
      const Eigen::Array2d room(right - kLeft_mm - 2.0 * kInside_mm, top - kMargin_mm - 2.0 * kInside_mm);
      if (((high - low).array() / mm > room).any()) continue;

      // The drawing is in the middle, all else around it.
      const Eigen::Vector2d middle(0.5 * (kLeft_mm + right), 0.5 * (kMargin_mm + top));
      drawing.sheet.low = 0.5 * (low + high) - mm * middle;

      // Parts around the drawing
      SheetWriter writer(drawing, layers.anno);
      const double x = drawing.sheet.width_mm - kMargin_mm - kColumn_mm;
      writer.box(kLeft_mm, kMargin_mm, drawing.sheet.width_mm - kMargin_mm, top);
      writer.line(right, kMargin_mm, right, top);
      const double title_mm = draw_title(writer, x, kMargin_mm, column.title);
      draw_scale(drawing, writer, style, facts.georeferenced, x, kMargin_mm + title_mm + 11.0);
      draw_legend(drawing, writer, layers.anno, x, kMargin_mm + column.foot_mm - 2.0, column.legend);
      draw_tables(writer, drawing.sheet, tables, x, column.foot_mm);
      draw_coordinates(drawing, writer, layers, right, top);
      return true;
    }
  }

  return false;
}

}  // namespace plumbline::exports
