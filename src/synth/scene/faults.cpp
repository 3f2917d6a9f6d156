// SPDX-License-Identifier: BSD-3-Clause
#include "scene/faults.hpp"

#include "scene/settings.hpp"

namespace plumbline::synth {

namespace {

/// Reads "ideal" or "usual" and what follows; `text` is left with the settings.
bool is_ideal(std::string& text) {
  const auto comma = text.find(',');
  const std::string first = text.substr(0, comma);
  if (first != "ideal" && first != "usual") return false;
  text = comma == std::string::npos ? "" : text.substr(comma + 1);
  return first == "ideal";
}

}  // namespace

bool DepthFaults::any() const {
  return offset != 0.0 || scale != 0.0 || radial != 0.0 || drift != 0.0 || ray != 0.0 || holes > 0.0 ||
         multipath > 0.0 || flying > 0.0 || stripes > 0.0 || mirrors > 0.0;
}

core::Result<DepthFaults> depth_faults(const std::string& text) {
  DepthFaults f;
  const core::Range<double> share{-0.3, 0.3}, some{0.0, 1.0};
  const auto read = read_settings("depth_faults", text,
                                  {{"offset", &f.offset, {-0.2, 0.2}, "", 0.01},
                                   {"scale", &f.scale, share, "ratio", 0.01},
                                   {"radial", &f.radial, share, "ratio", 0.01},
                                   {"drift", &f.drift, share, "ratio", 0.005},
                                   {"ray", &f.ray, some, "", 1.0},
                                   {"holes", &f.holes, some, "", 0.2},
                                   {"multipath", &f.multipath, {0.0, 0.5}, "m", 0.04},
                                   {"flying", &f.flying, some, "ratio", 0.3},
                                   {"stripes", &f.stripes, some, "ratio", 0.005},
                                   {"mirrors", &f.mirrors, some, "", 0.55}});
  if (!read) return tl::unexpected<core::Error>(read.error());
  return f;
}

core::Result<ColorFaults> color_faults(const std::string& text) {
  ColorFaults f;
  const core::Range<double> some{0.0, 1.0};
  const auto read = read_settings("color_faults", text,
                                  {{"hunting", &f.hunting, some, "", 0.3},
                                   {"jumps", &f.jumps, some, "", 0.5},
                                   {"flicker", &f.flicker, {1.0, 1000.0}, "Hz", 100.0},
                                   {"motion_blur", &f.motion_blur, {0.0, 0.1}, "s", 0.01},
                                   {"dots", &f.dots, some, "", 0.3},
                                   {"specks", &f.specks, some, "", 0.5}});
  if (!read) return tl::unexpected<core::Error>(read.error());
  return f;
}

core::Result<ImuModel> imu_model(const std::string& given) {
  std::string text = given;
  ImuModel m;

  // Ideal sensors have no errors.
  if (is_ideal(text)) m = {200.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  const core::Range<double> some{0.0, 10.0};

  const auto read = read_settings("imu", text,
                                  {{"rate", &m.rate, {10.0, 2000.0}, "Hz"},
                                   {"gyro_noise", &m.gyro_noise, some, ""},
                                   {"gyro_bias", &m.gyro_bias, some, "rad/s"},
                                   {"gyro_walk", &m.gyro_walk, some, ""},
                                   {"accel_noise", &m.accel_noise, some, ""},
                                   {"accel_bias", &m.accel_bias, some, ""},
                                   {"accel_walk", &m.accel_walk, some, ""},
                                   {"scale", &m.scale, {0.0, 0.3}, "ratio"},
                                   {"misalign", &m.misalign, {0.0, 0.3}, "rad"},
                                   {"delay", &m.delay, {-0.5, 0.5}, "s"},
                                   {"gaps", &m.gaps, {0.0, 1000.0}, ""}});

  if (!read) return tl::unexpected<core::Error>(read.error());
  return m;
}

core::Result<OdometryModel> odometry_model(const std::string& given) {
  std::string text = given;
  OdometryModel m;

  // Ideal wheels have no errors.
  if (is_ideal(text)) m = {50.0, 0, 0, 0, 0};
  const core::Range<double> share{0.0, 0.5};
  const auto read = read_settings("odometry", text,
                                  {{"rate", &m.rate, {1.0, 1000.0}, "Hz"},
                                   {"scale", &m.scale, share, "ratio"},
                                   {"turn", &m.turn, share, "ratio"},
                                   {"noise", &m.noise, share, "ratio"},
                                   {"slip", &m.slip, {0.0, 1000.0}, ""}});
  if (!read) return tl::unexpected<core::Error>(read.error());
  return m;
}

}  // namespace plumbline::synth
