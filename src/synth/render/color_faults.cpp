// SPDX-License-Identifier: BSD-3-Clause
#include "render/color_faults.hpp"

#include <cmath>

#include "scene/random.hpp"

namespace plumbline::synth {

float faulty_gain(const ColorFaults& faults, double t, double row_t, std::uint64_t seed) {
  double log_gain = faults.hunting * std::sin(2.0 * M_PI * 0.7 * t);
  if (faults.jumps > 0.0)
    log_gain +=
        faults.jumps * Rng(seed, 0x3e + static_cast<std::uint64_t>(std::floor(t / 2.0))).uniform(-1.0, 1.0);
  if (faults.flicker == 0.0) return static_cast<float>(std::exp(log_gain));

  // The mean of the lamp's light over the exposure; pictures are square roots of light.
  const double exposure = faults.motion_blur > 0.0 ? faults.motion_blur : 0.004;
  const double half = M_PI * faults.flicker * exposure;
  const double light = 1.0 + 0.5 * std::sin(half) / half * std::cos(2.0 * M_PI * faults.flicker * row_t);
  return static_cast<float>(std::exp(log_gain) * std::sqrt(light));
}

LensMarks::LensMarks(const ColorFaults& faults, const cv::Size& size, std::uint64_t seed) {
  Rng rng(seed, 0x5bec);
  const double unit = size.width / 640.0;

  // Dust darkens soft spots.
  if (faults.specks > 0.0) {
    light_ = cv::Mat1f(size, 1.0F);
    for (int i = 0; i < 12; ++i) {
      const double cx = rng.uniform(0.0, size.width), cy = rng.uniform(0.0, size.height);
      const double radius = unit * rng.uniform(8.0, 40.0);

      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          const double far = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (radius * radius);
          light_(y, x) *= static_cast<float>(1.0 - faults.specks * std::exp(-far * far));
        }
      }
    }
  }

  // One bright dot in each cell of a grid.
  if (faults.dots > 0.0) {
    dots_ = cv::Mat1f::zeros(size);
    const double pitch = std::max(4.0, 14.0 * unit);
    for (double top = 0.0; top < size.height; top += pitch) {
      for (double left = 0.0; left < size.width; left += pitch) {
        const int x = static_cast<int>(left + rng.uniform(0.0, pitch)),
                  y = static_cast<int>(top + rng.uniform(0.0, pitch));

        // Dots past the border are left out.
        if (x >= size.width || y >= size.height) continue;
        dots_(y, x) = static_cast<float>(255.0 * faults.dots);
        if (x + 1 < size.width) dots_(y, x + 1) = static_cast<float>(150.0 * faults.dots);
      }
    }
  }
}

void LensMarks::apply(cv::Mat3b& image) const {
  if (light_.empty() && dots_.empty()) return;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const float light = light_.empty() ? 1.0F : light_(y, x), dot = dots_.empty() ? 0.0F : dots_(y, x);

      // Light is linear, pixels are its square root.
      for (int c = 0; c < 3; ++c) {
        std::uint8_t& v = image(y, x)[c];
        v = cv::saturate_cast<std::uint8_t>(static_cast<float>(v) * std::sqrt(light) + dot);
      }
    }
  }
}

}  // namespace plumbline::synth
