// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Faults of cameras, as options name them.
#include <string>

#include "plumbline/core/error.hpp"

namespace plumbline::synth {

/// SynthOptions::depth_faults; 0: none of it.
struct DepthFaults {
  double offset = 0.0;  ///< 1/m, added to 1/z
  double scale = 0.0;   ///< share of z
  double radial = 0.0;  ///< share of z in the corners, with the square of the distance from the middle
  double drift = 0.0;   ///< share of z when the camera is warm, 1 - exp(-t / 60 s) of it at t
  double ray = 0.0;     ///< 1: distance along the ray instead of z
  double holes = 0.0;   ///< cosine of incidence below which nothing is measured, nor on dark and shiny things
  double multipath = 0.0;  ///< m that surfaces are too far where others are all around within half a metre
  double flying = 0.0;     ///< share of pixels at borders that lie between the surfaces
  double stripes = 0.0;    ///< share of z, of bands of another camera's light that wander
  double mirrors = 0.0;    ///< reflectance from which a surface shows what it mirrors instead of itself

  [[nodiscard]] bool any() const;
};

/// Errors (kUsage) name the key.
core::Result<DepthFaults> depth_faults(const std::string& text);

/// SynthOptions::color_faults; 0: none of it.
struct ColorFaults {
  double hunting = 0.0;      ///< the exposure swings by this, as a logarithm, at 0.7 Hz
  double jumps = 0.0;        ///< largest jump of the exposure, as a logarithm, every two seconds
  double flicker = 0.0;      ///< Hz, of lamps whose light swings by half
  double motion_blur = 0.0;  ///< s, time of the exposure
  double dots = 0.0;         ///< brightness of an emitter's dots, of white
  double specks = 0.0;         ///< share of light that specks on the lens take
};

/// Errors (kUsage) name the key.
core::Result<ColorFaults> color_faults(const std::string& text);

}  // namespace plumbline::synth
