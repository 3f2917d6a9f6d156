// SPDX-License-Identifier: BSD-3-Clause
#include "similarity.hpp"

#include <memory>
#include <opencv2/core/mat.hpp>
#include <utility>

namespace plumbline::adjust {
namespace {

using geometry::Rigid3;

void lengthen(double scale, maps::KeyframeEdge& edge) {
  geometry::Vector6d shorter = geometry::Vector6d::Ones();
  shorter.head<3>().setConstant(1.0 / scale);
  edge.b_from_a.translation *= scale;
  edge.information = (shorter.asDiagonal() * edge.information * shorter.asDiagonal()).eval();
}

std::shared_ptr<const features::FrameFeatures> lengthened(double scale,
                                                          const features::FrameFeatures& measured) {
  auto features = std::make_shared<features::FrameFeatures>(measured);
  const auto factor = static_cast<float>(scale);
  for (features::PointFeature& point : features->points) point.depth *= factor;
  for (Eigen::Vector2f& slant : features->slants) slant /= factor;

  for (features::LineFeature& line : features->lines) {
    if (!line.line3) continue;
    line.line3->start *= scale;
    line.line3->end *= scale;
    for (features::EndpointNoise* noise : {&line.line3->start_noise, &line.line3->end_noise})
      *noise = {noise->depth * factor, noise->across * factor};
  }
  features->shutter_motion.head<3>() *= scale;
  if (!features->thumbnail_depth.empty())
    features->thumbnail_depth = cv::Mat(features->thumbnail_depth * scale);
  return features;
}

void lengthen_keyframe(double scale, core::KeyframeId id, maps::Map& map) {
  auto keyframe = std::make_shared<maps::Keyframe>(map.keyframe(id));
  keyframe->camera_from_reference.translation *= scale;
  keyframe->reference_sigma_m *= scale;
  if (keyframe->features != nullptr) keyframe->features = lengthened(scale, *keyframe->features);
  for (maps::SurfaceSample& sample : keyframe->surface) {
    sample.point *= static_cast<float>(scale);
    sample.sigma *= static_cast<float>(scale);
  }
  map.replace_keyframe(std::move(keyframe));
}

}  // namespace

Similarity operator*(const Similarity& second, const Similarity& first) {
  const Rigid3 longer(first.motion.rotation, second.scale * first.motion.translation);
  return {second.scale * first.scale, second.motion * longer};
}

void apply(const Similarity& similarity, const Rigid3& output_from_map, maps::Map& map,
           std::vector<maps::FramePose>& frames) {
  const double scale = similarity.scale;
  const Rigid3 map_from_output = output_from_map.inverse();
  // The similarity is told in the frame of results; poses and landmarks live in the map's own.
  const Eigen::Matrix3d turn =
      map_from_output.rotation * similarity.motion.rotation * output_from_map.rotation;
  const auto moved = [&](const Eigen::Vector3d& p) {
    return map_from_output * (similarity * (output_from_map * p));
  };

  for (const core::KeyframeId id : map.keyframe_ids()) {
    const Rigid3 world_from_camera = map.camera_from_world(id).inverse();
    map.set_pose(id,
                 Rigid3(turn * world_from_camera.rotation, moved(world_from_camera.translation)).inverse());
    if (scale != 1.0) lengthen_keyframe(scale, id, map);
  }

  for (const core::PointId id : map.point_ids()) {
    maps::MapPoint& point = map.point(id);
    point.position = moved(point.position);
    point.view_direction = turn * point.view_direction;
    point.normal = turn * point.normal;
    point.reference_distance *= scale;
  }

  for (const core::LineId id : map.line_ids()) {
    maps::MapLine& line = map.line(id);
    line.start = moved(line.start);
    line.end = moved(line.end);
  }

  for (auto [number, edge] : std::map(map.edges())) {
    lengthen(scale, edge);
    map.replace_edge(number, edge);
  }

  std::vector<maps::LoopEdge> loops = map.loops();
  for (maps::LoopEdge& loop : loops) lengthen(scale, loop);
  map.set_loops(std::move(loops));

  for (maps::FramePose& frame : frames) {
    frame.camera_from_reference.translation *= scale;
    if (frame.camera_from_previous) frame.camera_from_previous->translation *= scale;
    frame.step_sigma_m *= scale;
    if (frame.seen == nullptr || scale == 1.0) continue;
    auto seen = std::make_shared<maps::SeenPoints>(*frame.seen);

    for (maps::SeenPoint& point : seen->points) point.depth *= static_cast<float>(scale);
    frame.seen = std::move(seen);
  }
}

}  // namespace plumbline::adjust
