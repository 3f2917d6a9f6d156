// SPDX-License-Identifier: BSD-3-Clause
// poses.csv: poses with their covariances, for filters and other maps.
#include <fmt/format.h>

#include <cmath>

#include "formats.hpp"
#include "paths/robot_files.hpp"
#include "plumbline/core/csv.hpp"
#include "plumbline/maps/fusion_state.hpp"

namespace plumbline::exports {
namespace {

constexpr const char* kPosesAxes[6] = {"x", "y", "z", "rx", "ry", "rz"};

/// From that of (rho, phi) in Exp(rho, phi) camera_from_world to that of the body's position and of small
/// turns about the world's axes.
geometry::Matrix6d in_world(const geometry::Matrix6d& covariance, const geometry::Rigid3& world_from_camera,
                            const geometry::Rigid3& camera_from_body) {
  const Eigen::Matrix3d& turn = world_from_camera.rotation;
  const Eigen::Vector3d arm = turn * camera_from_body.translation;
  geometry::Matrix6d change = geometry::Matrix6d::Zero();
  change.topLeftCorner<3, 3>() = -turn;
  change.bottomRightCorner<3, 3>() = -turn;
  change.topRightCorner<3, 3>() = geometry::skew(arm) * turn;  // -(phi x arm)
  return change * covariance * change.transpose();
}

/// Covariance of each pose as the map holds it; nothing if it holds none.
std::vector<geometry::Matrix6d> covariances_of(const maps::FusionState& state,
                                               const std::vector<ExportPose>& poses) {
  std::vector<std::int32_t> robots;
  std::vector<double> stamps;
  for (const ExportPose& pose : poses) {
    robots.push_back(pose.robot);
    stamps.push_back(pose.stamp);
  }
  return state.covariances_of(robots, stamps);
}

/// Comments that explain frame and axes, and the names of the columns.
std::string poses_head(const std::string& frame) {
  std::string head = fmt::format(
      "# {}\n# covariance of position (m) and of turns about the world's axes (rad), beside the "
      "first keyframe\n"
      "robot,keyframe,stamp,x,y,z,qx,qy,qz,qw",
      frame);
  for (int r = 0; r < 6; ++r) {
    for (int c = r; c < 6; ++c) head += fmt::format(",cov_{}_{}", kPosesAxes[r], kPosesAxes[c]);
  }
  return head + "\n";
}

/// A row's columns before the covariance; only keyframes have a number.
std::string pose_columns(const ExportPose& pose, const geometry::Rigid3& camera_from_body) {
  const geometry::Rigid3 body = pose.world_from_camera * camera_from_body;
  const Eigen::Quaterniond q = body.quaternion();
  return fmt::format(
      "{},{},{:.6f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}", core::csv_field(pose.robot_name),
      pose.keyframe.valid() ? std::to_string(pose.keyframe.index) : "", pose.stamp, body.translation.x(),
      body.translation.y(), body.translation.z(), q.x(), q.y(), q.z(), q.w());
}

/// The upper triangle, row by row.
std::string covariance_columns(const geometry::Matrix6d& covariance) {
  std::string columns;
  for (int r = 0; r < 6; ++r) {
    for (int c = r; c < 6; ++c) columns += fmt::format(",{:.6e}", covariance(r, c));
  }
  return columns;
}

/// Says why covariances are missing.
void note_unknown(std::size_t unknown, std::size_t poses, bool any, ExportSummary& summary) {
  if (any && unknown > 0) {
    summary.notes.push_back(fmt::format(
        "the covariance of {} of {} poses is not known, so their columns are empty", unknown, poses));
  }
  if (!any) {
    summary.notes.emplace_back(
        "the map holds no covariances, so their columns are empty: it was interrupted, made without the "
        "stage refine, or summary.json says why (refine, sigma_note)");
  }
}

/// Writes poses of the camera or the body with their covariances.
core::Result<ExportSummary> write_poses(MapSource& source, const std::filesystem::path& output) {
  const auto store = source.store("the covariance of poses");
  if (!store) return tl::unexpected(store.error());
  const auto mounts = body_mounts(source);
  if (!mounts) return tl::unexpected(mounts.error());
  const auto poses = source.poses(source.request().content == Content::kKeyframes);
  if (!poses) return tl::unexpected(poses.error());

  const auto state = (*store)->fusion_state();
  if (!state) return tl::unexpected(state.error());
  const std::vector<geometry::Matrix6d> covariances = covariances_of(*state, *poses);

  // One row per pose; unknown covariances leave their columns empty
  core::OutputFile out(output);
  out.write(poses_head(source.frame_text()));
  std::size_t unknown = 0;
  for (std::size_t i = 0; i < poses->size(); ++i) {
    const ExportPose& pose = (*poses)[i];
    const geometry::Rigid3 camera_from_body = mounts->of(pose.robot).inverse();
    const bool known = !covariances.empty() && covariances[i].allFinite();
    unknown += known ? 0 : 1;
    out.write(pose_columns(pose, camera_from_body));
    out.write(known ? covariance_columns(in_world(covariances[i], pose.world_from_camera, camera_from_body))
                    : std::string(21, ','));
    out.write("\n");
  }

  if (auto written = out.commit(); !written) return tl::unexpected(written.error());
  ExportSummary summary;
  summary.written = {output};
  note_unknown(unknown, poses->size(), !covariances.empty(), summary);
  return summary;
}

}  // namespace

Format poses_format() {
  return {"poses",
          {"poses.csv"},
          {Content::kTrajectory, Content::kKeyframes},
          "map.db",
          "Poses with covariance",
          "Robot, keyframe number, stamp, position, quaternion, and the upper triangle of the 6 x 6 "
          "covariance of position (m) and small turns about the world's axes (rad): the order of ROS' "
          "`PoseWithCovariance`. Frames between keyframes have that of the keyframe before. Choose it by the "
          "name `poses.csv` or with `--format poses`; `--what keyframes` writes keyframes only.",
          {"body"},
          &write_poses};
}

}  // namespace plumbline::exports
