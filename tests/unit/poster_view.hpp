// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Keyframes in front of walls with posters, for places that are met again.
#include <memory>

#include "plumbline/features/frame_features.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/tracking/surface_sampler.hpp"
#include "tracking_world.hpp"

namespace plumbline::tests {

/// A wall with a poster, seen straight from 2 m, rendered at `pose`. The map believes the camera at
/// `believed`. Every feature with depth becomes a landmark of its own. `boards` of one grey may stand before
/// it.
inline core::KeyframeId add_view(maps::Map& map, const cv::Mat& poster, const geometry::Rigid3& pose,
                                 const geometry::Rigid3& believed, double stamp,
                                 const std::vector<WorldPlane>& boards = {}) {
  sensor::RgbdFrame frame;
  frame.gray = render_wall(poster, 300.0, 2.0, pose);
  std::vector<WorldPlane> planes{{{0.0, 0.0, 2.0}, {0.0, 0.0, -1.0}, 0.0}};
  planes.insert(planes.end(), boards.begin(), boards.end());
  cv::Mat plane;
  frame.depth = render_depth(planes, pose, &plane);
  frame.gray.setTo(cv::Scalar(128), plane > 0);
  auto features =
      std::make_shared<features::FrameFeatures>(features::FeatureExtractor({}, kTestCamera).extract(frame));
  auto keyframe = std::make_shared<maps::Keyframe>();
  keyframe->id = map.next_keyframe_id(0);
  keyframe->stamp = stamp;
  keyframe->features = features;
  keyframe->surface = tracking::sample_surface(frame.depth, kTestCamera, {});
  const core::KeyframeId id = map.add_keyframe(keyframe, believed);
  map.attach(id);
  for (std::size_t i = 0; i < features->points.size(); ++i) {
    const features::PointFeature& f = features->points[i];
    if (!(f.depth > 0.0F)) continue;
    const Eigen::Vector3d in_camera = kTestCamera.unproject(
        static_cast<double>(f.pixel.x()), static_cast<double>(f.pixel.y()), static_cast<double>(f.depth));
    maps::MapPoint point;
    point.position = believed.inverse() * in_camera;
    point.descriptor = features->descriptors[i];
    point.angle = f.angle;
    point.angle_keyframe = id;
    point.view_direction = (believed.rotation.transpose() * in_camera).normalized();
    point.reference_distance = in_camera.norm();
    point.reference_octave = f.octave;
    map.observe(map.add_point(0, point), id, static_cast<int>(i));
  }
  return id;
}

}  // namespace plumbline::tests
