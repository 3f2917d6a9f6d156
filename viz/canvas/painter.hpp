// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Two-dimensional drawing on top of a picture: pixels from the lower left corner.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "plumbline/viz/color.hpp"

class vtkContext2D;

namespace plumbline::viz {

enum class Anchor { kLeft, kCentre, kRight };

/// Thin layer over VTK's painter: one call per mark, all sizes multiplied by `scale`.
class Painter {
 public:
  Painter(vtkContext2D* context, double scale) : context_(context), scale_(scale) {}

  void polyline(const std::vector<Eigen::Vector2d>& points, const Rgb& color, double width_px,
                double opacity = 1.0);
  void rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, const Rgb& fill,
                 double opacity = 1.0);
  void disc(const Eigen::Vector2d& centre, double radius_px, const Rgb& fill);
  void ring(const Eigen::Vector2d& centre, double radius_px, const Rgb& color, double width_px);
  /// `at` is the middle of the text's height.
  void text(const Eigen::Vector2d& at, const std::string& text, double size_px, const Rgb& color,
            Anchor anchor = Anchor::kLeft, bool bold = false);
  double text_width(const std::string& text, double size_px, bool bold = false);
  [[nodiscard]] double scale() const { return scale_; }

 private:
  vtkContext2D* context_;
  double scale_;
};

}  // namespace plumbline::viz
