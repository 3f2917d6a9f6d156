// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/camera_history.hpp"

#include <cmath>

#include "plumbline/cloud/sensor_pose.hpp"

namespace plumbline::maps {
namespace {

using geometry::Rigid3;
using geometry::Vector6d;

/// Corrects one cloud for one change of the calibration.
void apply_one(const sensor::Recalibration& change, const Vector6d& velocity, cloud::Cloud& cloud) {
  if (!change.keeps_images()) {
    for (cloud::Point& point : cloud) {
      const Eigen::Vector3d p = point.getVector3fMap().cast<double>();
      if (!std::isfinite(p.z())) continue;
      const Eigen::Vector3d normal = point.getNormalVector3fMap().cast<double>();
      point.getVector3fMap() = change.point(p).cast<float>();
      if (std::isfinite(normal.x())) point.getNormalVector3fMap() = change.normal(p, normal).cast<float>();
    }
  }

  // A new depth delay shifts the moment of measurement
  if (change.delay_s() != 0.0)
    cloud::set_sensor_pose(cloud,
                           cloud::sensor_pose(cloud) * geometry::exp_se3(-change.delay_s() * velocity));
}

}  // namespace

void recalibrate(const sensor::Recalibration& change, const Vector6d& velocity, SurfaceSample& sample) {
  const Eigen::Vector3d p = sample.point.cast<double>();
  const Rigid3 delayed = geometry::exp_se3(-change.delay_s() * velocity);
  sample.point = (delayed * change.point(p)).cast<float>();
  sample.normal = (delayed.rotation * change.normal(p, sample.normal.cast<double>())).cast<float>();
}

/// Consecutive camera versions give the changes between them.
CameraHistory::CameraHistory(const std::vector<RobotInfo>& robots) {
  for (const RobotInfo& robot : robots) {
    const sensor::Camera* before = &robot.camera;
    for (const CameraVersion& version : robot.versions) {
      by_robot_[robot.number].push_back({version.first_keyframe, version.first_frame,
                                         sensor::Recalibration(robot.camera.color, *before, version.camera)});
      before = &version.camera;
    }
  }
}

/// The changes that came after this keyframe, in order.
CameraHistory::Changes CameraHistory::of(KeyframeId keyframe) const {
  Changes changes;
  const auto robot = by_robot_.find(keyframe.robot);
  if (robot == by_robot_.end()) return changes;
  for (const Change& c : robot->second) {
    if (keyframe.index < c.first_keyframe) changes.push_back(&c.change);
  }
  return changes;
}

/// The changes that came after this frame, in order.
CameraHistory::Changes CameraHistory::of(FrameId frame) const {
  Changes changes;
  const auto robot = by_robot_.find(frame.robot);
  if (robot == by_robot_.end()) return changes;
  for (const Change& c : robot->second) {
    if (frame.index < c.first_frame) changes.push_back(&c.change);
  }
  return changes;
}

void CameraHistory::apply(KeyframeId keyframe, const Vector6d& velocity, cloud::Cloud& cloud) const {
  for (const sensor::Recalibration* change : of(keyframe)) apply_one(*change, velocity, cloud);
}

void CameraHistory::apply(FrameId frame, const Vector6d& velocity, cloud::Cloud& cloud) const {
  for (const sensor::Recalibration* change : of(frame)) apply_one(*change, velocity, cloud);
}

void CameraHistory::apply(KeyframeId keyframe, const Vector6d& velocity,
                          std::vector<SurfaceSample>& surface) const {
  for (const sensor::Recalibration* change : of(keyframe)) {
    for (SurfaceSample& sample : surface) recalibrate(*change, velocity, sample);
  }
}

}  // namespace plumbline::maps
