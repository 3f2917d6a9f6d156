// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "depth_statistics.hpp"
#include "plumbline/core/numbers.hpp"

namespace plumbline::dataset {

/// Positions spread evenly, with the first and the last.
std::vector<std::size_t> spread(std::size_t count, std::size_t samples) {
  std::vector<std::size_t> positions;
  samples = std::min(count, samples);
  for (std::size_t i = 0; i < samples; ++i) {
    positions.push_back(samples == 1 ? 0 : i * (count - 1) / (samples - 1));
  }
  return positions;
}

std::string to_text(const FrameSource& source) {
  constexpr std::size_t kSamples = 5;
  const sensor::Camera& camera = source.camera();
  std::string text = fmt::format("recording: {} ({})\n", source.name(), source.format());
  if (source.missing() > 0)
    text += fmt::format("missing: {} pairs, whose files do not exist\n", source.missing());
  text += fmt::format("pairs: {}\n", source.size());

  // A median step, because gaps are not usual
  std::vector<double> steps;
  for (std::size_t i = 1; i < source.size(); ++i)
    steps.push_back(source.info(i).stamp - source.info(i - 1).stamp);

  const double duration_s = std::accumulate(steps.begin(), steps.end(), 0.0);
  const double longest_s = steps.empty() ? 0.0 : *std::max_element(steps.begin(), steps.end());
  const double usual_s = steps.empty() ? 0.0 : core::median(std::move(steps));
  text += fmt::format("duration: {:.2f} s, {:.1f} pairs a second, longest gap {:.3f} s\n", duration_s,
                      usual_s > 0.0 ? 1.0 / usual_s : 0.0, longest_s);
  text += fmt::format(
      "camera: {}, {}x{}, fx {:g} fy {:g} cx {:g} cy {:g}, {}, depth {}, depth_scale {}\n", camera.name,
      camera.color.width, camera.color.height, camera.color.fx, camera.color.fy, camera.color.cx,
      camera.color.cy, camera.distorted() ? "undistorted while reading" : "no distortion",
      camera.color_from_depth ? "registered while reading" : "registered to colour", camera.depth_scale);

  // A few frames tell the quality of depth
  DepthStatistics statistics;
  std::size_t read = 0;
  const std::vector<std::size_t> sampled = spread(source.size(), kSamples);
  for (const std::size_t i : sampled) {
    const auto frame = source.read(i);
    if (!frame) continue;
    statistics.add(frame->depth);
    ++read;
  }

  if (const double median_m = statistics.median().value_or(0.0); median_m > 0.0) {
    text += fmt::format(
        "depth: median {:.2f} m, {:.0f} % of the pixels without measurement ({} frames sampled)\n", median_m,
        100.0 * statistics.missing_share(), read);
  } else {
    text += fmt::format("depth: none in {} sampled frames\n", read);
  }

  // Unreadable frames among the samples
  if (read < sampled.size())
    text += fmt::format("unreadable: {} of {} sampled frames\n", sampled.size() - read, sampled.size());
  const auto truth = source.truth();
  if (!truth) return text + "truth: no\n";

  return text + (source.truth_is_odometry()
                     ? fmt::format("poses: {} of the recorder's own odometry\n", truth->size())
                     : std::string("truth: yes\n"));
}

}  // namespace plumbline::dataset
