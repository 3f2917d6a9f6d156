// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Published noise and limits of depth cameras (docs/method/generated_worlds.md names the sources).
#include <algorithm>
#include <cmath>

#include "plumbline/synth/options.hpp"

namespace plumbline::synth {

/// True for the kinds that this file describes.
inline bool modelled(Sensor sensor) { return sensor >= Sensor::kTof; }

/// Standard deviation of depth, metres: z in metres, angle of incidence in radians (0: straight on), and the
/// focal length of the depth image in pixels.
inline double model_sigma(Sensor sensor, double z, double angle, double focal) {
  const double a = std::min(angle, 1.5), graze = a * a / ((M_PI_2 - a) * (M_PI_2 - a));
  switch (sensor) {
    case Sensor::kTof:
      return 1e-3 * (1.5 - 0.5 * z + 0.3 * z * z + 0.1 * std::pow(z, 1.5) * graze);
    case Sensor::kStructured:
      return 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4) + 0.0001 / std::sqrt(z) * graze;
    case Sensor::kStereo:
      return z * z * 0.08 / (focal * 0.05);
    default:
      return 0.01;
  }
}

/// Light that comes back, in parts of the least with which the sensor measures. That comes from a surface of
/// the reflectance `least`, straight on, at the end of its range.
inline double model_signal(Sensor sensor, double reflectance, double cosine, double z) {
  struct Limit {
    double least, range;
  };
  const Limit limit = sensor == Sensor::kTof          ? Limit{0.15, 5.46}
                      : sensor == Sensor::kStructured ? Limit{0.10, 5.0}
                      : sensor == Sensor::kStereo     ? Limit{0.05, 10.0}
                                                      : Limit{0.10, 5.0};
  return reflectance * cosine / limit.least * (limit.range * limit.range) / (z * z);
}

/// Standard deviation of the least signal: near it, pixels come and go.
constexpr double kSignalFlicker = 0.1;

}  // namespace plumbline::synth
