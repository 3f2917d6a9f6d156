// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A drawing in metres on a sheet of paper, and its files: SVG, PDF and DXF, which show the same.
#include <Eigen/Core>
#include <cmath>
#include <filesystem>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/part.hpp"

namespace plumbline::exports {

struct DrawingLayer {
  std::string name;
  std::string color = "#000000";  ///< in SVG and PDF
  int dxf_color = 7;              ///< AutoCAD colour index
  double width_mm = 0.25;         ///< width of lines on paper
  bool broken_by_texts = false;   ///< its lines end before texts and go on behind them
};

struct DrawnLine {
  std::size_t layer = 0;
  std::vector<Eigen::Vector2d> points;
  bool closed = false;
  bool filled = false;
  bool dashed = false;
};

struct DrawnText {
  std::size_t layer = 0;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< its middle
  double height_m = 0.15;                        ///< of its capitals
  double angle_rad = 0.0;                        ///< of the line that it stands on, which may run either way
  std::string text;                              ///< UTF-8

  /// The width that all files give it, whatever their font.
  [[nodiscard]] double width_m() const;
};

/// A hatched area.
struct DrawnArea {
  std::size_t layer = 0;
  std::vector<std::vector<Eigen::Vector2d>> rings;  ///< the outline, then its holes
  double spacing_m = 0.1;                           ///< of its lines, which rise to the right
};

/// A length between two places, with a line beside them that shows it.
struct DrawnDimension {
  std::size_t layer = 0;
  Eigen::Vector2d from, to;
  Eigen::Vector2d beside = Eigen::Vector2d::Zero();  ///< from the places to the line, square to it
  double measure_m = 0.0;                            ///< the length that the text tells
  DrawnText label;
  bool leader = false;  ///< a line from the middle to the label
};

/// A symbol such as a door, in a square of one metre.
struct DrawnBlock {
  std::string name;
  std::vector<DrawnLine> lines;  ///< their layer is that of the symbol
};

/// A block, stretched along its own axes.
struct DrawnSymbol {
  std::size_t layer = 0;
  std::size_t block = 0;
  Eigen::Vector2d at, x, y;  ///< place of its origin, ends of its axes, which are square to each other
};

/// The angle, or the opposite one, at which a text along this line is read from below or from the right: in
/// (-88, 92] degrees, so that lines that are vertical but for errors of measurement are read from one side.
inline double readable_angle(double angle_rad) {
  constexpr double kHighest_rad = 92.0 / 180.0 * M_PI;
  return angle_rad - M_PI * std::ceil((angle_rad - kHighest_rad) / M_PI);
}

/// The paper.
struct DrawingSheet {
  std::string paper;  ///< "A3"
  int scale = 50;     ///< 1 : 50
  double width_mm = 420.0, height_mm = 297.0;
  Eigen::Vector2d low = Eigen::Vector2d::Zero();  ///< its lower left corner in the drawing, metres

  [[nodiscard]] double mm() const { return 1e-3 * scale; }  ///< metres of a millimetre on paper
  /// Millimetres from the upper left corner.
  [[nodiscard]] Eigen::Vector2d on_paper(const Eigen::Vector2d& place) const {
    return {(place.x() - low.x()) / mm(), height_mm - (place.y() - low.y()) / mm()};
  }
};

struct Drawing {
  std::string title;
  std::vector<std::string> notes;  ///< such as the frame, for comments in the file
  DrawingSheet sheet;
  double unit = 1.0;   ///< of the drawing for a metre: the scale of a map projection
  bool comma = false;  ///< for the decimal point
  std::vector<DrawingLayer> layers;
  std::vector<DrawnBlock> blocks;
  std::vector<DrawnArea> areas;
  std::vector<DrawnLine> lines;
  std::vector<DrawnSymbol> symbols;
  std::vector<DrawnDimension> dimensions;
  std::vector<DrawnText> texts;

  std::size_t add_layer(DrawingLayer layer) {
    layers.push_back(std::move(layer));
    return layers.size() - 1;
  }
  void line(std::size_t layer, const Eigen::Vector2d& a, const Eigen::Vector2d& b, bool dashed = false) {
    lines.push_back({layer, {a, b}, false, false, dashed});
  }
  /// Lowest and highest corner of everything.
  [[nodiscard]] std::pair<Eigen::Vector2d, Eigen::Vector2d> bounds() const;
  /// Lines of everything: of areas their hatching, of symbols and dimensions what they consist of.
  [[nodiscard]] std::vector<DrawnLine> all_lines() const;
  /// Texts, with those of dimensions.
  [[nodiscard]] std::vector<DrawnText> all_texts() const;
  /// Ends lines of the layers that are broken by texts where a text stands.
  void break_lines();
  /// Removes what lies on layers for which it is true; layers keep their numbers.
  template <typename Condition>
  void remove_layers(const Condition& is_unwanted);
};

std::vector<DrawnLine> lines_of(const DrawnArea& area);
std::vector<DrawnLine> lines_of(const DrawnDimension& dimension);
std::vector<DrawnLine> lines_of(const DrawnSymbol& symbol, const DrawnBlock& block);
/// The four corners of a text, with room around it, counter-clockwise.
std::vector<Eigen::Vector2d> box_of(const DrawnText& text, double room_m = 0.0);

/// Errors: kOutput.
core::Result<void> write_svg(const std::filesystem::path& file, const Drawing& drawing);
std::string svg_text(const Drawing& drawing);
/// Writes DXF R2000, in metres.
core::Result<void> write_dxf(const std::filesystem::path& file, const Drawing& drawing);
/// A page for each drawing.
core::Result<void> write_pdf(const std::filesystem::path& file, const std::vector<Drawing>& pages);

/// Functions of the part "pdf".
struct PdfFunctions {
  static constexpr const char* kPart = "pdf";
  static constexpr std::uint64_t layout() {
    return core::layout_of<PdfFunctions, Drawing, DrawnLine, DrawnText, DrawingSheet>();
  }
  /// A page with lines and texts of everything, which are given apart. Returns the file's bytes.
  struct Page {
    const Drawing* drawing;
    std::vector<DrawnLine> lines;
    std::vector<DrawnText> texts;
    std::vector<double> widths_m;  ///< of the texts
  };
  core::Result<std::string> (*make)(const std::vector<Page>& pages);
};

/// Parts on unwanted layers go; the layers stay, so that their numbers hold.
template <typename Condition>
void Drawing::remove_layers(const Condition& is_unwanted) {
  const auto clean = [&](auto& things) {
    std::decay_t<decltype(things)> kept;
    for (auto& thing : things) {
      if (!is_unwanted(layers[thing.layer])) kept.push_back(std::move(thing));
    }
    things = std::move(kept);
  };
  clean(areas), clean(lines), clean(symbols), clean(dimensions), clean(texts);
}

}  // namespace plumbline::exports
