// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Cells of a grid as numbers for hash tables.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

namespace plumbline::cloud {

/// Spreads neighbouring keys over a table (finaliser of MurmurHash3, public domain).
inline std::size_t mix(std::uint64_t key) {
  key ^= key >> 33;
  key *= 0xff51afd7ed558ccdULL;
  key ^= key >> 33;
  key *= 0xc4ceb9fe1a85ec53ULL;
  key ^= key >> 33;
  return static_cast<std::size_t>(key);
}

/// Cells within +-2^20 of the origin, in order of x, then y, then z.
inline std::uint64_t pack_cell(const Eigen::Vector3i& cell) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    key = key << 21U |
          (static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[axis]) + (1 << 20)) & 0x1FFFFFU);
  }
  return key;
}

inline Eigen::Vector3i unpack_cell(std::uint64_t key) {
  Eigen::Vector3i cell;
  for (int axis = 2; axis >= 0; --axis, key >>= 21U) {
    cell[axis] = static_cast<int>(key & 0x1FFFFFU) - (1 << 20);
  }
  return cell;
}

}  // namespace plumbline::cloud
