// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Small scenes of planes, rendered pixel by pixel: exact depth, a picture fixed to the surfaces.
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "plumbline/features/frame_features.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"
#include "random_world.hpp"

namespace plumbline::tests {

const sensor::Pinhole kTestCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

/// normal . p = offset, world frame; a rectangle of half size `half` about `centre` when half > 0.
struct WorldPlane {
  Eigen::Vector3d centre;
  Eigen::Vector3d normal;
  double half = 0.0;
};

/// Depth image of planes (nearest wins), metres; 0 where no plane is hit. `face` receives which plane was
/// hit.
inline cv::Mat render_depth(const std::vector<WorldPlane>& planes, const geometry::Rigid3& camera_from_world,
                            cv::Mat* face = nullptr, const sensor::Pinhole& camera = kTestCamera) {
  cv::Mat depth(camera.height, camera.width, CV_32FC1, cv::Scalar(0));
  if (face != nullptr) *face = cv::Mat(camera.height, camera.width, CV_32SC1, cv::Scalar(-1));
  const geometry::Rigid3 world_from_camera = camera_from_world.inverse();
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = world_from_camera.rotation * camera.unproject(x, y, 1.0);
      float& nearest = depth.at<float>(y, x);
      for (std::size_t i = 0; i < planes.size(); ++i) {
        const double z = planes[i].normal.dot(planes[i].centre - world_from_camera.translation) /
                         planes[i].normal.dot(ray);
        if (!(z > 0.1) || z > 20.0) continue;
        const Eigen::Vector3d hit = world_from_camera.translation + z * ray - planes[i].centre;
        if (planes[i].half > 0.0 && hit.cwiseAbs().maxCoeff() > planes[i].half) continue;
        if (nearest > 0.0F && z >= static_cast<double>(nearest)) continue;
        nearest = static_cast<float>(z);
        if (face != nullptr) face->at<std::int32_t>(y, x) = static_cast<std::int32_t>(i);
      }
    }
  }
  return depth;
}

/// Grey picture of the plane z = `distance` of the world that carries `texture` (pixels_per_metre, origin in
/// its middle).
inline cv::Mat render_wall(const cv::Mat& texture, double pixels_per_metre, double distance,
                           const geometry::Rigid3& camera_from_world,
                           const sensor::Pinhole& camera = kTestCamera) {
  cv::Mat map_x(camera.height, camera.width, CV_32FC1);
  cv::Mat map_y(camera.height, camera.width, CV_32FC1);
  const geometry::Rigid3 world_from_camera = camera_from_world.inverse();
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = world_from_camera.rotation * camera.unproject(x, y, 1.0);
      const Eigen::Vector3d& c = world_from_camera.translation;
      const Eigen::Vector3d p = c + ray * ((distance - c.z()) / ray.z());
      map_x.at<float>(y, x) = static_cast<float>(p.x() * pixels_per_metre + 0.5 * texture.cols);
      map_y.at<float>(y, x) = static_cast<float>(p.y() * pixels_per_metre + 0.5 * texture.rows);
    }
  }
  cv::Mat image;
  cv::remap(texture, image, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REFLECT);
  return image;
}

/// Blobs of all sizes; like a printed poster.
inline cv::Mat poster(int size, std::uint32_t seed) {
  cv::Mat image(size, size, CV_8UC1, cv::Scalar(128));
  Random random(seed);
  for (int i = 0; i < size * size / 700; ++i) {
    const cv::Point a(random.integer(0, size), random.integer(0, size));
    const int extent = random.integer(4, 40);
    const cv::Scalar grey(random.integer(0, 255));
    if (i % 2 == 0) {
      cv::rectangle(image, a, a + cv::Point(extent, random.integer(4, 40)), grey, cv::FILLED);
    } else {
      cv::circle(image, a, extent / 2, grey, cv::FILLED);
    }
  }
  cv::GaussianBlur(image, image, {5, 5}, 1.0);
  return image;
}

}  // namespace plumbline::tests
