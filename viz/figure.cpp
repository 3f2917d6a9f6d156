// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viz/figure.hpp"

#include <fmt/format.h>
#include <vtkContextActor.h>
#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkSVGExporter.h>

#include <fstream>
#include <iterator>

#include "chart.hpp"
#include "image.hpp"
#include "offscreen.hpp"
#include "overlay_actor.hpp"

namespace plumbline::viz {
namespace {

constexpr int kSupersampling = 2;
constexpr Rgb kInk{45, 48, 54};

core::Result<void> check(const Figure& figure) {
  if (figure.width_px < 64 || figure.height_px < 64 || figure.width_px > 8192 || figure.height_px > 8192) {
    return core::usage_error(fmt::format("figure size {}x{}: each side must be 64 to 8192 pixels",
                                         figure.width_px, figure.height_px));
  }
  for (const Axes& axes : figure.panels) {
    bool same = true;
    for (const auto& s : axes.lines) same = same && s.x.size() == s.y.size();
    for (const auto& s : axes.scatter) same = same && s.x.size() == s.y.size();
    for (const auto& s : axes.colored_paths) {
      same = same && s.x.size() == s.y.size() && s.x.size() == s.value.size();
    }
    if (!same)
      return core::usage_error("chart \"" + axes.title + "\": a series has x and y of different lengths");
    for (const auto& range : {axes.x_range, axes.y_range}) {
      if (range && !(range->first < range->second)) {
        return core::usage_error("chart \"" + axes.title + "\": an axis range must rise");
      }
    }
  }
  return {};
}

/// All panels as one scene on a white ground, sizes multiplied by `scale`.
void fill(vtkRenderer& renderer, const Figure& figure, double scale) {
  renderer.SetBackground(1.0, 1.0, 1.0);
  const auto rects = panel_rects(figure);
  std::vector<PanelLayout> layouts;
  for (std::size_t i = 0; i < rects.size(); ++i) layouts.push_back(lay_out(figure.panels[i], rects[i]));
  auto actor = make_overlay([&figure, layouts, scale](vtkContext2D* context) {
    Painter painter(context, scale);
    for (std::size_t i = 0; i < layouts.size(); ++i) draw_panel(painter, figure.panels[i], layouts[i]);
    painter.text({0.5 * figure.width_px * scale, (figure.height_px - 30.0) * scale}, figure.title, 27.0, kInk,
                 Anchor::kCentre, true);
  });
  renderer.AddActor(actor);
}

}  // namespace

core::Result<void> write_figure_png(const Figure& figure, const std::filesystem::path& file) {
  if (auto checked = check(figure); !checked) return checked;
  auto window = OffscreenWindow::open(figure.width_px * kSupersampling, figure.height_px * kSupersampling);
  if (!window) return tl::unexpected(window.error());
  vtkNew<vtkRenderer> renderer;
  fill(*renderer, figure, kSupersampling);
  (*window)->window()->AddRenderer(renderer);
  return write_png(downsample((*window)->draw(), kSupersampling), file);
}

core::Result<void> write_figure_svg(const Figure& figure, const std::filesystem::path& file) {
  if (auto checked = check(figure); !checked) return checked;
  auto window = OffscreenWindow::open(figure.width_px, figure.height_px);
  if (!window) return tl::unexpected(window.error());
  vtkNew<vtkRenderer> renderer;
  fill(*renderer, figure, 1.0);
  (*window)->window()->AddRenderer(renderer);

  (*window)->draw();  // prepares the painter that the exporter asks for text sizes

  // The exporter writes files only, and prints when it cannot: try first, then check and move what it wrote.
  std::filesystem::path partial = file;
  partial += ".drawing";
  if (!std::ofstream(partial)) {
    return core::output_error("cannot write " + file.string() +
                              ": no such folder or no right to write there");
  }
  vtkNew<vtkSVGExporter> exporter;
  exporter->SetRenderWindow((*window)->window());
  exporter->SetFileName(partial.c_str());
  exporter->SetTitle(figure.title.c_str());
  exporter->Write();
  std::ifstream in(partial, std::ios::binary);
  const std::string svg{std::istreambuf_iterator<char>(in), {}};
  std::error_code ignored;
  std::filesystem::remove(partial, ignored);
  if (svg.find("</svg>") == std::string::npos) {
    return core::output_error("cannot write " + file.string() + ": the disk is full or the drawing failed");
  }
  return write_bytes(svg, file);
}

}  // namespace plumbline::viz
