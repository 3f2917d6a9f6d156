// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A wall with corners, and two pictures of it from poses that are a hand's breadth apart.
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "plumbline/features/corner_patch.hpp"
#include "plumbline/maps/map.hpp"
#include "smooth_picture.hpp"
#include "tracking_world.hpp"

namespace plumbline::tests {

class TwoViewsOfAWall {
 public:
  static constexpr double kDistance = 2.0;  // m, of the wall from the older camera, which is the world
  const geometry::Rigid3 newer_from_world{Eigen::Matrix3d::Identity(), {-0.0513, 0.0327, 0.1}};

  TwoViewsOfAWall() {
    std::vector<Eigen::Vector2i> corners;
    for (int y = 60; y < kTestCamera.height - 60; y += 40) {
      for (int x = 60; x < kTestCamera.width - 60; x += 40) {
        corners.emplace_back(x, y);
        wall.push_back(kTestCamera.unproject(x, y, kDistance));
      }
    }
    older = look({}, corners);
    for (Eigen::Vector2i& c : corners) {
      const Eigen::Vector2d p = shown(static_cast<std::size_t>(&c - corners.data()));
      c = {static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y()))};
    }
    newer = look(newer_from_world, corners);
  }

  core::KeyframeId add_keyframe(const geometry::Rigid3& pose,
                                const std::shared_ptr<features::FrameFeatures>& f) {
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = map.next_keyframe_id(0);
    keyframe->features = f;
    return map.add_keyframe(keyframe, pose);
  }
  /// Where the newer picture shows what the older one's corner is.
  [[nodiscard]] Eigen::Vector2d shown(std::size_t i) const {
    return kTestCamera.project(newer_from_world * wall[i]);
  }
  /// How far the newer keyframe's corner lies from there, px.
  [[nodiscard]] double off(std::size_t i) const {
    return (newer->points[i].pixel.cast<double>() - shown(i)).norm();
  }
  [[nodiscard]] double mean_off() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < wall.size(); ++i) sum += off(i);
    return sum / static_cast<double>(wall.size());
  }

  std::vector<Eigen::Vector3d> wall;  ///< where the older picture's corners lie
  /// Corners at whole pixels, without depth; those of one number are alike in both.
  std::shared_ptr<features::FrameFeatures> older, newer;
  maps::Map map;

 private:
  [[nodiscard]] std::shared_ptr<features::FrameFeatures> look(
      const geometry::Rigid3& pose, const std::vector<Eigen::Vector2i>& corners) const {
    auto f = std::make_shared<features::FrameFeatures>();
    f->levels = {draw(kTestCamera.width, kTestCamera.height, [&](double u, double v) {
      const Eigen::Vector3d ray = kTestCamera.unproject(u, v, 1.0);
      const Eigen::Vector3d p = pose.inverse() * (ray * (kDistance + pose.translation.z()));
      return waves_(p.x() * 250.0, p.y() * 250.0);
    })};
    std::mt19937 random(3);
    for (const Eigen::Vector2i& c : corners) {
      features::PointFeature p;
      p.pixel = c.cast<float>();
      f->points.push_back(p);
      f->patches.push_back(features::cut_patch(f->levels[0], c.x(), c.y(), p.pixel));
      f->descriptors.emplace_back();
      for (auto& word : f->descriptors.back()) word = static_cast<std::decay_t<decltype(word)>>(random());
    }
    f->grid = features::PointGrid(f->points, kTestCamera.width, kTestCamera.height);
    return f;
  }

  Waves waves_{7};
};

}  // namespace plumbline::tests
