// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/optimize/photometric_terms.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plumbline/geometry/adjoint.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Rigid3;

/// Where a family's image shows a point of the reference camera.
class Lookup {
 public:
  Lookup(const PhotometricFamily& family, const Rigid3& camera_from_world)
      : image_(family.image),
        last_x_(static_cast<float>(image_.cols) - 2.0F),
        last_y_(static_cast<float>(image_.rows) - 2.0F) {
    const Rigid3 camera_from_reference = camera_from_world * family.reference_from_world.inverse();
    rotation_ = camera_from_reference.rotation.cast<float>();
    translation_ = camera_from_reference.translation.cast<float>();
    fx_ = static_cast<float>(family.camera.fx);
    fy_ = static_cast<float>(family.camera.fy);
    cx_ = static_cast<float>(family.camera.cx);
    cy_ = static_cast<float>(family.camera.cy);
  }
  /// Grey value there, bilinear; false: not in the image.
  bool at(const Eigen::Vector3f& point, float& value) const {
    const Eigen::Vector3f p = rotation_ * point + translation_;
    if (!(p.z() > 0.1F)) return false;
    const float per_z = 1.0F / p.z();
    const float x = fx_ * p.x() * per_z + cx_, y = fy_ * p.y() * per_z + cy_;
    if (!(x >= 1.0F && y >= 1.0F && x < last_x_ && y < last_y_)) return false;
    const int ix = static_cast<int>(x), iy = static_cast<int>(y);
    const float sx = x - static_cast<float>(ix), sy = y - static_cast<float>(iy);
    const float* top = image_.ptr<float>(iy) + ix;
    const float* low = image_.ptr<float>(iy + 1) + ix;
    const float t = top[0] + sx * (top[1] - top[0]), l = low[0] + sx * (low[1] - low[0]);
    value = t + sy * (l - t);
    return true;
  }

 private:
  const cv::Mat& image_;
  float last_x_, last_y_;
  Eigen::Matrix3f rotation_;
  Eigen::Vector3f translation_;
  float fx_ = 1.0F, fy_ = 1.0F, cx_ = 0.0F, cy_ = 0.0F;
};

/// Sums of w r^T r for rows r = (j, e), padded to whole vectors.
struct Sums {
  alignas(32) float s[7][8] = {};
  void add(const float (&row)[8], float w) {
    for (int a = 0; a < 7; ++a) {
      const float wa = w * row[a];
      for (int b = 0; b < 8; ++b) s[a][b] += wa * row[b];
    }
  }
};

}  // namespace

std::vector<float> photometric_residuals(const PhotometricFamily& family, const Rigid3& camera_from_world) {
  const Lookup image(family, camera_from_world);
  const auto gain = static_cast<float>(family.gain), per_sigma = static_cast<float>(1.0 / family.sigma);
  std::vector<float> result(family.terms.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < result.size(); ++i) {
    float value = 0.0F;
    if (image.at(family.terms[i].point, value)) {
      result[i] = (value - gain * family.terms[i].value) * family.terms[i].weight * per_sigma;
    }
  }
  return result;
}

PhotometricSums sum_photometric(const PhotometricFamily& family, const Rigid3& camera_from_world,
                                double loss) {
  constexpr std::size_t kBlock = 512;  // summed in single precision
  const Lookup image(family, camera_from_world);
  const auto gain = static_cast<float>(family.gain), per_sigma = static_cast<float>(1.0 / family.sigma);
  const auto threshold = static_cast<float>(loss);
  PhotometricSums sums;
  for (std::size_t from = 0; from < family.terms.size(); from += kBlock) {
    const std::size_t to = std::min(family.terms.size(), from + kBlock);
    Sums block;
    float cost = 0.0F;
    for (std::size_t i = from; i < to; ++i) {
      const PhotometricTerm& term = family.terms[i];
      float value = 0.0F;
      if (!image.at(term.point, value)) {
        cost += 0.5F;
        continue;
      }
      const float e = (value - gain * term.value) * term.weight * per_sigma;
      const float size = std::abs(e);
      const float w = size <= threshold ? 1.0F : threshold / size;
      cost += size <= threshold ? 0.5F * e * e : threshold * (size - 0.5F * threshold);
      const auto& d = term.derivative;
      const float scale = gain * term.weight * per_sigma;
      alignas(32) const float row[8] = {
          scale * d(0), scale * d(1), scale * d(2), scale * d(3), scale * d(4), scale * d(5), e, 0.0F};
      block.add(row, w);
    }
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b <= a; ++b) sums.h(a, b) += static_cast<double>(block.s[a][b]);
      sums.g(a) += static_cast<double>(block.s[a][6]);
    }
    sums.cost += static_cast<double>(cost);
  }
  // T Exp(xi) = Exp(adjoint(T) xi) T: from the right of camera_from_reference to the left.
  const Rigid3 reference_from_camera = family.reference_from_world * camera_from_world.inverse();
  const geometry::Matrix6d carry = geometry::adjoint(reference_from_camera);
  const geometry::Matrix6d full = sums.h.selfadjointView<Eigen::Lower>();
  sums.h = carry.transpose() * full * carry;
  sums.g = carry.transpose() * sums.g;
  return sums;
}

double photometric_correlation(const PhotometricFamily& family, const Rigid3& camera_from_world,
                               int min_terms) {
  const Lookup image(family, camera_from_world);
  double vv = 0.0, ss = 0.0, vs = 0.0;
  int count = 0;
  for (const PhotometricTerm& term : family.terms) {
    float seen = 0.0F;
    if (!image.at(term.point, seen)) continue;
    const auto s = static_cast<double>(seen), v = static_cast<double>(term.value);
    vv += v * v;
    ss += s * s;
    vs += v * s;
    ++count;
  }
  return count < min_terms || !(vv > 0.0) || !(ss > 0.0) ? 0.0 : vs / std::sqrt(vv * ss);
}

}  // namespace plumbline::optimize
