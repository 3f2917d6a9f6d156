// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/line_export.hpp"

#include "plumbline/cloud/io/ply.hpp"
#include "plumbline/maps/map.hpp"

namespace plumbline::maps {

/// Line landmarks that enough keyframes have confirmed.
std::vector<LineSegment3> line_segments(const Map& map, std::size_t min_observations) {
  std::vector<LineSegment3> result;
  for (const core::LineId id : map.line_ids()) {
    const MapLine& line = map.line(id);
    if (line.observations.size() >= min_observations) result.emplace_back(line.start, line.end);
  }
  return result;
}

core::Result<void> write_lines_ply(const std::filesystem::path& file,
                                   const std::vector<LineSegment3>& segments,
                                   const std::vector<std::array<std::uint8_t, 3>>& colors,
                                   const std::vector<std::string>& comments) {
  // One colour per line, or none
  if (!colors.empty() && colors.size() != segments.size()) {
    return core::failure(core::ErrorKind::kInternal, file.string() + ": as many colours as lines are needed");
  }

  // Each line is two vertices and an edge
  constexpr std::array<std::uint8_t, 3> kBlue{20, 60, 140};
  std::array<std::vector<float>, 3> position;
  std::array<std::vector<std::uint8_t>, 3> color;
  cloud::PlyData ply;
  ply.comments = {"plumbline, line landmarks, metres"};
  ply.comments.insert(ply.comments.end(), comments.begin(), comments.end());

  // Infinite ends would spoil a viewer's bounds
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const auto& [start, end] = segments[i];
    if (!start.allFinite() || !end.allFinite()) continue;

    // Both ends have the line's colour
    const auto& rgb = colors.empty() ? kBlue : colors[i];
    const auto first = static_cast<std::uint32_t>(position[0].size());
    for (const Eigen::Vector3d& point : {start, end}) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        position[axis].push_back(static_cast<float>(point[static_cast<Eigen::Index>(axis)]));
        color[axis].push_back(rgb[axis]);
      }
    }

    // An edge joins the two vertices
    ply.edges.push_back({first, first + 1});
    ply.edge_colors.push_back(rgb);
  }

  // Columns in the order that viewers expect
  const std::array<const char*, 3> axes{"x", "y", "z"};
  const std::array<const char*, 3> channels{"red", "green", "blue"};
  for (std::size_t axis = 0; axis < 3; ++axis) ply.add(axes[axis], std::move(position[axis]));
  for (std::size_t axis = 0; axis < 3; ++axis) ply.add(channels[axis], std::move(color[axis]));
  return cloud::write_ply(file, ply);
}

}  // namespace plumbline::maps
