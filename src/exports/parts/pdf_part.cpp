// SPDX-License-Identifier: BSD-3-Clause
// PDF, by cairo.
#include <cairo-pdf.h>
#include <fmt/format.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "plans/drawing.hpp"

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

void draw_line(cairo_t* cairo, const DrawnLine& line, const DrawingSheet& sheet) {
  for (std::size_t i = 0; i < line.points.size(); ++i) {
    const Eigen::Vector2d at = sheet.on_paper(line.points[i]);
    i == 0 ? cairo_move_to(cairo, at.x(), at.y()) : cairo_line_to(cairo, at.x(), at.y());
  }
  if (line.closed) cairo_close_path(cairo);
  line.filled ? cairo_fill(cairo) : cairo_stroke(cairo);
}

void draw_text(cairo_t* cairo, const DrawnText& text, const DrawingSheet& sheet) {
  const Eigen::Vector2d at = sheet.on_paper(text.at);
  cairo_save(cairo);
  cairo_translate(cairo, at.x(), at.y());
  cairo_rotate(cairo, -readable_angle(text.angle_rad));
  cairo_set_font_size(cairo, 1.4 * sheet.per_metre_mm * text.height_m);
  cairo_text_extents_t extents;
  cairo_text_extents(cairo, text.text.c_str(), &extents);
  cairo_move_to(cairo, -0.5 * extents.width - extents.x_bearing, -0.5 * extents.height - extents.y_bearing);
  cairo_show_text(cairo, text.text.c_str());
  cairo_restore(cairo);
}

core::Result<std::string> make_pdf(const Drawing& drawing, const DrawingSheet& sheet) {
  constexpr double kPointsPerMm = 72.0 / 25.4;
  std::string bytes;
  const std::unique_ptr<cairo_surface_t, FreeSurface> surface(cairo_pdf_surface_create_for_stream(
      &append_bytes, &bytes, kPointsPerMm * sheet.width_mm, kPointsPerMm * sheet.height_mm));
  std::string subject = fmt::format("scale 1:{}", sheet.scale);
  for (const std::string& note : drawing.notes) subject += "; " + note;
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, drawing.title.c_str());
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_SUBJECT, subject.c_str());

  // Same map, same bytes.
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "2000-01-01T00:00:00Z");
  const std::unique_ptr<cairo_t, FreeCairo> cairo(cairo_create(surface.get()));
  cairo_scale(cairo.get(), kPointsPerMm, kPointsPerMm);
  cairo_set_line_cap(cairo.get(), CAIRO_LINE_CAP_ROUND);
  cairo_set_line_join(cairo.get(), CAIRO_LINE_JOIN_ROUND);
  cairo_select_font_face(cairo.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);

  for (std::size_t layer = 0; layer < drawing.layers.size(); ++layer) {
    set_color(cairo.get(), drawing.layers[layer].color);
    cairo_set_line_width(cairo.get(), drawing.layers[layer].width_mm);
    for (const DrawnLine& line : drawing.lines) {
      if (line.layer == layer) draw_line(cairo.get(), line, sheet);
    }
    for (const DrawnText& text : drawing.texts) {
      if (text.layer == layer) draw_text(cairo.get(), text, sheet);
    }
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
