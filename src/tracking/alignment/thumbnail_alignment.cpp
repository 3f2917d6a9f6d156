// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/thumbnail_alignment.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

namespace plumbline::tracking {
namespace {

using geometry::Rigid3;

struct ThumbnailPixel {
  Eigen::Vector3d point;  ///< in the previous camera, metres
  float value = 0.0F;
};

/// Bilinear value and gradient; false outside.
bool sample(const cv::Mat& image, double u, double v, double& value, double& du, double& dv) {
  if (!(u >= 1.0 && v >= 1.0 && u < image.cols - 2 && v < image.rows - 2)) return false;
  const int x = static_cast<int>(u);
  const int y = static_cast<int>(v);
  const double fx = u - x;
  const double fy = v - y;
  const float* r0 = image.ptr<float>(y) + x;
  const float* r1 = image.ptr<float>(y + 1) + x;
  value = (1 - fy) * ((1 - fx) * r0[0] + fx * r0[1]) + fy * ((1 - fx) * r1[0] + fx * r1[1]);
  du = 0.5 * ((1 - fy) * ((1 - fx) * (r0[1] - r0[-1]) + fx * (r0[2] - r0[0])) +
              fy * ((1 - fx) * (r1[1] - r1[-1]) + fx * (r1[2] - r1[0])));
  const float* rm = image.ptr<float>(y - 1) + x;
  const float* rp = image.ptr<float>(y + 2) + x;
  dv = 0.5 * ((1 - fx) * ((1 - fy) * (r1[0] - rm[0]) + fy * (rp[0] - r0[0])) +
              fx * ((1 - fy) * (r1[1] - rm[1]) + fy * (rp[1] - r0[1])));
  return true;
}

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

struct Step {
  Matrix7d h = Matrix7d::Zero();  ///< lower triangle
  Vector7d g = Vector7d::Zero();
  double squares = 0.0;
  int count = 0;
};

/// Residual current(project(T p)) - bias - previous(p); unknowns: pose (left perturbation) and bias.
Step linearise(const std::vector<ThumbnailPixel>& pixels, const cv::Mat& current,
               const sensor::Pinhole& camera, const Rigid3& pose, double bias, double loss) {
  Step step;
  alignas(32) double h[7][8] = {};  // rows padded to whole vectors
  for (const ThumbnailPixel& pixel : pixels) {
    const Eigen::Vector3d p = pose * pixel.point;
    if (p.z() < 0.1) continue;

    const Eigen::Vector2d uv = camera.project(p);
    double value = 0.0;
    double du = 0.0;
    double dv = 0.0;
    if (!sample(current, uv.x(), uv.y(), value, du, dv)) continue;

    // Residual and derivatives, with Huber's weight
    const double r = value - bias - static_cast<double>(pixel.value);
    const double weight = std::abs(r) <= loss ? 1.0 : loss / std::abs(r);
    const double iz = 1.0 / p.z();
    const Eigen::Vector3d dp(du * camera.fx * iz, dv * camera.fy * iz,
                             -(du * camera.fx * p.x() + dv * camera.fy * p.y()) * iz * iz);
    Vector7d j;
    j << dp, p.cross(dp), -1.0;
    alignas(32) const double row[8] = {j(0), j(1), j(2), j(3), j(4), j(5), j(6), 0.0};

    // Lower triangle, in whole vectors
    for (int a = 0; a < 7; ++a) {
      const double wa = weight * row[a];
      for (int b = 0; b < (a < 4 ? 4 : 8); ++b) h[a][b] += wa * row[b];
    }

    step.g.noalias() += weight * r * j;
    step.squares += weight * r * r;
    ++step.count;
  }

  for (int a = 0; a < 7; ++a) {
    for (int b = 0; b <= a; ++b) step.h(a, b) = h[a][b];
  }

  return step;
}

std::vector<ThumbnailPixel> gather_pixels(const cv::Mat& image, const cv::Mat& depth,
                                          const sensor::Pinhole& camera) {
  std::vector<ThumbnailPixel> pixels;
  pixels.reserve(static_cast<std::size_t>(image.total()));

  // Pixels with depth; those at the border lack gradients
  for (int y = 1; y + 1 < image.rows; ++y) {
    for (int x = 1; x + 1 < image.cols; ++x) {
      const float z = depth.at<float>(y, x);
      if (z > 0.0F) pixels.push_back({camera.unproject(x, y, static_cast<double>(z)), image.at<float>(y, x)});
    }
  }
  return pixels;
}

}  // namespace

ThumbnailAlignment align_thumbnails(const cv::Mat& previous, const cv::Mat& previous_depth,
                                    const cv::Mat& current, const sensor::Pinhole& camera,
                                    const Rigid3& guess) {
  ThumbnailAlignment result;
  result.current_from_previous = guess;
  if (previous.empty() || current.empty() || previous_depth.empty() || previous.size() != current.size()) {
    return result;
  }
  const sensor::Pinhole small = camera.resized(previous.cols, previous.rows);
  const std::vector<ThumbnailPixel> pixels = gather_pixels(previous, previous_depth, small);
  if (pixels.size() < 200) return result;

  constexpr double kLoss = 8.0;            // grey values
  constexpr double kIntensitySigma = 4.0;  // of noise and interpolation

  // Weak prior around the guess: 5 cm, 3 degrees. It holds directions that the image does not show.
  Vector7d belief;
  belief << 400.0, 400.0, 400.0, 365.0, 365.0, 365.0, 0.0;
  belief *= kIntensitySigma * kIntensitySigma;

  Rigid3 pose = guess;
  double bias = cv::mean(current)[0] - cv::mean(previous)[0];
  double best = -1.0;
  for (int i = 0; i < 12; ++i) {
    const Step step = linearise(pixels, current, small, pose, bias, kLoss);
    if (step.count < 200) break;

    // The best pose so far is the result
    const double rms = std::sqrt(step.squares / step.count);
    if (i == 0) result.initial_rms = rms;
    if (best < 0.0 || rms < best) {
      best = rms;
      result.current_from_previous = pose;
      result.rms = rms;
      result.pixels = step.count;
    }

    // Step with the prior around the guess
    Matrix7d h = step.h;
    h.diagonal() += belief + Vector7d::Constant(1e-6);
    Vector7d g = step.g;
    g.head<6>() += belief.head<6>().cwiseProduct(geometry::log_se3(pose * guess.inverse()));
    const Vector7d delta = -h.ldlt().solve(g);  // reads the lower triangle
    if (!delta.allFinite()) break;

    pose = geometry::exp_se3(delta.head<6>()) * pose;
    bias += delta(6);
    if (delta.head<6>().cwiseAbs().maxCoeff() < 2e-4) break;
  }

  result.better = result.pixels > 0 && result.rms < 0.97 * result.initial_rms;
  return result;
}

}  // namespace plumbline::tracking
