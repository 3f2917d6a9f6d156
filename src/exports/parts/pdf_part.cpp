// SPDX-License-Identifier: BSD-3-Clause
// PDF, by cairo.
#include <cairo-pdf.h>
#include <fmt/format.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "drawings/drawing.hpp"

namespace plumbline::exports {
namespace {

struct FreeSurface {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
struct FreeCairo {
  void operator()(cairo_t* cairo) const { cairo_destroy(cairo); }
};

cairo_status_t append_bytes(void* to, const unsigned char* bytes, unsigned int count) {
  static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(bytes), count);
  return CAIRO_STATUS_SUCCESS;
}

/// "#rrggbb"
void set_color(cairo_t* cairo, const std::string& color) {
  const auto channel = [&](std::size_t at) {
    return static_cast<double>(std::strtol(color.substr(at, 2).c_str(), nullptr, 16)) / 255.0;
  };
  cairo_set_source_rgb(cairo, channel(1), channel(3), channel(5));
}

/// A line or an area in millimetres of the sheet.
void draw_line(cairo_t* cairo, const DrawnLine& line, const DrawingSheet& sheet) {
  constexpr double kDashes[] = {2.0, 1.2};
  for (std::size_t i = 0; i < line.points.size(); ++i) {
    const Eigen::Vector2d at = sheet.on_paper(line.points[i]);
    i == 0 ? cairo_move_to(cairo, at.x(), at.y()) : cairo_line_to(cairo, at.x(), at.y());
  }
  if (line.closed) cairo_close_path(cairo);
  cairo_set_dash(cairo, kDashes, line.dashed ? 2 : 0, 0.0);
  line.filled ? cairo_fill(cairo) : cairo_stroke(cairo);
}

/// The text, stretched to its width.
void draw_text(cairo_t* cairo, const DrawnText& text, double width_m, const DrawingSheet& sheet) {
  constexpr double kCapital = 0.718;
  const Eigen::Vector2d at = sheet.on_paper(text.at);
  const double height_mm = text.height_m / sheet.mm(), width_mm = width_m / sheet.mm();
  cairo_save(cairo);
  cairo_translate(cairo, at.x(), at.y());
  cairo_rotate(cairo, -readable_angle(text.angle_rad));
  cairo_set_font_size(cairo, height_mm / kCapital);

  cairo_text_extents_t extents;
  cairo_text_extents(cairo, text.text.c_str(), &extents);
  cairo_translate(cairo, -0.5 * width_mm, 0.5 * height_mm);
  if (extents.x_advance > 0.0) cairo_scale(cairo, width_mm / extents.x_advance, 1.0);
  cairo_move_to(cairo, 0.0, 0.0);
  cairo_show_text(cairo, text.text.c_str());
  cairo_restore(cairo);
}

/// Lines and texts of a page, layer by layer.
void draw_page(cairo_t* cairo, const PdfFunctions::Page& page) {
  const Drawing& drawing = *page.drawing;
  for (std::size_t layer = 0; layer < drawing.layers.size(); ++layer) {
    set_color(cairo, drawing.layers[layer].color);
    cairo_set_line_width(cairo, drawing.layers[layer].width_mm);
    for (const DrawnLine& line : page.lines) {
      if (line.layer == layer) draw_line(cairo, line, drawing.sheet);
    }
    for (std::size_t i = 0; i < page.texts.size(); ++i) {
      if (page.texts[i].layer == layer) draw_text(cairo, page.texts[i], page.widths_m[i], drawing.sheet);
    }
  }
}

core::Result<std::string> make_pdf(const std::vector<PdfFunctions::Page>& pages) {
  constexpr double kPointsPerMm = 72.0 / 25.4;
  const Drawing& first = *pages.front().drawing;
  std::string bytes;
  const std::unique_ptr<cairo_surface_t, FreeSurface> surface(cairo_pdf_surface_create_for_stream(
      &append_bytes, &bytes, kPointsPerMm * first.sheet.width_mm, kPointsPerMm * first.sheet.height_mm));
  std::string subject = fmt::format("scale 1:{}", first.sheet.scale);
  for (const std::string& note : first.notes) subject += "; " + note;
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, first.title.c_str());
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_SUBJECT, subject.c_str());

  // Same map, same bytes.
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "2000-01-01T00:00:00Z");
  const std::unique_ptr<cairo_t, FreeCairo> cairo(cairo_create(surface.get()));
  cairo_scale(cairo.get(), kPointsPerMm, kPointsPerMm);
  cairo_set_line_cap(cairo.get(), CAIRO_LINE_CAP_ROUND);
  cairo_set_line_join(cairo.get(), CAIRO_LINE_JOIN_ROUND);
  cairo_select_font_face(cairo.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);

  for (const PdfFunctions::Page& page : pages) {
    const DrawingSheet& sheet = page.drawing->sheet;
    cairo_pdf_surface_set_size(surface.get(), kPointsPerMm * sheet.width_mm, kPointsPerMm * sheet.height_mm);
    draw_page(cairo.get(), page);
    cairo_show_page(cairo.get());
  }

  cairo_surface_finish(surface.get());
  const cairo_status_t status = cairo_surface_status(surface.get());
  if (status != CAIRO_STATUS_SUCCESS)
    return core::output_error(fmt::format("PDF: {}", cairo_status_to_string(status)));

  return bytes;
}

}  // namespace
}  // namespace plumbline::exports

namespace px = plumbline::exports;
PLUMBLINE_PART(px::PdfFunctions, &px::make_pdf)
