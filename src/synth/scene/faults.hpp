// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Faults of cameras and other sensors, as options name them.
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
  double specks = 0.0;       ///< share of light that specks on the lens take
};

/// Errors (kUsage) name the key.
core::Result<ColorFaults> color_faults(const std::string& text);

/// Errors of an inertial sensor; densities are those of data sheets.
struct ImuModel {
  double rate = 200.0;          ///< Hz
  double gyro_noise = 2.4e-4;   ///< rad/s per square root of Hz
  double gyro_bias = 5e-3;      ///< rad/s, standard deviation of each axis
  double gyro_walk = 2e-5;      ///< rad/s^2 per square root of Hz
  double accel_noise = 1.5e-3;  ///< m/s^2 per square root of Hz
  double accel_bias = 0.1;      ///< m/s^2
  double accel_walk = 3e-4;     ///< m/s^3 per square root of Hz
  double scale = 0.005;         ///< standard deviation of each axis' scale
  double misalign = 0.005;      ///< rad, of each axis' direction
  double delay = 0.003;         ///< s that stamps are late
  double gaps = 2.0;            ///< a minute, of 50 ms without readings
};

/// Errors of wheels; the robot moves in a plane and, at will, sideways.
struct OdometryModel {
  double rate = 50.0;   ///< Hz
  double scale = 0.01;  ///< share of distances, standard deviation
  double turn = 0.015;  ///< share of turns
  double noise = 0.03;  ///< share of the speed, new in each reading
  double slip = 4.0;    ///< a minute, of 0.3 s in which wheels turn half as much again
};

/// "ideal" or "usual", then settings of it: "usual,delay=5ms". Errors (kUsage) name the key.
core::Result<ImuModel> imu_model(const std::string& text);
core::Result<OdometryModel> odometry_model(const std::string& text);

}  // namespace plumbline::synth
