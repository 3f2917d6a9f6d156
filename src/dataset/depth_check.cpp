// SPDX-License-Identifier: BSD-3-Clause
#include "depth_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "depth_statistics.hpp"
#include "plumbline/dataset/summary.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::size_t kDepthSamples = 5;
// Structured light and time of flight measure hardly anything beyond. If millimetres are read in TUM's unit
// the median of a desk is still that of a room (1.3 m for 6.3 m), but its background is far outside.
constexpr double kSensorReach_m = 10.0;
constexpr double kMaxShareBeyondReach = 0.1;
constexpr double kMaxShareTooNear = 0.05;
constexpr double kLeastMedian_m = 0.07;
constexpr double kMostMedian_m = 40.0;
// Steps of 1 / z, 1/m: an eighth of a pixel of a Kinect is 0.0029, a thirty-second of a RealSense's 0.0008.
constexpr double kFinestStep = 0.0005;
constexpr double kCoarsestStep = 0.007;
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

  // All frames only if the samples have no depth
  for (const std::size_t i : spread(source.size(), kDepthSamples)) add(i);
  for (std::size_t i = 0; i < source.size() && !statistics.median(); ++i) add(i);
  if (statistics.median()) return statistics;

  // Unreadable and empty images have different remedies
  if (!readable) {
    return core::input_error(fmt::format("{}: none of the {} pairs can be read; the first: {}", folder,
                                         source.size(), first_error));
  }

  return core::input_error(fmt::format(
      "{}: the depth images hold no measurement at all (raw 0 and 65535 are not measurements)", folder));
}

/// Distance that a camera needs, by its name; files in units of 0.1 mm are those of cameras for close work.
double nearest_of(const sensor::Camera& camera) {
  constexpr double kCloseWork = 10000.0;
  constexpr std::pair<const char*, double> kNearest[] = {{"kinect", 0.35}, {"tum_fr", 0.35}, {"xtion", 0.35},
                                                         {"d405", 0.06},   {"d435", 0.15},   {"d455", 0.3}};
  for (const auto& [name, metres] : kNearest) {
    if (camera.name.find(name) != std::string::npos) return metres;
  }
  return camera.depth_scale >= kCloseWork ? 0.04 : 0.2;
}

}  // namespace

core::Result<ScaleCheck> check_depth_scale(const FrameSource& source, const std::string& folder) {
  const auto depth = sample_depth(source, folder);
  if (!depth) return tl::unexpected(depth.error());
  const double median = *depth->median();
  const double scale = source.camera().depth_scale;
  const double fit = fitting_depth_scale(median * scale);
  const std::string what =
      fmt::format("{}: with depth_scale {} the median depth is {:.4g} m", folder, scale, median);

  // A scale that fits is the likely remedy
  const std::string remedy =
      fit == scale ? std::string("; correct the camera file")
                   : fmt::format("; depth_scale {} would fit (median {:.2g} m); correct the camera file", fit,
                                 median * scale / fit);

  // No camera measures such a median
  if (median < kLeastMedian_m || median > kMostMedian_m) return core::input_error(what + remedy);

  // One sign may be due to the scene
  std::string signs;
  int count = 0;
  const auto add = [&](const std::string& sign) { signs += (count++ > 0 ? ", " : "") + sign; };
  if (const double beyond = depth->share_beyond(kSensorReach_m); beyond > kMaxShareBeyondReach)
    add(fmt::format("{:.0f} % of the depth is beyond the {} m that depth cameras reach", 100.0 * beyond,
                    kSensorReach_m));

  const double nearest = nearest_of(source.camera());
  if (const double nearer = 1.0 - depth->share_beyond(nearest); nearer > kMaxShareTooNear)
    add(fmt::format("{:.0f} % is nearer than the {} m that they need", 100.0 * nearer, nearest));

  // Steps of disparity grow with the square of depth
  if (const auto step = depth->disparity_step(scale); step && (*step < kFinestStep || *step > kCoarsestStep))
    add(fmt::format("its steps ({:.2g} z^2) are those of no camera's disparity", *step));

  if (count == 0) return ScaleCheck{};
  return ScaleCheck{what + "; " + signs + remedy + " unless the scene is like that", count > 1};
}

core::Result<void> check_focal_lengths(const sensor::Camera& camera, const std::string& folder) {
  const sensor::Pinhole& c = camera.color;
  const std::string lengths =
      fmt::format("{}: the camera has fx {:.6g} and fy {:.6g} px", folder, c.fx, c.fy);
  if (std::max(c.fx, c.fy) > kMostOblong * std::min(c.fx, c.fy)) {
    return core::input_error(lengths + ", but pixels are nearly square; correct the camera file");
  }

  // The field of view must be plausible
  const double angle_deg = 2.0 * std::atan(0.5 * std::max(c.width / c.fx, c.height / c.fy)) * 180.0 / M_PI;
  if (angle_deg >= kLeastView_deg && angle_deg <= kMostView_deg) return {};
  return core::input_error(
      fmt::format("{}; it would see {:.2g} degrees; correct the camera file", lengths, angle_deg));
}

}  // namespace plumbline::dataset
