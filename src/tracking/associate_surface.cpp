// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <opencv2/core.hpp>

#include "plumbline/sensor/depth_noise.hpp"
#include "plumbline/tracking/association.hpp"

namespace plumbline::tracking {
namespace {

/// Depth at a sub-pixel place: bilinear where all four neighbours lie on one surface, else 0.
float depth_at(const cv::Mat& depth, double u, double v) {
  if (!(u >= 0.0 && v >= 0.0 && u < depth.cols - 1 && v < depth.rows - 1)) return 0.0F;
  const int x = static_cast<int>(u);
  const int y = static_cast<int>(v);
  const float* r0 = depth.ptr<float>(y) + x;
  const float* r1 = depth.ptr<float>(y + 1) + x;
  const float low = std::min(std::min(r0[0], r0[1]), std::min(r1[0], r1[1]));
  const float high = std::max(std::max(r0[0], r0[1]), std::max(r1[0], r1[1]));
  if (!(low > 0.0F) || high - low > 0.01F * low + 4.0F * static_cast<float>(sensor::depth_sigma(low)))
    return 0.0F;
  const auto fx = static_cast<float>(u - x);
  const auto fy = static_cast<float>(v - y);
  return (1.0F - fy) * ((1.0F - fx) * r0[0] + fx * r0[1]) + fy * ((1.0F - fx) * r1[0] + fx * r1[1]);
}

}  // namespace

std::vector<optimize::PlaneTerm> associate_surface(const std::vector<WorldSurface>& surface,
                                                   const PosedDepth& posed,
                                                   const SurfaceAssociationOptions& options, int* in_view) {
  const cv::Mat& depth = posed.depth;
  const sensor::Pinhole& camera = posed.camera;
  std::vector<optimize::PlaneTerm> terms;
  if (in_view != nullptr) *in_view = 0;
  if (depth.empty() || surface.empty()) return terms;

  const geometry::Rigid3 depth_from_world = posed.depth_from_camera * posed.camera_from_world;
  const geometry::Rigid3 camera_from_depth = posed.depth_from_camera.inverse();
  const geometry::Rigid3 world_from_depth = depth_from_world.inverse();
  terms.reserve(static_cast<std::size_t>(options.max_samples));

  // Take every n-th sample, so that any number of them is spread over all keyframes and the whole image.
  const std::size_t step = 1 + (surface.size() - 1) / static_cast<std::size_t>(options.max_samples);
  for (std::size_t i = 0; i < surface.size(); i += step) {
    const WorldSurface& s = surface[i];
    const Eigen::Vector3d p = depth_from_world * s.point;
    if (p.z() < 0.25 || p.z() > options.max_depth_m + 0.5) continue;

    const Eigen::Vector2d pixel = camera.project(p);
    if (!camera.contains(pixel)) continue;

    const Eigen::Vector3d normal = depth_from_world.rotation * s.normal;
    const double cosine = -normal.dot(p) / p.norm();
    if (cosine < 0.25) continue;

    // The measured point, near the sample's tangent plane
    const double z = depth_at(depth, pixel.x(), pixel.y());
    if (!(z > 0.25) || z > options.max_depth_m) continue;
    if (in_view != nullptr) ++*in_view;
    const Eigen::Vector3d measured = camera.unproject(pixel.x(), pixel.y(), z);
    const double distance = s.normal.dot(world_from_depth * measured - s.point);
    if (std::abs(distance) > options.max_distance_m) continue;

    // Noise of the measurement and of the map
    const double measured_sigma = sensor::depth_sigma(z) * std::max(0.3, -normal.z());
    terms.push_back({camera_from_depth * measured, s.point, s.normal,
                     std::sqrt(measured_sigma * measured_sigma + s.sigma * s.sigma)});
  }

  return terms;
}

}  // namespace plumbline::tracking
