// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What the writer and the reader of compact clouds share.
#include <array>
#include <cstddef>
#include <cstdint>

namespace plumbline::cloud {

inline constexpr std::array<std::uint8_t, 5> kCompactMagic{'P', 'L', 'C', 'C', 1};

struct CompactHead {
  std::uint32_t width = 0;   ///< of a grid; of a list the number of points
  std::uint32_t height = 0;  ///< of a grid; 0: a list
  double step_m = 0.0;
};
static_assert(sizeof(CompactHead) == 16);

}  // namespace plumbline::cloud
