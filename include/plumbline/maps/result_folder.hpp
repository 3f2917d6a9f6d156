// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A finished result folder, read back for pictures, exports and questions.
#include <filesystem>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/maps/line_export.hpp"

namespace plumbline::maps {

/// The folder's files, whether they are there or not.
struct ResultFolder {
  std::filesystem::path folder;
  [[nodiscard]] std::filesystem::path ply() const { return folder / "map.ply"; }
  [[nodiscard]] std::filesystem::path pcd() const { return folder / "map.pcd"; }
  /// Folders of trajectory.txt and keyframes.txt: one per robot, by name, or the folder itself for a single
  /// robot.
  [[nodiscard]] std::vector<std::filesystem::path> robot_folders() const;
  [[nodiscard]] std::filesystem::path trajectory() const { return folder / "trajectory.txt"; }
  [[nodiscard]] std::filesystem::path keyframes() const { return folder / "keyframes.txt"; }
  [[nodiscard]] std::filesystem::path lines() const { return folder / "lines.ply"; }
  [[nodiscard]] std::filesystem::path summary() const { return folder / "summary.json"; }
};

/// Errors (kInput): no such folder, or not a result.
core::Result<ResultFolder> open_result(const std::filesystem::path& folder);

/// The frame of all that the folder holds, as its summary.json says; nothing if that cannot be read.
cloud::CloudFrame frame_of_result(const ResultFolder& result);

/// The frame of a cloud's file: `said`, as its header has it, or else that of the result folder whose map it
/// is (map.ply, map.pcd, levels/map_10mm.ply, components/NAME/map.ply).
cloud::CloudFrame frame_of_cloud(const std::filesystem::path& file, const cloud::CloudFrame& said);

/// map.ply, or map.pcd if the pipeline wrote no PLY; with its frame.
core::Result<cloud::CloudFile> read_result_cloud(const ResultFolder& result);

/// Segments of lines.ply.
core::Result<std::vector<LineSegment3>> read_lines_ply(const std::filesystem::path& file);

/// A path as a PLY of vertices and edges.
core::Result<void> write_trajectory_ply(const std::filesystem::path& file,
                                        const geometry::Trajectory& trajectory);

}  // namespace plumbline::maps
