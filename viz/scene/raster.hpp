// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Points and lines with hidden ones left out, drawn by the processor: OpenGL without a graphics card takes
// ten times as long for the same discs.
#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "plumbline/viz/color.hpp"

namespace plumbline::viz {

/// Some rows of a picture, from the bottom to the top. Places are (x, y) in pixels from the picture's lower
/// left corner and z = depth.
class Raster {
 public:
  Raster(int width, int rows);
  /// Starts again with the rows from `first_row` on.
  void clear(int first_row, const Rgb& background);

  /// A disc that faces the viewer.
  void draw_point(const Eigen::Vector3d& at, double diameter_px, const Rgb& color);
  /// `perspective`: the inverse of depth is straight along it, else depth itself.
  void draw_line(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double width_px, bool perspective,
                 const Rgb& color);

  [[nodiscard]] const cv::Mat4b& picture() const { return picture_; }  ///< RGBA

 private:
  void fill(int row, int first, int last, float depth, const cv::Vec4b& color);

  int first_row_ = 0;
  cv::Mat4b picture_;
  cv::Mat1f depth_;
};

}  // namespace plumbline::viz
