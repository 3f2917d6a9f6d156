// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Choice of the points of a cloud that a picture shows, their size and colour.
#include <cstdint>
#include <string>
#include <vector>

#include "scene/view_frame.hpp"

namespace plumbline::viz {

/// Indices of the finite points that face the viewer (all finite ones without culling, or when nearly none
/// would be left, as with clouds whose normals point nowhere). Takes every `step`-th point.
std::vector<std::uint32_t> visible_points(const Scene& scene, const Projection& projection, bool cull,
                                          std::size_t step = 1);

/// For each cell of `cell_px` pixels the nearest of the points that fall into it; those outside the picture
/// and its depth range are left out. The others would be drawn over anyway: this bounds the drawing of huge
/// clouds.
std::vector<std::uint32_t> nearest_per_cell(const Scene& scene, const std::vector<std::uint32_t>& points,
                                            const Projection& projection, double cell_px);

/// Typical distance between neighbouring points of the surfaces, metres; 0 for fewer than two points.
double point_spacing(const Scene& scene, const std::vector<std::uint32_t>& points);

/// Scale of a colour bar.
struct ColorScale {
  bool shown = false;
  double low = 0.0;
  double high = 1.0;
  std::string label;
};

struct PointColors {
  std::vector<Rgb> colors;  ///< one per chosen point
  ColorScale scale;
};

PointColors color_points(const Scene& scene, const std::vector<std::uint32_t>& points,
                         const SnapshotOptions& options, const SceneAxes& axes, const Projection& projection);

}  // namespace plumbline::viz
