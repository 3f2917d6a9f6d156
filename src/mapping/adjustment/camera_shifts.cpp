// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/adjustment/camera_shifts.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

#include "plumbline/mapping/adjustment/map_recalibration.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Vector6d;
using optimize::CameraCovariance;
using optimize::kCameraUnknowns;

/// Keyframes alone: enough for the motion of the camera.
std::vector<maps::FramePose> only_keyframes(const std::vector<maps::FramePose>& frames,
                                            const maps::Map& map) {
  std::vector<maps::FramePose> some;
  for (const maps::FramePose& frame : frames) {
    if (!maps::became_keyframe(frame, map)) continue;
    some.push_back(frame);
    some.back().camera_from_previous.reset();
    some.back().seen.reset();
  }
  return some;
}

/// Poses by keyframe; one that has none stays where it is in the map.
std::map<core::KeyframeId, geometry::Rigid3> poses_with(const sensor::Recalibration& change,
                                                        const maps::Map& map,
                                                        const std::vector<maps::FramePose>& keyframes) {
  const KeyframePoses found = recalibrated_poses(change, map, keyframes);
  std::map<core::KeyframeId, geometry::Rigid3> poses(found.begin(), found.end());
  for (const core::KeyframeId id : map.keyframe_ids()) poses.emplace(id, map.camera_from_world(id));
  return poses;
}

/// Motions of the keyframes from their poses before to those after, each in its camera's axes.
std::vector<Vector6d> motions_between(const std::map<core::KeyframeId, geometry::Rigid3>& before,
                                      const std::map<core::KeyframeId, geometry::Rigid3>& after) {
  std::vector<Vector6d> motions;
  for (const auto& [id, camera_from_world] : before) {
    const geometry::Rigid3 step = camera_from_world * after.at(id).inverse();
    Vector6d motion;
    motion << step.translation, geometry::log_so3(step.rotation);
    motions.push_back(motion);
  }
  return motions;
}

/// A square root: covariance = root * root'. Numbers that are known for certain are zero in it.
CameraCovariance root_of(const CameraCovariance& covariance, const optimize::CameraChange& sigma) {
  const optimize::CameraChange scale = sigma.cwiseMax(1e-12).cwiseInverse();
  const CameraCovariance correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<CameraCovariance> solver(correlation);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

}  // namespace

std::vector<KeyframeShift> camera_shifts(const maps::Map& map, const std::vector<maps::FramePose>& frames,
                                         const sensor::Pinhole& image, const sensor::Camera& camera,
                                         const CameraCovariance& covariance, const core::Executor& executor) {
  if (!covariance.allFinite() || map.keyframe_count() < 2) return {};
  const std::vector<maps::FramePose> keyframes = only_keyframes(frames, map);
  const optimize::CameraChange sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();

  // Even if the camera stays, rows are corrected anew by the final velocities: no effect of the camera.
  const auto same = poses_with(sensor::Recalibration(image, camera, camera), map, keyframes);

  // One standard deviation of each number.
  std::vector<std::vector<Vector6d>> by_number(kCameraUnknowns);
  executor.parallel_for(kCameraUnknowns, [&](std::size_t u) {
    optimize::CameraChange change = optimize::change_between(camera, camera);
    change[static_cast<Eigen::Index>(u)] += sigma[static_cast<Eigen::Index>(u)];
    const sensor::Recalibration to(image, camera, optimize::changed_camera(camera, change));
    by_number[u] = motions_between(same, poses_with(to, map, keyframes));
  });

  // Their combinations that are independent.
  const CameraCovariance root = root_of(covariance, sigma);
  std::vector<KeyframeShift> shifts;
  for (const core::KeyframeId id : map.keyframe_ids()) {
    KeyframeShift shift{id, map.keyframe(id).stamp, {}};

    for (Eigen::Index m = 0; m < root.cols(); ++m) {
      Vector6d motion = Vector6d::Zero();
      for (std::size_t u = 0; u < kCameraUnknowns; ++u)
        motion += root(static_cast<Eigen::Index>(u), m) * by_number[u][shifts.size()];
      shift.motions.push_back(motion);
    }

    shifts.push_back(std::move(shift));
  }

  return shifts;
}

}  // namespace plumbline::mapping
