// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Disturbances that a depth sensor and a colour chip add to exact pictures. Each is a pure function of seed,
// robot, frame index and pixel.
#include <cstdint>
#include <opencv2/core.hpp>

#include "render/depth_faults.hpp"
#include "render/render.hpp"

namespace plumbline::synth {

/// Ready-made noise, drawn once per source. Tiles wrap round; a frame looks at them with its own shift.
struct NoiseTiles {
  cv::Mat1f fine;                           ///< unit variance, correlated over a pixel or two
  cv::Mat1f medium;                         ///< unit variance, correlated over some five pixels
  cv::Mat1f coarse;                         ///< unit variance, correlated over some ten pixels
  cv::Mat_<cv::Vec<std::int8_t, 3>> color;  ///< 16 = one standard deviation
};
NoiseTiles make_noise(Sensor sensor, std::uint64_t seed);

/// Identity of a frame for noise.
struct FrameKey {
  std::uint64_t seed = 0;  ///< of the source: seed and robot
  std::int64_t index = 0;
};

/// CV_16UC1 raw depth, 5000 per metre, 0 = no measurement. `view` was taken at the depth stamp.
cv::Mat1w measure_depth(const World& world, const View& view, Sensor sensor, const DepthFaults& faults,
                        const NoiseTiles& tiles, const FrameKey& key);

/// Adds colour noise in place; does nothing for Sensor::kIdeal.
void add_color_noise(cv::Mat3b& image, Sensor sensor, float gain, const NoiseTiles& tiles,
                     const FrameKey& key);

/// Smears a picture along the motion in `flow` (CV_32FC2, pixels during the exposure, at 1/8 size).
cv::Mat3b motion_blur(const cv::Mat3b& image, const cv::Mat2f& flow);

/// Range of measurements, metres.
struct DepthRange {
  double min, max;
};
DepthRange depth_range(Sensor sensor);

/// True if the sensor reliably measures a surface that `pixel` of a picture of `size` sees at depth `z`
/// (metres) and `cosine` of incidence: enough of its light comes back, and its own camera sees the spot. The
/// ideal sensor measures everything within its range.
bool measures(Sensor sensor, const Material& material, const cv::Size& size, const cv::Point2d& pixel,
              double z, double cosine);

}  // namespace plumbline::synth
