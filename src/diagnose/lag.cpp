// SPDX-License-Identifier: BSD-3-Clause
// What moves in the pictures moves in depth at the same time. The motion of thumbnails, picture after
// picture, is compared with that of their depth, at delays that grow evenly.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "grade.hpp"

namespace plumbline::diagnose {
namespace {

constexpr double kMostDelay_s = 0.3;
constexpr double kMostDrift_s = 1.0;
constexpr double kDelayStep_s = 0.03;
constexpr double kDriftStep_s = 0.08;
constexpr std::size_t kLeastSteps = 50;

// Evidence: correlations of all motion and of quick motion, and what they leave unexplained.
constexpr double kDrift_s = 0.12;
constexpr double kQuickGain = 0.2;
constexpr double kQuickTimes = 1.5;
constexpr double kDelay_s = 0.1;
constexpr double kQuickLate = 0.3;
constexpr double kLateTimes = 2.0;
constexpr double kGain = 0.35;
constexpr double kFit = 0.65;

/// Motion from one thumbnail to the next, thumbnail pixels.
struct Motion {
  double at = 0.0;        ///< of colour, seconds
  double depth_at = 0.0;  ///< by the stamps of depth
  Eigen::Vector2d gray = Eigen::Vector2d::Zero();
  Eigen::Vector2d depth = Eigen::Vector2d::Zero();
};

/// Translation (and a gain and an offset) that explains the change from `a` to `b` best, by iterated least
/// squares. `zero_is_none`: pixels of value 0 are left out.
Eigen::Vector2d translation(const cv::Mat& a, const cv::Mat& b, float most, bool zero_is_none) {
  Eigen::Vector2d t = Eigen::Vector2d::Zero();

  // Gauss-Newton over translation, gain and offset.
  for (int round = 0; round < 4; ++round) {
    Eigen::Matrix4d normal = Eigen::Matrix4d::Identity() * 1e-6;
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (int v = 3; v < a.rows - 3; ++v) {
      for (int u = 3; u < a.cols - 3; ++u) {
        const double x = u + t.x(), y = v + t.y();
        const int iu = static_cast<int>(std::floor(x)), iv = static_cast<int>(std::floor(y));
        if (iu < 1 || iv < 1 || iu >= a.cols - 2 || iv >= a.rows - 2) continue;

        const auto* up = b.ptr<float>(iv);
        const auto* down = b.ptr<float>(iv + 1);
        const auto* row = a.ptr<float>(v);

        // Four for the interpolation, five for value and gradient.
        const float values[] = {up[iu],
                                up[iu + 1],
                                down[iu],
                                down[iu + 1],
                                row[u - 1],
                                row[u],
                                row[u + 1],
                                a.ptr<float>(v - 1)[u],
                                a.ptr<float>(v + 1)[u]};

        // Unknown depths cannot be compared.
        if (zero_is_none &&
            std::any_of(std::begin(values), std::end(values), [](float z) { return !(z > 0.0F); }))
          continue;

        // Bilinear interpolation, central differences.
        const double fx = x - iu, fy = y - iv;
        const double there = (values[0] * (1.0 - fx) + values[1] * fx) * (1.0 - fy) +
                             (values[2] * (1.0 - fx) + values[3] * fx) * fy;
        const double gx = 0.5 * (values[6] - values[4]), gy = 0.5 * (values[8] - values[7]);

        // Huber's weight limits occlusions.
        const double difference = values[5] - there;
        const double w = std::abs(difference) < most ? 1.0 : most / std::abs(difference);
        const Eigen::Vector4d row4(gx, gy, values[5], 1.0);
        normal += w * row4 * row4.transpose();
        right += w * difference * row4;
      }
    }

    // Small steps, for the linearisation holds nearby.
    const Eigen::Vector4d step = normal.ldlt().solve(right);
    t += step.head<2>().cwiseMax(-2.0).cwiseMin(2.0);
    t = t.cwiseMax(-8.0).cwiseMin(8.0);
  }
  return t;
}

cv::Mat blurred(const cv::Mat& image) {
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {5, 5}, 1.0);
  return smooth;
}

/// Image motion and depth motion between successive thumbnails, per second.
std::vector<Motion> motions_of(const std::vector<Thumbnail>& all) {
  std::vector<Motion> motions;
  for (std::size_t k = 1; k < all.size(); ++k) {
    if (all[k].index != all[k - 1].index + 1) continue;
    Motion m;
    m.at = 0.5 * (all[k].stamp + all[k - 1].stamp);
    m.depth_at = 0.5 * (all[k].depth_stamp + all[k - 1].depth_stamp);
    const double dt = std::max(1e-3, all[k].stamp - all[k - 1].stamp);
    m.gray = translation(blurred(all[k - 1].gray), blurred(all[k].gray), 6.0F, false) / dt;
    m.depth = translation(all[k - 1].inverse, all[k].inverse, 0.02F, true) / dt;
    motions.push_back(m);
  }
  return motions;
}

/// Motion of the pictures at a time, between two measured ones.
bool gray_at(const std::vector<Motion>& motions, double at, Eigen::Vector2d& found) {
  const auto after = std::lower_bound(motions.begin(), motions.end(), at,
                                      [](const Motion& m, double t) { return m.at < t; });
  if (after == motions.begin() || after == motions.end()) return false;
  const auto before = after - 1;
  const double gap = after->at - before->at;
  if (gap > 0.2) return false;
  found = before->gray + (after->gray - before->gray) * ((at - before->at) / gap);
  return true;
}

/// Correlation of the motion of depth with that of the pictures `delay` + `drift` x time earlier, both axes
/// together; time runs from 0 to 1.
double correlation(const std::vector<Motion>& motions, double delay_s, double drift_s) {
  const double begin = motions.front().at;
  const double span = std::max(1e-3, motions.back().at - begin);
  Eigen::Vector2d sum_g = Eigen::Vector2d::Zero(), sum_d = sum_g, gg = sum_g, dd = sum_g, gd = sum_g;
  std::size_t n = 0;

  for (const Motion& m : motions) {
    Eigen::Vector2d g;
    if (!gray_at(motions, m.depth_at - delay_s - drift_s * (m.at - begin) / span, g)) continue;
    sum_g += g;
    sum_d += m.depth;
    gg += g.cwiseProduct(g);
    dd += m.depth.cwiseProduct(m.depth);
    gd += g.cwiseProduct(m.depth);
    ++n;
  }

  if (n < kLeastSteps) return 0.0;
  const double c = 1.0 / static_cast<double>(n);
  const Eigen::Vector2d vg = c * gg - (c * sum_g).cwiseAbs2(), vd = c * dd - (c * sum_d).cwiseAbs2(),
                        v = c * gd - (c * sum_g).cwiseProduct(c * sum_d);
  // Both axes share one residual: each is weighted by how far depth moves along it.
  double explained = 0.0;
  for (int k = 0; k < 2; ++k) {
    if (vg[k] > 1e-9 && v[k] > 0.0) explained += v[k] * v[k] / vg[k];
  }
  return std::sqrt(explained / std::max(1e-9, vd.sum()));
}

/// The same without what changes slowly: less the mean of half a second before and after.
std::vector<Motion> without_slow(const std::vector<Motion>& motions) {
  constexpr double kHalf_s = 0.5;
  std::vector<Motion> quick = motions;
  for (Motion& m : quick) {
    Eigen::Vector2d gray = Eigen::Vector2d::Zero(), depth = gray;
    double count = 0.0;
    for (const Motion& other : motions) {
      if (std::abs(other.at - m.at) > kHalf_s) continue;
      gray += other.gray;
      depth += other.depth;
      count += 1.0;
    }
    m.gray -= gray / count;
    m.depth -= depth / count;
  }
  return quick;
}

}  // namespace

std::vector<Sign> lag_signs(const Samples& samples) {
  Sign lags{"depth_lags", "s"}, late{"depth_late", "s"};
  const std::vector<Motion> motions = motions_of(samples.thumbnails());
  if (motions.size() < kLeastSteps) return {lags, late};
  const std::vector<Motion> quick = without_slow(motions);
  const double none = correlation(motions, 0.0, 0.0);
  double constant = none, best = none, delay = 0.0, begin = 0.0, drift = 0.0, quick_constant = 0.0;

  // The best constant delay, and the best one that grows linearly.
  for (double d = -kMostDelay_s; d <= kMostDelay_s + 1e-9; d += kDelayStep_s) {
    quick_constant = std::max(quick_constant, correlation(quick, d, 0.0));

    if (const double c = correlation(motions, d, 0.0); c > constant) constant = c, delay = d;
    for (double r = -kMostDrift_s; r <= kMostDrift_s + 1e-9; r += kDriftStep_s) {
      if (const double c = correlation(motions, d, r); c > best) best = c, begin = d, drift = r;
    }
  }

  const auto unexplained = [](double c) { return std::max(1e-3, 1.0 - c * c); };

  // Depth that lags more and more.
  lags.size = drift;
  const double quick_lag = correlation(quick, begin, drift);
  if (grade(lags, {std::abs(drift) / kDrift_s, (quick_lag - quick_constant) / kQuickGain,
                   quick_lag / (kQuickTimes * std::max(quick_constant, 0.2)),
                   (unexplained(constant) / unexplained(best) - 1.0) / kGain, best / kFit})) {
    lags.text = fmt::format(
        "depth falls behind colour in the course of the recording: by {:.2f} s at first, {:.2f} s at "
        "the end (correlation of their motions {:.2f}, with a constant delay {:.2f})",
        begin, begin + drift, best, constant);
    lags.remedy =
        "record again with both streams stamped by one clock, or pair the images by the time of exposure";
  }

  // Depth with a constant delay.
  late.size = delay;
  const double quick_late = correlation(quick, delay, 0.0), quick_none = correlation(quick, 0.0, 0.0);
  if (grade(late, {std::abs(delay) / kDelay_s, (quick_late - quick_none) / kQuickLate,
                   quick_late / (kLateTimes * std::max(quick_none, 0.2)),
                   (unexplained(none) / unexplained(constant) - 1.0) / kGain, constant / kFit})) {
    late.text = fmt::format(
        "depth is {:.2f} s {} than its stamps (correlation of its motion with colour's {:.2f}, as "
        "stamped {:.2f})",
        std::abs(delay), delay > 0.0 ? "older" : "newer", constant, none);
    late.remedy = fmt::format("add {:+.2f} s to depth_delay in camera.yaml", -delay);
  }
  return {lags, late};
}

}  // namespace plumbline::diagnose
