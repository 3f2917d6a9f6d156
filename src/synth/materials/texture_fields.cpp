// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <vector>

#include "materials/texture_draw.hpp"
#include "scene/random.hpp"

namespace plumbline::synth {

/// Sum of octaves of smooth noise on lattices that wrap round; `cx`, `cy` cells over the whole image at the
/// lowest one.
cv::Mat1f fractal(cv::Size size, int cx, int cy, int octaves, float falloff, std::uint64_t seed) {
  cv::Mat1f out(size, 0.0F);
  float gain = 1.0F, sum = 0.0F;
  std::vector<float> lattice;
  std::vector<int> cell(static_cast<std::size_t>(size.width));
  std::vector<float> ease(static_cast<std::size_t>(size.width));
  for (int o = 0; o < octaves; ++o) {
    const int px = cx << o, py = cy << o;
    if (px > size.width && py > size.height) break;

    // Random values at the lattice's nodes.
    const std::uint64_t key = mix(seed + static_cast<std::uint64_t>(o));
    lattice.resize(static_cast<std::size_t>(px) * static_cast<std::size_t>(py));
    for (std::size_t i = 0; i < lattice.size(); ++i) {
      lattice[i] = gain * (static_cast<float>(mix(key ^ i) >> 40U) * 0x1.0p-23F - 1.0F);
    }

    // Cell and weight of each column.
    const auto smooth = [](float t) { return t * t * (3.0F - 2.0F * t); };
    for (int x = 0; x < size.width; ++x) {
      const float u = static_cast<float>(x) * static_cast<float>(px) / static_cast<float>(size.width);
      cell[static_cast<std::size_t>(x)] = std::min(px - 1, static_cast<int>(u));
      ease[static_cast<std::size_t>(x)] = smooth(u - std::floor(u));
    }

    // Interpolation with smooth weights.
    for (int y = 0; y < size.height; ++y) {
      const float v = static_cast<float>(y) * static_cast<float>(py) / static_cast<float>(size.height);
      const int iy = std::min(py - 1, static_cast<int>(v));
      const float sy = smooth(v - std::floor(v));
      const float* top = lattice.data() + static_cast<std::size_t>(iy) * static_cast<std::size_t>(px);
      const float* low =
          lattice.data() + static_cast<std::size_t>((iy + 1) % py) * static_cast<std::size_t>(px);

      float* row = out[y];
      for (int x = 0; x < size.width; ++x) {
        const int i = cell[static_cast<std::size_t>(x)], k = i + 1 == px ? 0 : i + 1;
        const float sx = ease[static_cast<std::size_t>(x)];
        const float a = top[i] + sx * (top[k] - top[i]), b = low[i] + sx * (low[k] - low[i]);
        row[x] += a + sy * (b - a);
      }
    }

    // Variances of octaves add up.
    sum += gain * gain;
    gain *= falloff;
  }

  out *= static_cast<double>(1.6F / std::sqrt(sum));
  return out;
}

cv::Mat1f grain(cv::Size size, std::uint64_t seed) {
  cv::Mat1f out(size);
  std::uint64_t i = 0;
  for (float& v : out) v = static_cast<float>(mix(seed, i++) >> 40U) * 0x1.0p-23F - 1.0F;
  return out;
}

cv::Vec3f tone(const Material& m) { return {m.blue, m.green, m.red}; }
cv::Scalar scalar(const cv::Vec3f& v) { return {v[0], v[1], v[2]}; }

void modulate(Canvas& canvas, const cv::Mat1f& field, float amount) {
  for (int y = 0; y < canvas.rows; ++y) {
    for (int x = 0; x < canvas.cols; ++x) canvas(y, x) *= 1.0F + amount * field(y, x);
  }
}

}  // namespace plumbline::synth
