// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/corner_patch.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>

namespace plumbline::features {
namespace {

constexpr int kReach = CornerPatch::kReach;
constexpr int kSide = CornerPatch::kSide;
constexpr int kAcross = 2 * kReach + 1;
constexpr int kCount = kAcross * kAcross;

/// The inner part of a patch: grey values about their mean, gradients, and the inverse of the normal matrix
/// of position, gain and offset.
struct Template {
  std::array<float, kCount> value;
  std::array<float, kCount> dx;
  std::array<float, kCount> dy;
  Eigen::Matrix3f inverse;  ///< position and gain; the offset is apart: the mean is taken off everything
  float power = 0.0F;       ///< sum of squared values
};

bool make_template(const CornerPatch& patch, Template& to) {
  constexpr float kLeast = 100.0F;  // squared grey values: less than noise has
  float mean = 0.0F;
  float mean_x = 0.0F;
  float mean_y = 0.0F;
  int i = 0;

  // Values, gradients and their means
  for (int v = 1; v <= kAcross; ++v) {
    const std::uint8_t* row = patch.gray.data() + v * kSide + 1;
    for (int u = 0; u < kAcross; ++u, ++i) {
      const auto k = static_cast<std::size_t>(i);
      to.value[k] = row[u];
      to.dx[k] = 0.5F * static_cast<float>(row[u + 1] - row[u - 1]);
      to.dy[k] = 0.5F * static_cast<float>(row[u + kSide] - row[u - kSide]);

      mean += to.value[k];
      mean_x += to.dx[k];
      mean_y += to.dy[k];
    }
  }

  mean /= kCount;
  mean_x /= kCount;
  mean_y /= kCount;
  Eigen::Matrix3f normal = Eigen::Matrix3f::Zero();

  // Normal equations for shift and gain, without means
  for (std::size_t k = 0; k < kCount; ++k) {
    to.value[k] -= mean;
    to.dx[k] -= mean_x;
    to.dy[k] -= mean_y;

    normal(0, 0) += to.dx[k] * to.dx[k];
    normal(0, 1) += to.dx[k] * to.dy[k];
    normal(0, 2) += to.dx[k] * to.value[k];
    normal(1, 1) += to.dy[k] * to.dy[k];
    normal(1, 2) += to.dy[k] * to.value[k];
    normal(2, 2) += to.value[k] * to.value[k];
  }

  // Too little texture along some direction
  to.power = normal(2, 2);
  const Eigen::Matrix3f full = normal.selfadjointView<Eigen::Upper>();
  const float across = full(0, 0) * full(1, 1) - full(0, 1) * full(0, 1);
  if (full(0, 0) + full(1, 1) < kLeast || across < kLeast * (full(0, 0) + full(1, 1))) return false;

  bool invertible = false;
  full.computeInverseWithCheck(to.inverse, invertible, 1.0F);
  return invertible && to.inverse.allFinite();
}

/// Grey values of `level` at the positions of the patch's pixels; false outside the image.
bool sample(const cv::Mat& level, const Eigen::Vector2f& at, const Eigen::Matrix2f& level_from_patch,
            std::array<float, kCount>& values, float& mean) {
  const float reach_x = kReach * (std::abs(level_from_patch(0, 0)) + std::abs(level_from_patch(0, 1)));
  const float reach_y = kReach * (std::abs(level_from_patch(1, 0)) + std::abs(level_from_patch(1, 1)));
  if (!(at.x() - reach_x >= 0.0F) || !(at.y() - reach_y >= 0.0F) ||
      !(at.x() + reach_x < static_cast<float>(level.cols - 1)) ||
      !(at.y() + reach_y < static_cast<float>(level.rows - 1)))
    return false;

  const auto step = static_cast<std::ptrdiff_t>(level.step1());
  const std::uint8_t* origin = level.ptr<std::uint8_t>(0);
  mean = 0.0F;

  std::size_t k = 0;
  for (int v = -kReach; v <= kReach; ++v) {
    const Eigen::Vector2f row = at + level_from_patch.col(1) * static_cast<float>(v);
    for (int u = -kReach; u <= kReach; ++u, ++k) {
      const float x = row.x() + level_from_patch(0, 0) * static_cast<float>(u);
      const float y = row.y() + level_from_patch(1, 0) * static_cast<float>(u);
      const int x0 = static_cast<int>(x);
      const int y0 = static_cast<int>(y);

      // Bilinear interpolation
      const float fx = x - static_cast<float>(x0);
      const float fy = y - static_cast<float>(y0);
      const std::uint8_t* p = origin + y0 * step + x0;
      const float above = static_cast<float>(p[0]) + fx * static_cast<float>(p[1] - p[0]);
      const float below = static_cast<float>(p[step]) + fx * static_cast<float>(p[step + 1] - p[step]);
      values[k] = above + fy * (below - above);
      mean += values[k];
    }
  }

  mean /= kCount;
  return true;
}

}  // namespace

CornerPatch cut_patch(const cv::Mat& level, int x, int y, const Eigen::Vector2f& middle) {
  CornerPatch patch;
  patch.middle = middle;

  // A pixel more on each side, for the gradients
  for (int v = 0; v < kSide; ++v) {
    std::memcpy(patch.gray.data() + v * kSide, level.ptr<std::uint8_t>(y - kReach - 1 + v) + x - kReach - 1,
                kSide);
  }
  return patch;
}

std::optional<Eigen::Vector2f> align_patch(const CornerPatch& patch, const cv::Mat& level,
                                           const Eigen::Vector2f& start,
                                           const Eigen::Matrix2f& level_from_patch) {
  constexpr int kSteps = 10;
  constexpr float kFarthest_px = 2.0F;
  constexpr float kSettled_px = 0.02F;
  constexpr float kLeastAlike = 0.8F;
  constexpr float kLeastGain = 0.3F;
  Template sought;
  if (!make_template(patch, sought)) return std::nullopt;

  Eigen::Vector2f at = start;
  std::array<float, kCount> values;
  float gain = 1.0F;
  bool settled = false;

  // Inverse compositional: one inverse serves all steps
  for (int i = 0; i <= kSteps; ++i) {
    float mean = 0.0F;
    if (!sample(level, at, level_from_patch, values, mean)) return std::nullopt;

    // Residuals without the mean brightness
    Eigen::Vector3f slope = Eigen::Vector3f::Zero();
    float product = 0.0F;
    float power = 0.0F;

    for (std::size_t k = 0; k < kCount; ++k) {
      const float value = values[k] - mean;
      const float off = value - gain * sought.value[k];
      slope += off * Eigen::Vector3f(sought.dx[k], sought.dy[k], sought.value[k]);
      product += value * sought.value[k];
      power += value * value;
    }

    // Accepted only with high correlation
    if (settled) {
      if (product < kLeastAlike * std::sqrt(power * sought.power)) return std::nullopt;
      return at;
    }

    // The step moves the patch, scaled by its gain
    const Eigen::Vector3f step = sought.inverse * slope;
    gain += step.z();
    const Eigen::Vector2f moved = level_from_patch * step.head<2>() / std::max(kLeastGain, gain);
    at -= moved;
    if (!((at - start).norm() <= kFarthest_px)) return std::nullopt;
    settled = moved.norm() < kSettled_px;
  }

  return std::nullopt;
}

}  // namespace plumbline::features
