// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/summary.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "depth_statistics.hpp"
#include "plumbline/core/numbers.hpp"

namespace plumbline::dataset {
namespace {

void describe_time(const FrameSource& source, RecordingSummary& summary) {
  if (source.size() < 2) return;
  summary.duration_s = source.info(source.size() - 1).stamp - source.info(0).stamp;
  std::vector<double> steps;
  for (std::size_t i = 1; i < source.size(); ++i)
    steps.push_back(source.info(i).stamp - source.info(i - 1).stamp);
  summary.longest_gap_s = *std::max_element(steps.begin(), steps.end());
  const double usual = core::median(std::move(steps));
  if (usual > 0.0) summary.fps = 1.0 / usual;
}

}  // namespace

std::vector<std::size_t> spread(std::size_t count, std::size_t samples) {
  std::vector<std::size_t> positions;
  samples = std::min(count, samples);
  for (std::size_t i = 0; i < samples; ++i) {
    positions.push_back(samples == 1 ? 0 : i * (count - 1) / (samples - 1));
  }
  return positions;
}

RecordingSummary describe(const FrameSource& source, std::size_t samples) {
  const sensor::Camera& camera = source.camera();
  RecordingSummary summary;
  summary.name = source.name();
  summary.format = source.format();
  summary.camera = camera.name;
  summary.width = camera.color.width;
  summary.height = camera.color.height;
  summary.distorted = camera.distorted();
  summary.registers_depth = camera.color_from_depth.has_value();
  summary.depth_scale = camera.depth_scale;
  summary.pairs = source.size();
  describe_time(source, summary);

  DepthStatistics statistics;
  for (const std::size_t i : spread(source.size(), samples)) {
    ++summary.sampled;
    if (const auto frame = source.read(i)) {
      statistics.add(frame->depth);
    } else {
      ++summary.unreadable;
    }
  }
  summary.median_depth_m = statistics.median().value_or(0.0);
  summary.missing_depth_share = statistics.missing_share();
  summary.has_truth = source.truth().has_value();
  return summary;
}

std::string to_text(const RecordingSummary& s) {
  std::string text = fmt::format("recording: {} ({})\n", s.name, s.format);
  text += fmt::format("pairs: {}\n", s.pairs);
  text += fmt::format("duration: {:.2f} s, {:.1f} pairs a second, longest gap {:.3f} s\n", s.duration_s,
                      s.fps, s.longest_gap_s);
  text += fmt::format("camera: {}, {}x{}, {}, depth {}, depth_scale {}\n", s.camera, s.width, s.height,
                      s.distorted ? "undistorted while reading" : "no distortion",
                      s.registers_depth ? "registered while reading" : "registered to colour", s.depth_scale);
  if (s.median_depth_m > 0.0) {
    text += fmt::format(
        "depth: median {:.2f} m, {:.0f} % of the pixels without measurement ({} frames sampled)\n",
        s.median_depth_m, 100.0 * s.missing_depth_share, s.sampled - s.unreadable);
  } else {
    text += fmt::format("depth: none in {} sampled frames\n", s.sampled - s.unreadable);
  }
  if (s.unreadable > 0) text += fmt::format("unreadable: {} of {} sampled frames\n", s.unreadable, s.sampled);
  text += fmt::format("truth: {}\n", s.has_truth ? "yes" : "no");
  return text;
}

}  // namespace plumbline::dataset
