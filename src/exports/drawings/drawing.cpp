// SPDX-License-Identifier: BSD-3-Clause
#include "drawings/drawing.hpp"

#include <fmt/format.h>

#include <cmath>

#include "plumbline/core/output_file.hpp"

namespace plumbline::exports {
namespace {

/// Text with the characters escaped that XML gives a meaning.
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

/// The line's path in millimetres on the sheet.
std::string svg_path(const DrawnLine& line, const DrawingSheet& sheet) {
  std::string path;
  for (const Eigen::Vector2d& p : line.points) {
    const Eigen::Vector2d at = sheet.on_paper(p);
    path += fmt::format("{}{:.3f} {:.3f}", path.empty() ? "M" : " L", at.x(), at.y());
  }
  return line.closed ? path + " Z" : path;
}

}  // namespace

std::string svg_text(const Drawing& drawing) {
  const DrawingSheet& sheet = drawing.sheet;

  // Sizes are millimetres of paper
  std::string out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
      "width=\"{0:.2f}mm\" height=\"{1:.2f}mm\" viewBox=\"0 0 {0:.2f} {1:.2f}\">\n"
      "<title>{2}</title>\n<desc>scale 1:{3}; {4:.6f} {5:.6f} (m) is at the lower left",
      sheet.width_mm, sheet.height_mm, escaped(drawing.title), sheet.scale, sheet.low.x(), sheet.low.y());

  for (const std::string& note : drawing.notes) out += "; " + escaped(note);
  out += "</desc>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n";

  // A group for each layer
  const std::vector<DrawnLine> lines = drawing.all_lines();
  const std::vector<DrawnText> texts = drawing.all_texts();
  for (std::size_t layer = 0; layer < drawing.layers.size(); ++layer) {
    const DrawingLayer& l = drawing.layers[layer];
    out += fmt::format(
        "<g id=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:g}\" stroke-linecap=\"round\" "
        "stroke-linejoin=\"round\">\n",
        l.name, l.color, l.width_mm);

    // Lines come first, so that texts are on top
    for (const DrawnLine& line : lines) {
      if (line.layer != layer) continue;
      out += fmt::format("<path d=\"{}\"{}{}/>\n", svg_path(line, sheet),
                         line.filled ? fmt::format(" fill=\"{}\" stroke=\"none\"", l.color) : "",
                         line.dashed ? " stroke-dasharray=\"2 1.2\"" : "");
    }

    // Texts are centred at their places
    for (const DrawnText& text : texts) {
      if (text.layer != layer) continue;
      const Eigen::Vector2d at = sheet.on_paper(text.at);
      const double height_mm = text.height_m / sheet.mm(), width_mm = text.width_m() / sheet.mm();

      // textLength gives the same width with any font
      out += fmt::format(
          "<text transform=\"translate({:.3f} {:.3f}) rotate({:.2f})\" x=\"{:.3f}\" y=\"{:.3f}\" "
          "font-family=\"Helvetica, Arial, sans-serif\" font-size=\"{:.3f}\" textLength=\"{:.3f}\" "
          "lengthAdjust=\"spacingAndGlyphs\" fill=\"{}\" stroke=\"none\">{}</text>\n",
          at.x(), at.y(), -readable_angle(text.angle_rad) * 180.0 / M_PI, -0.5 * width_mm, 0.5 * height_mm,
          height_mm / 0.718, width_mm, l.color, escaped(text.text));
    }

    out += "</g>\n";
  }
  return out + "</svg>\n";
}

core::Result<void> write_svg(const std::filesystem::path& file, const Drawing& drawing) {
  return core::write_file(file, svg_text(drawing));
}

/// A PDF with a page for each drawing; the part "pdf" makes it.
core::Result<void> write_pdf(const std::filesystem::path& file, const std::vector<Drawing>& pages) {
  const auto& pdf = core::part<PdfFunctions>();
  if (!pdf) return tl::unexpected(pdf.error());
  std::vector<PdfFunctions::Page> parts;
  for (const Drawing& page : pages) {
    parts.push_back({&page, page.all_lines(), page.all_texts(), {}});
    for (const DrawnText& text : parts.back().texts) parts.back().widths_m.push_back(text.width_m());
  }
  const auto bytes = (*pdf)->make(parts);
  if (!bytes) return tl::unexpected(bytes.error());
  return core::write_file(file, *bytes);
}

}  // namespace plumbline::exports
