// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A drawing in metres, and its files: SVG, PDF and DXF.
#include <Eigen/Core>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/part.hpp"

namespace plumbline::exports {

struct DrawingLayer {
  std::string name;
  std::string color = "#000000";  ///< in SVG and PDF
  int dxf_color = 7;              ///< AutoCAD colour index
  double width_mm = 0.25;         ///< width of lines on paper
};

struct DrawnLine {
  std::size_t layer = 0;
  std::vector<Eigen::Vector2d> points;
  bool closed = false;
  bool filled = false;
};

struct DrawnText {
  std::size_t layer = 0;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< its middle
  double height_m = 0.15;
  double angle_rad = 0.0;  ///< of the line that it stands on, which may run either way
  std::string text;
};

/// The angle, or the opposite one, at which a text along this line is read from below or from the right: in
/// (-88, 92] degrees, so that lines that are vertical but for errors of measurement are read from one side.
inline double readable_angle(double angle_rad) {
  constexpr double kHighest_rad = 92.0 / 180.0 * M_PI;
  return angle_rad - M_PI * std::ceil((angle_rad - kHighest_rad) / M_PI);
}

struct Drawing {
  std::string title;
  std::vector<std::string> notes;  ///< such as the frame, for comments in the file
  std::vector<DrawingLayer> layers;
  std::vector<DrawnLine> lines;
  std::vector<DrawnText> texts;

  std::size_t add_layer(DrawingLayer layer) {
    layers.push_back(std::move(layer));
    return layers.size() - 1;
  }
  void line(std::size_t layer, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    lines.push_back({layer, {a, b}, false, false});
  }
  /// Lowest and highest corner of everything.
  [[nodiscard]] std::pair<Eigen::Vector2d, Eigen::Vector2d> bounds() const;
};

/// Placement of a drawing on a sheet of paper: a round scale, and the size with a margin.
struct DrawingSheet {
  double per_metre_mm = 20.0;  ///< 1 : 50
  int scale = 50;
  double margin_mm = 10.0;
  Eigen::Vector2d low = Eigen::Vector2d::Zero();  ///< lower left corner of the drawing, metres
  double width_mm = 0.0;
  double height_mm = 0.0;

  /// Millimetres from the upper left corner.
  [[nodiscard]] Eigen::Vector2d on_paper(const Eigen::Vector2d& place) const {
    return {margin_mm + per_metre_mm * (place.x() - low.x()),
            height_mm - margin_mm - per_metre_mm * (place.y() - low.y())};
  }
};
/// The largest of the usual scales whose sheet is at most A1.
DrawingSheet sheet_of(const Drawing& drawing);

/// Errors: kOutput.
core::Result<void> write_svg(const std::filesystem::path& file, const Drawing& drawing);
/// Writes DXF R2000. Positions become origin + turn * position, which moves a plan into world coordinates.
core::Result<void> write_dxf(const std::filesystem::path& file, const Drawing& drawing,
                             const Eigen::Matrix2d& turn = Eigen::Matrix2d::Identity(),
                             const Eigen::Vector2d& origin = Eigen::Vector2d::Zero());
core::Result<void> write_pdf(const std::filesystem::path& file, const Drawing& drawing);

/// Functions of the part "pdf".
struct PdfFunctions {
  static constexpr const char* kPart = "pdf";
  static constexpr std::uint64_t layout() {
    return core::layout_of<PdfFunctions, Drawing, DrawnLine, DrawnText, DrawingSheet>();
  }
  /// The file's bytes.
  core::Result<std::string> (*make)(const Drawing& drawing, const DrawingSheet& sheet);
};

}  // namespace plumbline::exports
