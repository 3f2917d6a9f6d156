// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One panel of a figure, drawn with VTK's 2D painter.
#include "figure_layout.hpp"

namespace plumbline::viz {

/// Title, legend, grid, series, axes and colour bar; the layout's pixels are multiplied by painter.scale().
/// Series are cut at the axes here and not by the painter, whose SVG form loses what it should clip
/// (VTK 9.1).
void draw_panel(Painter& painter, const Axes& axes, const PanelLayout& layout);

}  // namespace plumbline::viz
