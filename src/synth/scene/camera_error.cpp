// SPDX-License-Identifier: BSD-3-Clause
#include "scene/camera_error.hpp"

#include <cmath>

#include "scene/random.hpp"
#include "scene/settings.hpp"

namespace plumbline::synth {

namespace {

/// Each group is right with probability 1/2, else drawn.
CameraError draw_error(std::uint64_t seed, int robot, int width) {
  Rng rng(seed, 0xca3e + static_cast<std::uint64_t>(robot));
  CameraError e;
  const auto group = [&rng](std::initializer_list<std::pair<double*, double>> values) {
    const bool wrong = rng.chance(0.5);
    for (const auto& [value, sigma] : values) *value = rng.normal() * (wrong ? sigma : 0.0);
  };
  group({{&e.fx, 0.015}});
  group({{&e.cx, 6.0 * width / 640.0}, {&e.cy, 6.0 * width / 640.0}});
  group({{&e.k1, 0.04}, {&e.k2, 0.03}});
  group({{&e.slope, 0.015}, {&e.slope_y, 0.015}});
  group({{&e.readout, 0.015}});
  group({{&e.delay, 0.012}});
  e.readout = std::abs(e.readout);
  return e;
}

}  // namespace

core::Result<CameraError> camera_error(const std::string& text, int robot, int width) {
  // A number draws errors, a list states them.
  if (!text.empty() && text.find_first_not_of("0123456789") == std::string::npos && text.size() < 10)
    return draw_error(std::stoull(text), robot, width);

  CameraError e;
  const core::Range<double> share{-0.3, 0.3}, pixels{-1000.0, 1000.0}, lens{-1.0, 1.0}, slope{-0.2, 0.2},
      time{-0.1, 0.1};

  const auto read = read_settings("camera_error", text,
                                  {{"fx", &e.fx, share, "ratio"},
                                   {"fy", &e.fy, share, "ratio"},
                                   {"cx", &e.cx, pixels, "px"},
                                   {"cy", &e.cy, pixels, "px"},
                                   {"k1", &e.k1, lens, ""},
                                   {"k2", &e.k2, lens, ""},
                                   {"p1", &e.p1, lens, ""},
                                   {"p2", &e.p2, lens, ""},
                                   {"k3", &e.k3, lens, ""},
                                   {"slope", &e.slope, slope, ""},
                                   {"slope_y", &e.slope_y, slope, ""},
                                   {"readout", &e.readout, time, "s"},
                                   {"delay", &e.delay, time, "s"}});

  if (!read) return tl::unexpected<core::Error>(read.error());
  return e;
}

sensor::Camera CameraError::applied(const sensor::Camera& truth) const {
  sensor::Camera camera = truth;
  camera.color.fx *= 1.0 + fx;
  camera.color.fy *= (1.0 + fx) * (1.0 + fy);
  camera.color.cx += cx;
  camera.color.cy += cy;
  const double lens[] = {k1, k2, p1, p2, k3};
  for (std::size_t i = 0; i < std::size(lens); ++i) camera.distortion[i] += lens[i];
  if (camera.depth) {  // registered to colour: of the same camera
    camera.depth = camera.color.resized(camera.depth->width, camera.depth->height);
    camera.depth_lens = camera.lens();
  }
  camera.depth_slope[0] += slope;
  camera.depth_slope[1] += slope_y;
  camera.readout_s = truth.readout_s.value_or(0.0) + readout;
  camera.depth_delay_s += delay;
  return camera;
}

core::Result<sensor::Camera> told_camera(const SynthOptions& options, int robot,
                                         const sensor::Camera& truth) {
  if (options.camera_error.empty()) return truth;
  const auto error = camera_error(options.camera_error, robot, options.width);
  if (!error) return tl::unexpected<core::Error>(error.error());
  // The file must be one that can be read.
  return sensor::parse_camera(sensor::to_yaml(error->applied(truth)), "camera_error");
}

}  // namespace plumbline::synth
