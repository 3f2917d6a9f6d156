// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/adjustment/observation_noise.hpp"

#include <algorithm>
#include <cmath>

#include "plumbline/features/line_depth.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {

void ObservationNoise::declare(core::OptionTable& table, const std::string& prefix) {
  table.number(prefix + "line_sigma", line_sigma_px, {0.01, 10.0}, "px",
               "Standard deviation of a line's ends across it");
  table.number(prefix + "depth_factor", depth_factor, {0.1, 100.0}, "",
               "Factor on the noise of landmarks' depth, whose errors are correlated in neighbouring views");
  table.boolean(prefix + "depth_rows", depth_rows,
                "Use the depth of corners and lines, in addition to their image positions");
  table.number(prefix + "turn_rate", turn_rate, {0.01, 1000.0}, "rad/s",
               "Turn rate of the camera at which an image's observations count for half");
}

double ObservationNoise::motion_factor_of(double rate) const {
  const double ratio = rate / turn_rate;
  return std::hypot(1.0, ratio * ratio);
}

optimize::BundlePointObservation ObservationNoise::of(const features::PointFeature& corner, bool is_aligned,
                                                      double motion_factor) const {
  optimize::BundlePointObservation seen;
  seen.pixel = corner.pixel.cast<double>();
  seen.pixel_sigma = motion_factor * std::pow(orb_scale_factor, corner.octave) * (is_aligned ? aligned : 1.0);
  if (!depth_rows) return seen;

  seen.depth = static_cast<double>(corner.depth);
  seen.depth_sigma =
      corner.depth > 0.0F ? depth_factor * motion_factor * sensor::depth_sigma(seen.depth) : 1.0;
  return seen;
}

optimize::BundleLineObservation ObservationNoise::of(const features::LineFeature& line,
                                                     double motion_factor) const {
  constexpr double kLeast_m = 0.003;  // smallest standard deviation of an end's depth

  optimize::BundleLineObservation seen;
  seen.start = line.segment.start.cast<double>();
  seen.end = line.segment.end.cast<double>();
  seen.pixel_sigma = line_sigma_px * motion_factor;
  if (!line.line3 || !depth_rows) return seen;

  // The lower limit bounds the weight of lines near the camera, where the depth noise alone is very small.
  const auto sigma = [&](const Eigen::Vector3d& end, const features::EndpointNoise& noise) {
    return depth_factor * motion_factor * std::max(kLeast_m, features::endpoint_sigma(end, noise));
  };

  seen.has_depth = true;
  seen.start_camera = line.line3->start;
  seen.end_camera = line.line3->end;
  seen.start_sigma = sigma(line.line3->start, line.line3->start_noise);
  seen.end_sigma = sigma(line.line3->end, line.line3->end_noise);
  return seen;
}

}  // namespace plumbline::mapping
