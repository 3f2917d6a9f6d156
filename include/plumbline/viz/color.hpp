// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Colours that pictures and charts share.
#include <cstddef>
#include <cstdint>

namespace plumbline::viz {

/// sRGB, 8 bits a channel.
struct Rgb {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;
};
inline bool operator==(const Rgb& a, const Rgb& b) { return a.r == b.r && a.g == b.g && a.b == b.b; }
inline bool operator!=(const Rgb& a, const Rgb& b) { return !(a == b); }

/// Colour of the i-th robot, path or series: eight colours that stay apart for colour-blind eyes too,
/// dark enough for white ground (after Okabe and Ito 2008), then repeated.
Rgb category_color(std::size_t index);

/// Perceptually even map from dark blue over green to yellow (viridis), s in [0, 1] (clamped; NaN is grey).
Rgb sequential_color(double s);

}  // namespace plumbline::viz
