// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Edge-aware smoothing and differentiation of inverse depth on a grid of every stride-th pixel. On a plane
// the inverse depth is linear in the pixel and the noise of structured light is almost the same everywhere,
// so means and differences of it are unbiased where those of depth are not.
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace plumbline::cloud {

/// Standard deviation of w = 1/z for the sensor's depth noise, sigma_w = sigma_z(z) w^2, as a polynomial in
/// w.
inline float inverse_depth_sigma(float w) {
  const float bend = 1.0F - 0.4F * w;
  return 0.0012F * w * w + 0.0019F * bend * bend;
}

/// A grid of floats, row after row.
struct Grid {
  int width = 0;
  int height = 0;
  std::vector<float> values;

  [[nodiscard]] float* row(int j) { return values.data() + static_cast<std::ptrdiff_t>(j) * width; }
  [[nodiscard]] const float* row(int j) const {
    return values.data() + static_cast<std::ptrdiff_t>(j) * width;
  }
};

/// Mean of 1/z over window x window pixels (odd) around every stride-th pixel, over the pixels that lie on
/// the same surface according to their depth. 0 if the pixel itself has no depth within [min, max].
Grid smooth_inverse_depth(const cv::Mat& depth, int stride, int window, float min_depth, float max_depth,
                          float focal);

/// One more pass of means, over three cells `step` apart along rows and then along columns. It is applied if
/// the noise of the means so far (`noise` times that of one measurement) exceeds `wanted_m` metres, and the
/// three cells lie on a line within that noise. A plane of any slant stays a plane, a step or fold is not
/// changed.
void widen_means(Grid& inverse_depth, int step, float noise, float wanted_m);

/// For every cell the number of cells over which the surface continues in a direction without a jump, at most
/// `longest`.
struct Reach {
  std::vector<std::uint8_t> left, right, up, down;
};
Reach surface_reach(const Grid& inverse_depth, int stride, float focal, int longest);

/// Slope of the surface along one axis at a cell.
struct Slope {
  bool known = false;
  float value = 0.0F;  ///< inverse depth per cell
  float bend = 0.0F;   ///< slope after minus slope before the cell
};
/// `centre` points at the cell, `step` to the next cell along the axis; `before` and `after` are the reaches.
/// Central difference over +-base cells, less where a jump is nearer; at a crease the straighter side alone.
Slope slope_along(const float* centre, std::ptrdiff_t step, int before, int after, int base, float sigma);

}  // namespace plumbline::cloud
