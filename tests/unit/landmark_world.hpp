// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Keyframes of known pose that look at known points and lines, for what is done with landmarks.
#include <memory>
#include <vector>

#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"
#include "random_world.hpp"

namespace plumbline::tests {

struct LandmarkWorld {
  sensor::Pinhole camera{640, 480, 525.0, 525.0, 319.5, 239.5};
  std::int32_t robot = 0;  ///< whose keyframes are added
  std::vector<Eigen::Vector3d> points;
  std::vector<features::Descriptor256> point_descriptors;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> lines;
  std::vector<features::LineDescriptor> line_descriptors;
  bool depth = true;                         ///< do the corners and lines have any?
  double pixel_noise = 0.0;                  ///< standard deviation
  std::vector<maps::SurfaceSample> surface;  ///< of every keyframe, in the world frame
  maps::Map map;

  LandmarkWorld(std::uint32_t seed, int point_count, int line_count) : random_(seed) {
    for (int i = 0; i < point_count; ++i) {
      points.emplace_back(random_.uniform(-0.9, 0.9), random_.uniform(-0.6, 0.6), random_.uniform(1.5, 3.5));
      point_descriptors.push_back({random_.bits(), random_.bits(), random_.bits(), random_.bits()});
    }
    for (int i = 0; i < line_count; ++i) {
      const Eigen::Vector3d a(random_.uniform(-0.8, 0.8), random_.uniform(-0.5, 0.5),
                              random_.uniform(1.5, 3.0));
      Eigen::Vector3d along = random_.direction();
      along.z() *= 0.2;
      lines.emplace_back(a, a + 0.5 * along.normalized());
      line_descriptors.push_back({random_.bits(), random_.bits(), random_.bits(), random_.bits()});
    }
  }

  /// Feature i is point i, line feature i is line i; nothing is observed yet.
  core::KeyframeId add_keyframe(const geometry::Rigid3& camera_from_world, double turn_rate = 0.0) {
    auto features = std::make_shared<features::FrameFeatures>();
    const auto noise = [&]() -> Eigen::Vector2d {
      return Eigen::Vector2d(random_.normal(), random_.normal()) * pixel_noise;
    };
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector3d c = camera_from_world * p;
      features::PointFeature f;
      f.pixel = (camera.project(c) + noise()).cast<float>();
      f.depth = depth ? static_cast<float>(c.z()) : 0.0F;
      features->points.push_back(f);
    }
    features->descriptors = point_descriptors;
    features->grid = features::PointGrid(features->points, camera.width, camera.height);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      features::LineFeature f;
      const Eigen::Vector3d a = camera_from_world * lines[i].first;
      const Eigen::Vector3d b = camera_from_world * lines[i].second;
      f.segment.start = (camera.project(a) + noise()).cast<float>();
      f.segment.end = (camera.project(b) + noise()).cast<float>();
      f.descriptor = line_descriptors[i];
      if (depth) {
        features::Line3 line3;
        line3.start = a;
        line3.end = b;
        f.line3 = line3;
      }
      features->lines.push_back(f);
    }
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = map.next_keyframe_id(robot);
    keyframe->turn_rate = turn_rate;
    keyframe->features = features;
    for (const maps::SurfaceSample& s : surface) {
      const Eigen::Vector3d c = camera_from_world * s.point.cast<double>();
      if (c.z() < 0.2 || !camera.contains(camera.project(c))) continue;
      keyframe->surface.push_back(
          {c.cast<float>(), (camera_from_world.rotation * s.normal.cast<double>()).cast<float>(), s.sigma});
    }
    map.add_keyframe(keyframe, camera_from_world);
    map.attach(keyframe->id);
    return keyframe->id;
  }

  /// Landmark of point `i`, seen by `keyframes`.
  core::PointId add_point(std::size_t i, const std::vector<core::KeyframeId>& keyframes,
                          const Eigen::Vector3d& error = Eigen::Vector3d::Zero()) {
    maps::MapPoint point;
    point.position = points[i] + error;
    point.descriptor = point_descriptors[i];
    point.reference_distance = points[i].norm();
    point.angle_keyframe = keyframes.front();
    const core::PointId id = map.add_point(0, point);
    for (core::KeyframeId k : keyframes) map.observe(id, k, static_cast<int>(i));
    map.refresh_point(id);
    return id;
  }
  core::LineId add_line(std::size_t i, const std::vector<core::KeyframeId>& keyframes,
                        const Eigen::Vector3d& error = Eigen::Vector3d::Zero()) {
    maps::MapLine line;
    line.start = lines[i].first + error;
    line.end = lines[i].second + error;
    line.descriptor = line_descriptors[i];
    const core::LineId id = map.add_line(0, line);
    for (core::KeyframeId k : keyframes) map.observe(id, k, static_cast<int>(i));
    return id;
  }

  /// A wall at depth `z`, a sample every 5 cm, facing a camera that looks along z.
  void add_wall(double z, double half_width = 1.2) {
    for (double x = -half_width; x <= half_width; x += 0.05) {
      for (double y = -0.9; y <= 0.9; y += 0.05) {
        surface.push_back({Eigen::Vector3d(x, y, z).cast<float>(), -Eigen::Vector3f::UnitZ(), 0.005F});
      }
    }
  }

 private:
  Random random_;
};

/// Looks along z from (x, y, 0).
inline geometry::Rigid3 looking_from(double x, double y = 0.0) {
  return {Eigen::Matrix3d::Identity(), Eigen::Vector3d(-x, -y, 0.0)};
}

}  // namespace plumbline::tests
