// SPDX-License-Identifier: BSD-3-Clause
#include "orb_orientation.hpp"

#include <array>
#include <cstdint>
#include <cstring>
#include <opencv2/core.hpp>

#include "plumbline/core/clones.hpp"

namespace plumbline::features {
namespace {

constexpr int kHalfPatch = 15;
constexpr std::size_t kPatchRows = 2 * kHalfPatch + 1;
constexpr std::size_t kPatchColumns = 32;  // the last one weighs nothing

/// Weights of the patch's pixels in its first moments. u^2 + v^2 <= r (r + 1) is the same seen along x and
/// along y; rounding the width of each row, as usual, is not symmetric, and biases orientations by several
/// degrees.
struct Moments {
  std::array<std::int16_t, kPatchRows * kPatchColumns> x{};
  std::array<std::int16_t, kPatchRows * kPatchColumns> y{};

  // Pixels outside the disk keep weight 0
  Moments() {
    for (int v = -kHalfPatch; v <= kHalfPatch; ++v) {
      for (int u = -kHalfPatch; u <= kHalfPatch; ++u) {
        if (u * u + v * v > kHalfPatch * (kHalfPatch + 1)) continue;
        const auto i = static_cast<std::size_t>(v + kHalfPatch) * kPatchColumns +
                       static_cast<std::size_t>(u + kHalfPatch);
        x[i] = static_cast<std::int16_t>(u);
        y[i] = static_cast<std::int16_t>(v);
      }
    }
  }
};

// Sums of x and y, weighted by intensity.
PLUMBLINE_CLONES void weigh(const std::uint8_t* patch, const Moments& moments, int& m10, int& m01) {
  int sum_x = 0;
  int sum_y = 0;
  for (std::size_t i = 0; i < kPatchRows * kPatchColumns; ++i) {
    const auto value = static_cast<std::int16_t>(patch[i]);
    sum_x += moments.x[i] * value;
    sum_y += moments.y[i] * value;
  }
  m10 = sum_x;
  m01 = sum_y;
}

}  // namespace

float orb_orientation(const cv::Mat& image, int x, int y) {
  static const Moments moments;
  std::array<std::uint8_t, kPatchRows * kPatchColumns> patch;
  for (std::size_t v = 0; v < kPatchRows; ++v) {
    std::memcpy(patch.data() + v * kPatchColumns,
                image.ptr<std::uint8_t>(y - kHalfPatch + static_cast<int>(v)) + x - kHalfPatch,
                kPatchColumns);
  }

  // Direction of the intensity centroid
  int m10 = 0;
  int m01 = 0;
  weigh(patch.data(), moments, m10, m01);
  return cv::fastAtan2(static_cast<float>(m01), static_cast<float>(m10));
}

}  // namespace plumbline::features
