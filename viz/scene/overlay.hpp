// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Drawing over the points of a snapshot: camera paths, title, legend, scale bar, axes, colour bar.
#include <string>

#include "canvas/painter.hpp"
#include "scene/point_style.hpp"
#include "scene/view_frame.hpp"

namespace plumbline::viz {

struct OverlayContent {
  const Scene* scene = nullptr;
  const SnapshotOptions* options = nullptr;
  Projection projection;
  ColorScale color_scale;
  bool empty = false;  ///< nothing to show: say so
};

void draw_paths(Painter& painter, const OverlayContent& content);
void draw_annotations(Painter& painter, const OverlayContent& content);

/// A length with a suitable unit: "20 cm", "5 m".
std::string length_text(double metres);

}  // namespace plumbline::viz
