// SPDX-License-Identifier: BSD-3-Clause
#include "plans/drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "plumbline/core/output_file.hpp"

namespace plumbline::exports {
namespace {

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&') {
      result += "&amp;";
    } else if (c == '<') {
      result += "&lt;";
    } else if (c == '>') {
      result += "&gt;";
    } else {
      result += c;
    }
  }
  return result;
}

std::string svg_path(const DrawnLine& line, const DrawingSheet& sheet) {
  std::string path;
  for (const Eigen::Vector2d& p : line.points) {
    const Eigen::Vector2d at = sheet.on_paper(p);
    path += fmt::format("{}{:.3f} {:.3f}", path.empty() ? "M" : " L", at.x(), at.y());
  }
  return line.closed ? path + " Z" : path;
}

}  // namespace

std::pair<Eigen::Vector2d, Eigen::Vector2d> Drawing::bounds() const {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300);
  Eigen::Vector2d high = -low;
  const auto add = [&](const Eigen::Vector2d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  };
  for (const DrawnLine& line : lines) {
    for (const Eigen::Vector2d& p : line.points) add(p);
  }
  for (const DrawnText& text : texts) {
    const double reach = 0.35 * text.height_m * static_cast<double>(text.text.size());
    add(text.at - Eigen::Vector2d(reach, text.height_m));
    add(text.at + Eigen::Vector2d(reach, text.height_m));
  }
  if (lines.empty() && texts.empty()) return {Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones()};
  return {low, high};
}

DrawingSheet sheet_of(const Drawing& drawing) {
  constexpr std::array<int, 8> kScales{20, 50, 100, 200, 500, 1000, 2000, 5000};
  constexpr double kLongest_mm = 841.0;  // A1
  const auto [low, high] = drawing.bounds();
  DrawingSheet sheet;
  sheet.low = low;
  for (const int scale : kScales) {
    sheet.scale = scale;
    sheet.per_metre_mm = 1000.0 / scale;
    sheet.width_mm = sheet.per_metre_mm * (high.x() - low.x()) + 2.0 * sheet.margin_mm;
    sheet.height_mm = sheet.per_metre_mm * (high.y() - low.y()) + 2.0 * sheet.margin_mm;
    if (std::max(sheet.width_mm, sheet.height_mm) <= kLongest_mm) break;
  }
  return sheet;
}

core::Result<void> write_svg(const std::filesystem::path& file, const Drawing& drawing) {
  const DrawingSheet sheet = sheet_of(drawing);
  core::OutputFile out(file);
  out.write(fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
      "width=\"{0:.2f}mm\" height=\"{1:.2f}mm\" viewBox=\"0 0 {0:.2f} {1:.2f}\">\n"
      "<title>{2}</title>\n<desc>scale 1:{3}; {4:.6g} {5:.6g} (m) is at the lower left, {6:g} mm in",
      sheet.width_mm, sheet.height_mm, escaped(drawing.title), sheet.scale, sheet.low.x(), sheet.low.y(),
      sheet.margin_mm));

  for (const std::string& note : drawing.notes) out.write("; " + escaped(note));
  out.write("</desc>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n");
  for (std::size_t layer = 0; layer < drawing.layers.size(); ++layer) {
    const DrawingLayer& l = drawing.layers[layer];
    out.write(
        fmt::format("<g id=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:g}\" stroke-linecap=\"round\" "
                    "stroke-linejoin=\"round\">\n",
                    l.name, l.color, l.width_mm));

    for (const DrawnLine& line : drawing.lines) {
      if (line.layer != layer) continue;
      out.write(fmt::format("<path d=\"{}\"{}/>\n", svg_path(line, sheet),
                            line.filled ? fmt::format(" fill=\"{}\" stroke=\"none\"", l.color) : ""));
    }

    for (const DrawnText& text : drawing.texts) {
      if (text.layer != layer) continue;
      const Eigen::Vector2d at = sheet.on_paper(text.at);
      out.write(fmt::format(
          "<text transform=\"translate({:.3f} {:.3f}) rotate({:.2f})\" font-family=\"sans-serif\" "
          "font-size=\"{:.2f}\" text-anchor=\"middle\" dy=\"0.35em\" fill=\"{}\" "
          "stroke=\"none\">{}</text>\n",
          at.x(), at.y(), -readable_angle(text.angle_rad) * 180.0 / M_PI,
          1.4 * sheet.per_metre_mm * text.height_m, l.color, escaped(text.text)));
    }

    out.write("</g>\n");
  }

  out.write("</svg>\n");
  return out.commit();
}

core::Result<void> write_pdf(const std::filesystem::path& file, const Drawing& drawing) {
  const auto& pdf = core::part<PdfFunctions>();
  if (!pdf) return tl::unexpected(pdf.error());
  const auto bytes = (*pdf)->make(drawing, sheet_of(drawing));
  if (!bytes) return tl::unexpected(bytes.error());
  return core::write_file(file, *bytes);
}

}  // namespace plumbline::exports
