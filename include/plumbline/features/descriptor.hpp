// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// 256-bit binary descriptors (ORB for points, LBD for lines), compared by Hamming distance.
#include <array>
#include <cstddef>
#include <cstdint>

namespace plumbline::features {

using Descriptor256 = std::array<std::uint64_t, 4>;

/// Number of differing bits, 0..256.
int hamming_distance(const Descriptor256& a, const Descriptor256& b);

/// Distances from `query` to each of `count` descriptors.
void hamming_distances(const Descriptor256& query, const Descriptor256* others, std::size_t count,
                       int* distances);

}  // namespace plumbline::features
