// SPDX-License-Identifier: BSD-3-Clause
#include "scene/faults.hpp"

#include "scene/settings.hpp"

namespace plumbline::synth {

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

}  // namespace plumbline::synth
