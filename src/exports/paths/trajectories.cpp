// SPDX-License-Identifier: BSD-3-Clause
// Paths as the programs that compare them read them: TUM, KITTI, EuRoC; and as edges for viewers.
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "formats.hpp"
#include "paths/robot_files.hpp"
#include "plumbline/cloud/io/ply.hpp"

namespace plumbline::exports {
namespace {

/// Head of a text file, which ends with the line about the frame.
std::string path_head(const MapSource& source, const std::string& what) {
  const bool body = !source.options().body.empty();
  return fmt::format("# {}\n# {} in the world; {}\n", what,
                     body ? "the body" : "the camera (x right, y down, z ahead)", source.frame_text());
}

/// TUM: a row of stamp, position and quaternion.
core::Result<ExportSummary> write_tum(MapSource& source, const std::filesystem::path& output) {
  return write_robot_files(source, output, ".txt", [&](core::OutputFile& out, const auto& paths) {
    out.write(path_head(source, "stamp tx ty tz qx qy qz qw"));
    for (const auto& path : paths) {
      out.write(robot_comment(path));
      for (const ExportPose& pose : path) {
        const Eigen::Vector3d& t = pose.world_from_camera.translation;
        const Eigen::Quaterniond q = pose.world_from_camera.quaternion();
        out.write(fmt::format("{:.6f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", pose.stamp, t.x(),
                              t.y(), t.z(), q.x(), q.y(), q.z(), q.w()));
      }
    }
  });
}

/// KITTI: the upper 3 x 4 part of each pose matrix as a row, without stamps.
core::Result<ExportSummary> write_kitti(MapSource& source, const std::filesystem::path& output) {
  const auto paths = paths_of(source);
  if (!paths) return tl::unexpected(paths.error());
  if (paths->size() > 1 && output.has_extension()) {
    return core::usage_error(fmt::format(
        "{}: KITTI's rows have neither stamps nor names to tell {} robots apart; name a folder and "
        "the format, which gets a file for each: --format kitti -o FOLDER",
        output.string(), paths->size()));
  }

  // Matrices by rows
  return write_robot_files(source, output, ".kitti", [](core::OutputFile& out, const auto& all) {
    for (const auto& path : all) {
      for (const ExportPose& pose : path) {
        std::string row;
        for (int r = 0; r < 3; ++r) {
          for (int c = 0; c < 3; ++c) row += fmt::format("{:.9e} ", pose.world_from_camera.rotation(r, c));
          row += fmt::format("{:.9e}{}", pose.world_from_camera.translation[r], r < 2 ? " " : "\n");
        }
        out.write(row);
      }
    }
  });
}

/// EuRoC: stamps in nanoseconds, quaternions with w first.
core::Result<ExportSummary> write_euroc(MapSource& source, const std::filesystem::path& output) {
  return write_robot_files(source, output, ".csv", [](core::OutputFile& out, const auto& paths) {
    out.write(
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n");
    for (const auto& path : paths) {
      out.write(robot_comment(path));
      for (const ExportPose& pose : path) {
        const Eigen::Vector3d& t = pose.world_from_camera.translation;
        const Eigen::Quaterniond q = pose.world_from_camera.quaternion();
        out.write(fmt::format("{},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}\n",
                              std::llround(pose.stamp * 1e9), t.x(), t.y(), t.z(), q.w(), q.x(), q.y(),
                              q.z()));
      }
    }
  });
}

/// Paths as vertices and edges for viewers.
core::Result<ExportSummary> write_path(MapSource& source, const std::filesystem::path& output) {
  const auto paths = paths_of(source);
  if (!paths) return tl::unexpected(paths.error());

  // Vertices of all paths
  std::array<std::vector<float>, 3> xyz;
  cloud::PlyData data;
  data.comments = {"plumbline, metres", source.frame_text()};

  // Edges join poses of one robot only
  std::uint32_t index = 0;
  for (const auto& path : *paths) {
    for (std::size_t i = 0; i < path.size(); ++i, ++index) {
      const Eigen::Vector3f p = path[i].world_from_camera.translation.cast<float>();
      for (int k = 0; k < 3; ++k) xyz[static_cast<std::size_t>(k)].push_back(p[k]);
      if (i > 0) data.edges.push_back({index - 1, index});
    }
  }

  // Position by columns, as PLY takes them
  data.add("x", std::move(xyz[0]));
  data.add("y", std::move(xyz[1]));
  data.add("z", std::move(xyz[2]));
  if (auto written = cloud::write_ply(output, data); !written) return tl::unexpected(written.error());

  ExportSummary summary;
  summary.written = {output};
  return summary;
}

const std::vector<Content> kPathContents{Content::kTrajectory, Content::kKeyframes};

}  // namespace

Format tum_format() {
  return {"tum",
          {".txt", ".tum"},
          kPathContents,
          "",
          "Path, TUM",
          "`stamp tx ty tz qx qy qz qw`, seconds and metres; read by evo and `plumbline evaluate "
          "trajectory`. Several robots are written to one file with a comment line before each, or to a "
          "folder with a file each: name a folder and the format, `--format tum -o FOLDER`. `--body` writes "
          "the path of a body that carries the camera.",
          {"body"},
          &write_tum};
}

Format kitti_format() {
  return {"kitti",
          {".kitti"},
          kPathContents,
          "",
          "Path, KITTI",
          "A row of a 3 x 4 matrix per tracked frame, world from camera, without stamps; for several robots "
          "a folder with a file each: `--format kitti -o FOLDER`.",
          {"body"},
          &write_kitti};
}

Format euroc_format() {
  return {"euroc",
          {".csv"},
          kPathContents,
          "",
          "Path, EuRoC",
          "Nanoseconds, position, quaternion with w first. Give `--body` the pose of the camera in the IMU "
          "to get the IMU's path, as in that data set.",
          {"body"},
          &write_euroc};
}

Format path_format() {
  return {"path",   {".ply"},        kPathContents,
          "",       "Path as edges", "Vertices and edges for viewers, one chain per robot.",
          {"body"}, &write_path};
}

}  // namespace plumbline::exports
