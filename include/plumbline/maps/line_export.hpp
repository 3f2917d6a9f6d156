// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// 3D line landmarks as a file that mesh viewers open.
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::maps {

using LineSegment3 = std::pair<Eigen::Vector3d, Eigen::Vector3d>;  ///< endpoints, metres

class Map;

/// Line landmarks that at least `min_observations` keyframes see, in the world frame, by id.
std::vector<LineSegment3> line_segments(const Map& map, std::size_t min_observations = 2);

/// Binary PLY with two coloured vertices and one coloured edge per segment (MeshLab, CloudCompare and
/// Open3D's LineSet read it). `colors`: red, green, blue, one per segment, or empty for dark blue. Segments
/// that are not finite are left out. `comments`: further lines of the header. Errors (kOutput); kInternal
/// when the numbers of colours and segments differ.
core::Result<void> write_lines_ply(const std::filesystem::path& file,
                                   const std::vector<LineSegment3>& segments,
                                   const std::vector<std::array<std::uint8_t, 3>>& colors = {},
                                   const std::vector<std::string>& comments = {});

}  // namespace plumbline::maps
