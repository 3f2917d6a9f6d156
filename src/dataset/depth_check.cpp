// SPDX-License-Identifier: BSD-3-Clause
#include "depth_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "depth_statistics.hpp"
#include "plumbline/dataset/summary.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::size_t kDepthSamples = 5;
// Structured light and time of flight measure hardly anything beyond. If millimetres are read in TUM's unit
// the median of a desk is still that of a room (1.3 m for 6.3 m), but its background lies far outside.
constexpr double kSensorReach_m = 10.0;
constexpr double kMaxShareBeyondReach = 0.1;
// Depth cameras see from 40 to 120 degrees; parts of their images may be mapped, too.
constexpr double kLeastView_deg = 8.0;
constexpr double kMostView_deg = 160.0;
constexpr double kMostOblong = 2.0;  // of a pixel

/// Depth of a few frames, or of the first readable frame with depth if none of those can be used. Never
/// without a measurement.
core::Result<DepthStatistics> sample_depth(const FrameSource& source, const std::string& folder) {
  DepthStatistics statistics;
  bool readable = false;
  std::string first_error;

  const auto add = [&](std::size_t i) {
    if (const auto frame = source.read(i)) {
      readable = true;
      statistics.add(frame->depth);
    } else if (first_error.empty()) {
      first_error = frame.error().message;
    }
  };

  for (const std::size_t i : spread(source.size(), kDepthSamples)) add(i);
  for (std::size_t i = 0; i < source.size() && !statistics.median(); ++i) add(i);
  if (statistics.median()) return statistics;
  if (!readable) {
    return core::input_error(fmt::format("{}: none of the {} pairs can be read; the first: {}", folder,
                                         source.size(), first_error));
  }

  return core::input_error(fmt::format(
      "{}: the depth images hold no measurement at all (raw 0 and 65535 are not measurements)", folder));
}

}  // namespace

core::Result<std::string> check_depth_scale(const FrameSource& source, const std::string& folder) {
  const auto depth = sample_depth(source, folder);
  if (!depth) return tl::unexpected(depth.error());
  const auto median = depth->median();
  const double scale = source.camera().depth_scale;
  const double fit = fitting_depth_scale(*median * scale);
  const double beyond = depth->share_beyond(kSensorReach_m);
  const bool too_far = beyond > kMaxShareBeyondReach && fit > scale;
  if (*median >= 0.7 && *median <= 7.0 && !too_far) return "";
  const std::string what = fmt::format(
      "{}: with depth_scale {} the median depth is {:.4g} m; depth_scale {} would fit (median {:.2g} m)",
      folder, scale, *median, fit, *median * scale / fit);
  if (*median < 0.35 || *median > 20.0) return core::input_error(what + "; correct the camera file");
  return what + "; correct the camera file unless the scene is like that";
}

core::Result<void> check_focal_lengths(const sensor::Camera& camera, const std::string& folder) {
  const sensor::Pinhole& c = camera.color;
  const std::string lengths =
      fmt::format("{}: the camera has fx {:.6g} and fy {:.6g} px", folder, c.fx, c.fy);
  if (std::max(c.fx, c.fy) > kMostOblong * std::min(c.fx, c.fy)) {
    return core::input_error(lengths + ", but pixels are nearly square; correct the camera file");
  }

  const double angle_deg = 2.0 * std::atan(0.5 * std::max(c.width / c.fx, c.height / c.fy)) * 180.0 / M_PI;
  if (angle_deg >= kLeastView_deg && angle_deg <= kMostView_deg) return {};
  return core::input_error(
      fmt::format("{}; it would see {:.2g} degrees; correct the camera file", lengths, angle_deg));
}

}  // namespace plumbline::dataset
