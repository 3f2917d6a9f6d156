// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A keyframe's cloud as few bytes, for stores and networks: 5 to 7 bytes a point instead of 48.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/core/error.hpp"

namespace plumbline::cloud {

/// Versioned bytes that decode_cloud() reads on any machine of the same byte order. Kept: positions (to an
/// eighth of a millimetre a coordinate, far below sensor noise; up to 268 km from the origin), colours
/// exactly, normals to about half a degree (octahedral map, 2 bytes; Meyer et al. 2010), unknown normals as
/// unknown. The sensor pose is kept, curvature is not. An organised cloud whose columns and rows lie on rays
/// (any depth camera without distortion) stays organised, and only its depth is rounded: points stay on their
/// rays. Any other cloud becomes a list of its finite points, in order. Same cloud, same bytes.
std::vector<std::uint8_t> encode_cloud(const Cloud& cloud);

/// Errors (kInput): not such bytes, a version this program does not know, truncated, damaged (checksum).
/// Memory is taken only for what the bytes can hold.
core::Result<CloudPtr> decode_cloud(const std::uint8_t* bytes, std::size_t size);

}  // namespace plumbline::cloud
