// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closing/place_surface.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {

SurfaceVotes& SurfaceVotes::operator+=(const SurfaceVotes& o) {
  confirmed += o.confirmed;
  contradicted += o.contradicted;
  hidden += o.hidden;
  return *this;
}

double SurfaceVotes::overlap() const {
  const int all = confirmed + contradicted + hidden;
  return all > 0 ? static_cast<double>(confirmed) / all : 0.0;
}

double SurfaceVotes::contradiction() const {
  const int decided = confirmed + contradicted;
  return decided > 0 ? static_cast<double>(contradicted) / decided : 0.0;
}

SurfaceVotes vote_surface(const std::vector<maps::SurfaceSample>& samples,
                          const geometry::Rigid3& other_from_own, const cv::Mat& other_depth,
                          const sensor::Pinhole& other_camera) {
  constexpr int kMinNeighbours = 7;  // of 9 small pixels
  constexpr double kMaxDepth = 5.0;  // m; noise is too large beyond
  SurfaceVotes votes;
  if (other_depth.empty()) return votes;

  const double scale_x = static_cast<double>(other_depth.cols) / other_camera.width;
  const double scale_y = static_cast<double>(other_depth.rows) / other_camera.height;

  for (const maps::SurfaceSample& s : samples) {
    const Eigen::Vector3d p = other_from_own * s.point.cast<double>();
    if (p.z() < 0.4 || p.z() > kMaxDepth) continue;
    const Eigen::Vector3d normal = other_from_own.rotation * s.normal.cast<double>();
    if (-normal.dot(p) < 0.25 * p.norm()) continue;  // turned away: could not have been seen

    const Eigen::Vector2d pixel = other_camera.project(p);
    const int x = static_cast<int>(std::floor(pixel.x() * scale_x));
    const int y = static_cast<int>(std::floor(pixel.y() * scale_y));
    if (x < 1 || y < 1 || x + 1 >= other_depth.cols || y + 1 >= other_depth.rows) continue;

    // The range of depths around the pixel allows for slanted surfaces and for a small error of the pose.
    float low = 1e9F;
    float high = 0.0F;
    int measured = 0;

    for (int v = y - 1; v <= y + 1; ++v) {
      const float* row = other_depth.ptr<float>(v);
      for (int u = x - 1; u <= x + 1; ++u) {
        if (!(row[u] > 0.0F)) continue;
        ++measured;
        low = std::min(low, row[u]);
        high = std::max(high, row[u]);
      }
    }
    if (measured < kMinNeighbours) continue;

    // A surface in front of the measured depth was seen through, which contradicts the pose;
    // one behind it may only be hidden.
    const double tolerance = 0.04 + 3.0 * sensor::depth_sigma(p.z());

    if (p.z() < static_cast<double>(low) - tolerance) {
      ++votes.contradicted;
    } else if (p.z() > static_cast<double>(high) + tolerance) {
      ++votes.hidden;
    } else {
      ++votes.confirmed;
    }
  }

  return votes;
}

std::vector<maps::SurfaceSample> gather_surface(const maps::Map& map,
                                                const std::vector<core::KeyframeId>& keyframes,
                                                core::KeyframeId anchor) {
  std::vector<maps::SurfaceSample> result;
  for (const core::KeyframeId id : keyframes) {
    const geometry::Rigid3 anchor_from_id =
        map.camera_from_world(anchor) * map.camera_from_world(id).inverse();
    for (maps::SurfaceSample s : map.keyframe(id).surface) {
      s.point = (anchor_from_id * s.point.cast<double>()).cast<float>();
      s.normal = (anchor_from_id.rotation * s.normal.cast<double>()).cast<float>();
      result.push_back(s);
    }
  }
  return result;
}

}  // namespace plumbline::mapping
