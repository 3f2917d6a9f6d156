// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Values by cell of a grid.
#include <tsl/robin_map.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

namespace plumbline::cloud {

/// A cell within +-2^20 of the origin as a number; numbers are ordered by x, then y, then z.
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

/// The cell that contains a position; the position is in units of cells.
inline Eigen::Vector3i cell_of(const Eigen::Vector3d& at) { return at.array().floor().cast<int>(); }

/// Number (0-5) of the axis nearest to a normal and the direction along it.
template <typename Normal>
int facing(const Normal& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return static_cast<int>(2 * axis + (normal[axis] < 0 ? 1 : 0));
}

/// Spreads cells over a table (finaliser of MurmurHash3, public domain), eight consecutive ones together:
/// neighbouring cells are usually looked up together.
struct CellHash {
  std::size_t operator()(std::uint64_t key) const {
    std::uint64_t eight = key >> 3U;
    eight ^= eight >> 33;
    eight *= 0xff51afd7ed558ccdULL;
    eight ^= eight >> 33;
    eight *= 0xc4ceb9fe1a85ec53ULL;
    eight ^= eight >> 33;
    return static_cast<std::size_t>(eight << 3U | (key & 7U));
  }
};

/// Keyed by pack_cell(), or by numbers made from it. Its order is arbitrary: sort after iterating.
template <typename T>
using CellMap = tsl::robin_map<std::uint64_t, T, CellHash>;

}  // namespace plumbline::cloud
