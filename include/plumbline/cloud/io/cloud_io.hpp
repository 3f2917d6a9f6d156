// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clouds on disk.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/cloud/io/frame.hpp"
#include "plumbline/cloud/types.hpp"
#include "plumbline/core/error.hpp"

namespace plumbline::cloud {

/// Optional values of every point beside the Point itself; each empty or one value per point.
struct CloudColumns {
  std::vector<float> confidence;            ///< 0-1, see VoxelMap
  std::vector<std::uint32_t> observations;  ///< views that saw the point
  std::vector<std::uint8_t> robot;          ///< number of the robot that saw the point most

  /// A column of another program, by its name in the file ("intensity").
  struct Other {
    std::string name;
    std::vector<float> values;
  };
  std::vector<Other> others;  ///< names unique, of letters, digits, '_', '-' and '.'

  [[nodiscard]] bool empty() const {
    return confidence.empty() && observations.empty() && robot.empty() && others.empty();
  }
};

/// Binary PLY: float x y z nx ny nz, uchar red green blue [, float confidence, int observations, uchar
/// robot, float others...]; opens with colours and normals in PCL, Open3D, MeshLab and CloudCompare. Points
/// with a NaN coordinate are left out, unknown normals are written as 0 0 0. The same cloud gives the same
/// bytes. A `shift` (CloudFile::shift) is added to the positions, which are then written as doubles.
/// `comments`: lines for the header. Errors (kOutput) name the file, which appears whole or not at all.
core::Result<void> write_ply(const std::filesystem::path& file, const Cloud& cloud,
                             const CloudColumns& columns = {},
                             const Eigen::Vector3d& shift = Eigen::Vector3d::Zero(),
                             const std::vector<std::string>& comments = {});

/// Binary PCD v0.7: x y z rgb normal_x normal_y normal_z curvature [, confidence, observations, robot,
/// others]. An organised cloud stays organised and keeps its NaN points; an unorganised one loses them.
/// `comments`: lines for the header, each behind a #, which PCL passes over.
core::Result<void> write_pcd(const std::filesystem::path& file, const Cloud& cloud,
                             const CloudColumns& columns = {},
                             const Eigen::Vector3d& shift = Eigen::Vector3d::Zero(),
                             const std::vector<std::string>& comments = {});

/// write_ply or write_pcd by the name's ending; another ending is a kUsage error.
core::Result<void> write_cloud(const std::filesystem::path& file, const Cloud& cloud,
                               const CloudColumns& columns = {},
                               const Eigen::Vector3d& shift = Eigen::Vector3d::Zero(),
                               const std::vector<std::string>& comments = {});

struct CloudFile {
  CloudPtr cloud;  ///< without colour: 255 255 255; without normals: NaN normals
  CloudColumns columns;
  /// Subtracted from all positions while reading: a point is at `shift` + its coordinates. Zero without
  /// LargeCoordinates::kShifted.
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  CloudFrame frame = {};  ///< as the file's header says
  bool has_color = false;
  bool has_normals = false;
  std::size_t nan_points = 0;   ///< points with a coordinate that is not finite; kept in `cloud`
  std::size_t nan_normals = 0;  ///< points whose normal is unknown (NaN or zero) though the file has normals
};

/// Treatment of coordinates with more digits than a float has, such as UTM's.
enum class LargeCoordinates {
  kRounded,  ///< to the nearest float
  kShifted   ///< whole metres near their middle are subtracted first: CloudFile::shift
};

/// Moves a cloud that was read with one shift into the frame of one with another.
void change_shift(Cloud& cloud, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// Checks that clouds with these shifts fit into one frame. Errors (kInput) name both: more than 10 km apart,
/// where floats are not exact to a millimetre.
core::Result<void> check_one_frame(const std::string& name, const Eigen::Vector3d& shift,
                                   const std::string& other_name, const Eigen::Vector3d& other_shift);

/// Reads PLY (ascii, binary), PCD (ascii, binary, binary_compressed) and text (.xyz .txt .csv .asc .pts: x y
/// z, then 0-255 red green blue and/or nx ny nz; separated by blanks, commas or semicolons; a CSV header line
/// names columns). Columns with other names are kept as 32 bit floats (lists, arrays and alpha are not).
/// Errors (kInput): missing, empty, not this format, without x y z, truncated, header promising more points
/// than the file holds (detected before memory is allocated).
core::Result<CloudFile> read_cloud(const std::filesystem::path& file,
                                   LargeCoordinates large = LargeCoordinates::kRounded);

}  // namespace plumbline::cloud
