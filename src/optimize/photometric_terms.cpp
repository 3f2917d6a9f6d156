// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/optimize/photometric_terms.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "plumbline/core/clones.hpp"
#include "plumbline/geometry/adjoint.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Rigid3;

constexpr std::size_t kBlock = 512;  // terms that are looked up together, and summed in single precision
using Seen = std::array<float, kBlock>;

/// Projection of points of the reference camera into a family's image.
struct View {
  View(const PhotometricFamily& family, const Rigid3& camera_from_world)
      : pixels(family.image.ptr<float>()),
        row(static_cast<std::int32_t>(family.image.step1())),
        last_x(static_cast<float>(family.image.cols) - 2.0F),
        last_y(static_cast<float>(family.image.rows) - 2.0F),
        fx(static_cast<float>(family.camera.fx)),
        fy(static_cast<float>(family.camera.fy)),
        cx(static_cast<float>(family.camera.cx)),
        cy(static_cast<float>(family.camera.cy)) {
    const Rigid3 camera_from_reference = camera_from_world * family.reference_from_world.inverse();
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) r[a][b] = static_cast<float>(camera_from_reference.rotation(a, b));
      t[a] = static_cast<float>(camera_from_reference.translation(a));
    }
  }

  const float* pixels;
  std::int32_t row;  ///< from one row of the image to the next
  float last_x, last_y, fx, fy, cx, cy;
  float r[3][3];
  float t[3];
};

/// Vectors of eight numbers. The default clone uses two registers for each.
using Floats = float __attribute__((vector_size(32)));
using Integers = std::int32_t __attribute__((vector_size(32)));
constexpr std::size_t kLanes = sizeof(Floats) / sizeof(float);
static_assert(kBlock % kLanes == 0);

/// Values looked up for a block of terms, in columns.
struct Places {
  alignas(32) float x[kBlock], y[kBlock], z[kBlock];  // of the points
  alignas(32) std::int32_t pixel[kBlock];
  alignas(32) float right[kBlock], down[kBlock];  // offsets from that pixel, fractions
};

/// Bilinear grey values where the image shows `count` terms, at most a block; NaN: not in the image.
PLUMBLINE_CLONES void look(const PhotometricTerm* terms, std::size_t count, const View& v, float* seen) {
  constexpr float kNearest_m = 0.1F;
  constexpr std::int32_t kNan = 0x7FC00000;
  Places at;

  // Arrays by coordinate, for vector instructions
  for (std::size_t i = 0; i < count; ++i) {
    const float* point = terms[i].point.data();
    at.x[i] = point[0];
    at.y[i] = point[1];
    at.z[i] = point[2];
  }

  for (std::size_t i = count; i % kLanes != 0; ++i) at.x[i] = at.y[i] = at.z[i] = 0.0F;

  // Pixels onto which the terms project
  for (std::size_t i = 0; i < count; i += kLanes) {
    Floats x, y, z;
    std::memcpy(&x, at.x + i, sizeof x);
    std::memcpy(&y, at.y + i, sizeof y);
    std::memcpy(&z, at.z + i, sizeof z);

    // Projection; places outside the image become pixel 0
    const Floats in_x = v.r[0][0] * x + (v.r[0][1] * y + v.r[0][2] * z) + v.t[0];
    const Floats in_y = v.r[1][0] * x + (v.r[1][1] * y + v.r[1][2] * z) + v.t[1];
    const Floats in_z = v.r[2][0] * x + (v.r[2][1] * y + v.r[2][2] * z) + v.t[2];
    const Floats per_z = 1.0F / in_z;
    Floats u = v.fx * in_x * per_z + v.cx, w = v.fy * in_y * per_z + v.cy;
    const Integers inside = (in_z > kNearest_m) & (u >= 1.0F) & (w >= 1.0F) & (u < v.last_x) & (w < v.last_y);
    u = reinterpret_cast<Floats>(reinterpret_cast<Integers>(u) & inside);
    w = reinterpret_cast<Floats>(reinterpret_cast<Integers>(w) & inside);

    // Whole pixel, and shares for the interpolation
    const Integers column = __builtin_convertvector(u, Integers), line = __builtin_convertvector(w, Integers);
    const Integers pixel = line * v.row + column, unseen = ~inside & kNan;
    u -= __builtin_convertvector(column, Floats);
    w -= __builtin_convertvector(line, Floats);
    std::memcpy(at.pixel + i, &pixel, sizeof pixel);
    std::memcpy(at.right + i, &u, sizeof u);
    std::memcpy(at.down + i, &w, sizeof w);
    std::memcpy(seen + i, &unseen, sizeof unseen);
  }

  // Intensities; NaN remains NaN
  for (std::size_t i = 0; i < count; ++i) {
    const float* top = v.pixels + at.pixel[i];
    const float* low = top + v.row;
    const float above = top[0] + at.right[i] * (top[1] - top[0]);
    const float below = low[0] + at.right[i] * (low[1] - low[0]);
    seen[i] += above + at.down[i] * (below - above);
  }
}

/// Calls what(first, count, seen) for block after block of a family's terms.
template <typename What>
void for_blocks(const PhotometricFamily& family, const Rigid3& camera_from_world, const What& what) {
  const View view(family, camera_from_world);
  Seen seen;
  for (std::size_t first = 0; first < family.terms.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, family.terms.size() - first);
    look(family.terms.data() + first, count, view, seen.data());
    what(first, count, seen.data());
  }
}

/// Factors of a family's residuals, and Huber's threshold.
struct Scale {
  float gain, per_sigma, threshold;
};

/// Sums of w r^T r for rows r = (j, e), padded to whole vectors, and the cost.
struct Sums {
  float s[7][8];
  float cost;
};

PLUMBLINE_CLONES void sum_block(const PhotometricTerm* terms, const float* seen, std::size_t count,
                                const Scale& scale, Sums& sums) {
  static_assert(offsetof(PhotometricTerm, value) == 6 * sizeof(float));
  const Floats in_jacobian{1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 0.0F, 0.0F};
  const Floats is_residual{0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F};
  Floats s0{}, s1{}, s2{}, s3{}, s4{}, s5{}, s6{};  // an array would not stay in registers
  float cost = 0.0F;

  // Terms outside the image cost a constant
  for (std::size_t i = 0; i < count; ++i) {
    if (std::isnan(seen[i])) {
      cost += 0.5F;
      continue;
    }

    // Residual in sigmas, with Huber's loss
    const PhotometricTerm& term = terms[i];
    const float e = (seen[i] - scale.gain * term.value) * term.weight * scale.per_sigma;
    const float size = std::abs(e);
    const bool near = size <= scale.threshold;
    const float w = near ? 1.0F : scale.threshold / size;
    cost += near ? 0.5F * e * e : scale.threshold * (size - 0.5F * scale.threshold);

    // Jacobian and residual in one vector
    Floats row;
    std::memcpy(&row, reinterpret_cast<const char*>(&term), sizeof row);
    row = row * (in_jacobian * (scale.gain * term.weight * scale.per_sigma)) + is_residual * e;

    // Products of the vector with itself
    const Floats weighted = row * w;
    s0 += weighted[0] * row;
    s1 += weighted[1] * row;
    s2 += weighted[2] * row;
    s3 += weighted[3] * row;
    s4 += weighted[4] * row;
    s5 += weighted[5] * row;
    s6 += weighted[6] * row;
  }

  const Floats s[7] = {s0, s1, s2, s3, s4, s5, s6};
  std::memcpy(sums.s, s, sizeof s);
  sums.cost = cost;
}

}  // namespace

std::vector<float> photometric_residuals(const PhotometricFamily& family, const Rigid3& camera_from_world) {
  const auto gain = static_cast<float>(family.gain), per_sigma = static_cast<float>(1.0 / family.sigma);
  std::vector<float> result(family.terms.size());
  for_blocks(family, camera_from_world, [&](std::size_t first, std::size_t count, const float* seen) {
    for (std::size_t i = 0; i < count; ++i) {
      const PhotometricTerm& term = family.terms[first + i];
      result[first + i] = (seen[i] - gain * term.value) * term.weight * per_sigma;
    }
  });
  return result;
}

PhotometricSums sum_photometric(const PhotometricFamily& family, const Rigid3& camera_from_world,
                                double loss) {
  const Scale scale{static_cast<float>(family.gain), static_cast<float>(1.0 / family.sigma),
                    static_cast<float>(loss)};
  PhotometricSums sums;

  // Blocks are added in double precision
  for_blocks(family, camera_from_world, [&](std::size_t first, std::size_t count, const float* seen) {
    Sums block;
    sum_block(family.terms.data() + first, seen, count, scale, block);
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b <= a; ++b) sums.h(a, b) += static_cast<double>(block.s[a][b]);
      sums.g(a) += static_cast<double>(block.s[a][6]);
    }
    sums.cost += static_cast<double>(block.cost);
  });

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
  double vv = 0.0, ss = 0.0, vs = 0.0;
  int count = 0;

  // Only terms that the image shows
  for_blocks(family, camera_from_world, [&](std::size_t first, std::size_t block, const float* seen) {
    for (std::size_t i = 0; i < block; ++i) {
      if (std::isnan(seen[i])) continue;
      const auto s = static_cast<double>(seen[i]), v = static_cast<double>(family.terms[first + i].value);
      vv += v * v;
      ss += s * s;
      vs += v * s;
      ++count;
    }
  });
  return count < min_terms || !(vv > 0.0) || !(ss > 0.0) ? 0.0 : vs / std::sqrt(vv * ss);
}

}  // namespace plumbline::optimize
