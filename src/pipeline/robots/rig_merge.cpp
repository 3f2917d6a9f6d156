// SPDX-License-Identifier: BSD-3-Clause
#include "robots/rig_merge.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <set>

#include "plumbline/geometry/adjoint.hpp"
#include "plumbline/geometry/alignment.hpp"

namespace plumbline::pipeline {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;

constexpr double kDegree = M_PI / 180.0;

/// A camera's path in one of the parts.
struct CameraPath {
  std::size_t part = 0;
  std::int32_t robot = 0;
  geometry::Trajectory path;
};

/// Number of the robot of this name; it must be among the parts' robots.
std::int32_t number_of(const std::string& name, const std::vector<RobotMap>& parts) {
  for (const RobotMap& part : parts) {
    for (const RobotInfo& robot : part.robots) {
      if (robot.name == name) return robot.number;
    }
  }
  return -1;
}

/// The paths of a camera, one for each part in which it was tracked; stamps of the reference's clock.
std::vector<CameraPath> paths_of(std::int32_t robot, const std::vector<RobotMap>& parts, double offset_s) {
  std::vector<CameraPath> paths;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    std::vector<maps::FramePose> frames;
    for (const maps::FramePose& frame : parts[p].frame_poses) {
      if (frame.tracked && frame.reference.robot == robot) frames.push_back(frame);
    }
    geometry::Trajectory path = maps::trajectory(frames, *parts[p].map);
    for (geometry::StampedPose& pose : path) pose.stamp += offset_s;
    if (path.size() > 1) paths.push_back({p, robot, std::move(path)});
  }
  return paths;
}

/// The offset of a camera's clock, if its motion shows one that is larger than its uncertainty.
double offset_of(const RigCamera& camera, const std::vector<CameraPath>& reference,
                 const std::vector<CameraPath>& other, RigPlace& place) {
  constexpr double kLeast_s = 0.002, kSharpest_s = 0.01;
  if (camera.time_offset_s) place.offset_is = "given";
  if (camera.time_offset_s) return *camera.time_offset_s;

  // The two parts with most time in common.
  geometry::ClockOffset best;
  std::size_t most = 0;
  for (const CameraPath& a : reference) {
    for (const CameraPath& b : other) {
      const std::size_t motions = geometry::common_motions(a.path, b.path).size();
      if (motions <= most) continue;
      most = motions;
      best = geometry::find_clock_offset(a.path, b.path);
    }
  }

  // An offset within its uncertainty would only add noise.
  const bool certain = best.sigma_s < kSharpest_s && std::abs(best.offset_s) > 3.0 * best.sigma_s;
  if (!certain || std::abs(best.offset_s) < kLeast_s) return 0.0;
  place.offset_is = "found";
  return best.offset_s;
}

geometry::HandEyePrior prior_of(const RigCamera& camera) {
  geometry::HandEyePrior prior;
  if (camera.position) {
    prior.reference_from_camera.translation = *camera.position;
    prior.sigma_m = camera.sigma_m;
  }
  if (camera.rotation) {
    prior.reference_from_camera.rotation = camera.rotation->toRotationMatrix();
    prior.sigma_rad = camera.sigma_rad;
  }
  return prior;
}

std::string axis_text(const Eigen::Vector3d& v) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", v.x(), v.y(), v.z());
}

/// Error about a pose that the motion leaves open: what to do about it.
tl::unexpected<core::Error> open_pose(const Rig& rig, const RigCamera& camera,
                                      const geometry::HandEye& found) {
  const std::string& reference = rig.cameras.front().name;
  const std::string place = fmt::format("{}: cameras.{}: ", rig.file.string(), camera.name);
  if (found.free_rotation || found.free_positions.size() > 1) {
    return core::input_error(fmt::format(
        "{}the motion does not show its {}: turn the robot about all axes, 30 degrees and more, for ten "
        "seconds, or give position and rotation",
        place, found.free_rotation ? "rotation" : "position"));
  }

  return core::input_error(fmt::format(
      "{}the motion does not show its position along {} in the axes of {}: the robot turned about that axis "
      "only; tilt it as well, or measure this offset and give it with its sigma, such as "
      "position: [0, 0.12, 0], sigma: {{position: [10 m, 5 mm, 10 m]}}",
      place, axis_text(found.free_positions.front()), reference));
}

std::string span_text(const std::vector<CameraPath>& paths) {
  if (paths.empty()) return "was not tracked";
  double first = paths.front().path.front().stamp, last = first;
  for (const CameraPath& path : paths) {
    first = std::min(first, path.path.front().stamp);
    last = std::max(last, path.path.back().stamp);
  }
  return fmt::format("{:.3f} to {:.3f} s", first, last);
}

/// A given pose that the motion contradicts is mostly the inverse, or in the axes of the body.
void warn_of_contradiction(const Rig& rig, const RigCamera& camera,
                           const std::vector<geometry::CommonMotion>& motions, core::Log& log) {
  const geometry::HandEye free = geometry::find_hand_eye(motions);
  if (!free.determined()) return;
  const Rigid3 given(*camera.rotation, *camera.position);
  const double apart = (free.reference_from_camera.translation - given.translation).norm();
  const double turned =
      geometry::rotation_angle(free.reference_from_camera.rotation.transpose() * given.rotation);

  const double sigma_m =
      std::sqrt(free.covariance.topLeftCorner<3, 3>().trace() + camera.sigma_m.squaredNorm());
  const double sigma_rad =
      std::sqrt(free.covariance.bottomRightCorner<3, 3>().trace() + camera.sigma_rad.squaredNorm());
  if (apart < 4.0 * sigma_m && turned < 4.0 * sigma_rad) return;

  log.warning(
      fmt::format("{}: cameras.{}: the motion shows a pose that is {:.0f} mm and {:.1f} degrees off the "
                  "given one, which must lead from the camera's optical frame to that of {} (x right, y "
                  "down, z ahead); leave it out to have it found",
                  rig.file.string(), camera.name, 1e3 * apart, turned / kDegree, rig.cameras.front().name));
}

/// The pose as given, or from the motions.
core::Result<void> find_pose(const Rig& rig, const RigCamera& camera,
                             const std::vector<geometry::CommonMotion>& motions, core::Log& log,
                             RigPlace& place) {
  place.pose = geometry::find_hand_eye(motions, prior_of(camera));
  place.found = !camera.given();
  if (place.found) return place.pose.determined() ? core::Result<void>() : open_pose(rig, camera, place.pose);

  warn_of_contradiction(rig, camera, motions, log);
  geometry::Vector6d variances;
  variances << camera.sigma_m.cwiseAbs2(), camera.sigma_rad.cwiseAbs2();
  place.pose.reference_from_camera = Rigid3(*camera.rotation, *camera.position);
  place.pose.covariance = variances.asDiagonal();
  return {};
}

/// Keyframes of one robot, by stamp on the reference's clock.
std::vector<std::pair<double, core::KeyframeId>> keyframes_of(const RobotMap& part, std::int32_t robot,
                                                              double offset_s) {
  std::vector<std::pair<double, core::KeyframeId>> keyframes;
  for (const core::KeyframeId id : part.map->keyframe_ids()) {
    if (id.robot == robot) keyframes.emplace_back(part.map->keyframe(id).stamp + offset_s, id);
  }
  std::sort(keyframes.begin(), keyframes.end());
  return keyframes;
}

/// The keyframe nearest in time; there is at least one.
core::KeyframeId nearest(const std::vector<std::pair<double, core::KeyframeId>>& keyframes, double stamp) {
  auto after = std::lower_bound(keyframes.begin(), keyframes.end(), std::pair(stamp, core::KeyframeId()));
  if (after == keyframes.end()) return keyframes.back().second;
  if (after == keyframes.begin()) return after->second;
  return after->first - stamp < stamp - (after - 1)->first ? after->second : (after - 1)->second;
}

/// Information on camera_from_keyframe: the extrinsic's covariance, and the reference camera's own motion
/// from its keyframe to the moment of the pair.
Matrix6d information_of_pair(const geometry::HandEye& extrinsic, const Rigid3& motion) {
  constexpr double kLeast_m = 0.002, kLeast_rad = 0.001;
  constexpr double kShare = 0.01;  // drift of a tracker over less than a second or a metre
  const Rigid3 camera_from_reference = extrinsic.reference_from_camera.inverse();
  const double sigma_m = std::hypot(kLeast_m, kShare * motion.translation.norm());
  const double sigma_rad = std::hypot(kLeast_rad, kShare * geometry::rotation_angle(motion.rotation));

  Matrix6d axes = Matrix6d::Zero();
  axes.topLeftCorner<3, 3>() = camera_from_reference.rotation;
  axes.bottomRightCorner<3, 3>() = camera_from_reference.rotation;
  const Matrix6d moved = geometry::adjoint(camera_from_reference);
  const Matrix6d covariance =
      axes * extrinsic.covariance * axes.transpose() +
      moved * geometry::information_of(sigma_m, sigma_rad).inverse() * moved.transpose();
  return covariance.inverse();
}

/// One pair for each of the camera's keyframes at whose time the reference camera was tracked.
std::vector<mapping::VerifiedPair> pairs_of(const CameraPath& reference, const CameraPath& camera,
                                            const std::vector<RobotMap>& parts, const RigPlace& place) {
  const auto anchors = keyframes_of(parts[reference.part], reference.robot, 0.0);
  const Rigid3 camera_from_reference = place.pose.reference_from_camera.inverse();
  std::vector<mapping::VerifiedPair> pairs;
  if (anchors.empty()) return pairs;

  for (const auto& [stamp, id] : keyframes_of(parts[camera.part], camera.robot, place.time_offset_s)) {
    const auto world_from_reference =
        geometry::pose_between(reference.path, stamp, geometry::kInterpolated_s);
    if (!world_from_reference) continue;
    mapping::VerifiedPair& pair = pairs.emplace_back();
    pair.query = id;
    pair.match = nearest(anchors, stamp);

    const Rigid3 motion =
        world_from_reference->inverse() * parts[reference.part].map->camera_from_world(pair.match).inverse();
    pair.evidence.accepted = true;
    pair.evidence.query_from_match = camera_from_reference * motion;
    pair.evidence.information = information_of_pair(place.pose, motion);
  }
  return pairs;
}

/// reference_from_camera of the two parts' worlds: the mean over the pairs, which drift apart.
mapping::Alignment mean_alignment(const std::vector<mapping::VerifiedPair>& pairs, const RobotMap& reference,
                                  const RobotMap& camera) {
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero(), mean_b = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> at_a, at_b;

  // Each pair has its own opinion, since both paths drift.
  for (const mapping::VerifiedPair& pair : pairs) {
    const Rigid3 a =
        (pair.evidence.query_from_match * reference.map->camera_from_world(pair.match)).inverse();
    const Rigid3 b = camera.map->camera_from_world(pair.query).inverse();

    turns += a.rotation * b.rotation.transpose();
    at_a.push_back(a.translation);
    at_b.push_back(b.translation);
    mean_a += a.translation / static_cast<double>(pairs.size());
    mean_b += b.translation / static_cast<double>(pairs.size());
  }

  mapping::Alignment alignment;
  const Eigen::Matrix3d rotation = geometry::nearest_rotation(turns);
  alignment.a_from_b = {rotation, mean_a - rotation * mean_b};
  double squares = 0.0;
  for (std::size_t i = 0; i < at_a.size(); ++i)
    squares += (alignment.a_from_b * at_b[i] - at_a[i]).squaredNorm();
  alignment.spread_m = std::sqrt(squares / static_cast<double>(at_a.size()));
  return alignment;
}

/// The merge of two parts by these pairs.
mapping::MergeEvidence merge_of(std::vector<mapping::VerifiedPair> pairs, const CameraPath& reference,
                                const CameraPath& camera, const std::vector<RobotMap>& parts,
                                const Matrix6d& covariance) {
  mapping::MergeEvidence merge;
  merge.accepted = true;
  merge.alignment = mean_alignment(pairs, parts[reference.part], parts[camera.part]);
  if (camera.part < reference.part) merge.alignment.a_from_b = merge.alignment.a_from_b.inverse();
  merge.a = std::min(reference.part, camera.part);
  merge.b = std::max(reference.part, camera.part);

  // The same in all directions, since the axes of the worlds are not those of the camera.
  merge.alignment.covariance =
      geometry::information_of(std::sqrt(covariance.topLeftCorner<3, 3>().trace() / 3.0),
                               std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3.0))
          .inverse();

  std::set<core::KeyframeId> matches;
  for (const mapping::VerifiedPair& pair : pairs) matches.insert(pair.match);
  merge.consistency.verified = static_cast<int>(pairs.size());
  merge.consistency.agreeing = static_cast<int>(matches.size());
  merge.pairs = std::move(pairs);
  return merge;
}

void tell(const std::string& reference, const RigPlace& place, core::Log& log) {
  const Rigid3& pose = place.pose.reference_from_camera;
  const Matrix6d& covariance = place.pose.covariance;
  log.info(fmt::format(
      "rig: {} is {:.1f} mm from {} and turned by {:.2f} degrees, {} to {:.1f} mm and {:.2f} degrees{}; {} "
      "pairs of keyframes",
      place.name, 1e3 * pose.translation.norm(), reference, geometry::rotation_angle(pose.rotation) / kDegree,
      place.found ? fmt::format("found from {} motions", place.pose.motions) : std::string("given"),
      1e3 * std::sqrt(covariance.topLeftCorner<3, 3>().trace()),
      std::sqrt(covariance.bottomRightCorner<3, 3>().trace()) / kDegree,
      place.time_offset_s == 0.0 ? std::string()
                                 : fmt::format("; its clock is {:.1f} ms late", 1e3 * place.time_offset_s),
      place.pairs));
}

}  // namespace

core::Result<RigMerge> rig_merge(const Rig& rig, const std::vector<RobotMap>& parts, core::Log& log) {
  constexpr std::size_t kLeastPairs = 3;
  RigMerge result;
  result.reference = rig.cameras.front().name;
  const auto references = paths_of(number_of(result.reference, parts), parts, 0.0);

  for (std::size_t c = 1; c < rig.cameras.size(); ++c) {
    // Pose and clock from all the time that both cameras have in common, in whatever parts.
    const RigCamera& camera = rig.cameras[c];
    const std::int32_t robot = number_of(camera.name, parts);
    RigPlace place;
    place.name = camera.name;
    place.time_offset_s = offset_of(camera, references, paths_of(robot, parts, 0.0), place);
    const auto paths = paths_of(robot, parts, place.time_offset_s);
    std::vector<geometry::CommonMotion> motions;

    for (const CameraPath& a : references) {
      for (const CameraPath& b : paths) {
        const auto more = geometry::common_motions(a.path, b.path);
        motions.insert(motions.end(), more.begin(), more.end());
      }
    }

    if (motions.empty()) {
      return core::input_error(
          fmt::format("{}: cameras.{}: it was never tracked at the same time as {} for half a second ({}: "
                      "{}; {}: {}); if the "
                      "clocks differ, give time_offset",
                      rig.file.string(), camera.name, result.reference, result.reference,
                      span_text(references), camera.name, span_text(paths)));
    }

    if (auto found = find_pose(rig, camera, motions, log, place); !found)
      return tl::unexpected(found.error());

    // A few pairs alone cannot contradict each other, by which a wrong one would be rejected.
    for (const CameraPath& a : references) {
      for (const CameraPath& b : paths) {
        auto pairs = pairs_of(a, b, parts, place);
        if (a.part == b.part || pairs.size() < kLeastPairs) continue;
        place.pairs += pairs.size();
        result.merges.push_back(merge_of(std::move(pairs), a, b, parts, place.pose.covariance));
      }
    }

    tell(result.reference, place, log);
    result.cameras.push_back(std::move(place));
  }
  return result;
}

}  // namespace plumbline::pipeline
