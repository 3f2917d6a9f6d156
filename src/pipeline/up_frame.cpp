// SPDX-License-Identifier: BSD-3-Clause
#include "up_frame.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "plumbline/viz/snapshot.hpp"

namespace plumbline::pipeline {
namespace {

struct Floor {
  Eigen::Vector3d normal;  ///< unit, up
  double height_m = 0.0;   ///< normal . p of its points
};

constexpr double kBin_m = 0.02;
constexpr double kUpright = 0.9;     // cosine of what counts as horizontal
constexpr double kLargeShare = 0.2;  // of the largest horizontal surface

constexpr std::size_t kAtATime = 1U << 16U;

/// What faces up, with its height along `up`: in the order of the cloud.
struct Upright {
  Eigen::Vector3d at;
  double height_m;
};
std::vector<Upright> facing_up(const cloud::Cloud& cloud, const Eigen::Vector3d& up,
                               const core::Executor& executor) {
  std::vector<std::vector<Upright>> parts((cloud.size() + kAtATime - 1) / kAtATime);
  executor.parallel_for(parts.size(), [&](std::size_t part) {
    const std::size_t end = std::min(cloud.size(), (part + 1) * kAtATime);
    for (std::size_t i = part * kAtATime; i < end; ++i) {
      const cloud::Point& p = cloud[i];
      if (!(p.getNormalVector3fMap().cast<double>().dot(up) > kUpright)) continue;  // false for NaN, too
      const Eigen::Vector3d at = p.getVector3fMap().cast<double>();
      parts[part].push_back({at, at.dot(up)});
    }
  });
  std::vector<Upright> all;
  for (const std::vector<Upright>& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// Height of the lowest large surface that faces up.
std::optional<double> floor_height(const std::vector<Upright>& points) {
  std::vector<double> heights;
  for (const Upright& p : points) {
    if (std::isfinite(p.height_m)) heights.push_back(p.height_m);
  }
  constexpr std::size_t kFewest = 200;
  if (heights.size() < kFewest) return std::nullopt;
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  constexpr double kMostBins = 1e6;
  if ((*high - *low) / kBin_m > kMostBins) return std::nullopt;
  std::vector<std::size_t> count(static_cast<std::size_t>((*high - *low) / kBin_m) + 1, 0);
  for (const double h : heights) ++count[static_cast<std::size_t>((h - *low) / kBin_m)];
  const auto around = [&](std::size_t i) {
    return count[i] + (i > 0 ? count[i - 1] : 0) + (i + 1 < count.size() ? count[i + 1] : 0);
  };
  std::size_t most = 0;
  for (std::size_t i = 0; i < count.size(); ++i) most = std::max(most, around(i));
  for (std::size_t i = 0; i < count.size(); ++i) {
    if (static_cast<double>(around(i)) < kLargeShare * static_cast<double>(most)) continue;
    const std::size_t peak = i + 1 < count.size() && around(i + 1) > around(i) ? i + 1 : i;
    return *low + (static_cast<double>(peak) + 0.5) * kBin_m;
  }
  return std::nullopt;
}

/// The plane of the points near `height`; `up` within a few degrees of its normal.
std::optional<Floor> fit_floor(const std::vector<Upright>& points, const Eigen::Vector3d& up, double height) {
  constexpr double kWithin_m = 0.06;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  double count = 0.0;
  for (const Upright& p : points) {
    if (!(std::abs(p.height_m - height) < kWithin_m)) continue;
    sum += p.at;
    products += p.at * p.at.transpose();
    count += 1.0;
  }
  if (count < 100.0) return std::nullopt;
  const Eigen::Vector3d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(products / count - mean * mean.transpose());
  Floor floor;
  floor.normal = axes.eigenvectors().col(0);
  if (floor.normal.dot(up) < 0.0) floor.normal = -floor.normal;
  const bool wide = axes.eigenvalues()[1] > 9.0 * axes.eigenvalues()[0];  // a strip tells no slope
  if (!wide || floor.normal.dot(up) < std::cos(5.0 * M_PI / 180.0)) floor.normal = up;
  floor.height_m = floor.normal.dot(mean);
  return floor;
}

std::optional<Floor> find_floor(const cloud::CloudConstPtr& cloud, const geometry::Trajectory& trajectory,
                                const core::Executor& executor) {
  if (cloud == nullptr || cloud->empty()) return std::nullopt;
  viz::Scene scene;
  scene.cloud = cloud;
  viz::CameraPath path;
  path.trajectory = trajectory;
  scene.paths.push_back(std::move(path));
  const Eigen::Vector3d up = viz::estimate_up(scene);
  const std::vector<Upright> points = facing_up(*cloud, up, executor);
  const auto height = floor_height(points);
  return height ? fit_floor(points, up, *height) : std::nullopt;
}

}  // namespace

UpFrame find_up(Up wanted, const cloud::CloudConstPtr& cloud, const geometry::Trajectory& trajectory,
                const core::Executor& executor) {
  UpFrame frame;
  if (wanted == Up::kNone || trajectory.empty()) return frame;
  const geometry::Rigid3& first = trajectory.front().world_from_camera;
  Eigen::Vector3d up = -first.rotation.col(1);
  double ground = up.dot(first.translation);
  frame.up = "camera";
  if (wanted == Up::kFloor) {
    if (const auto floor = find_floor(cloud, trajectory, executor)) {
      up = floor->normal;
      ground = floor->height_m;
      frame.up = "floor";
    }
  }
  Eigen::Vector3d ahead = first.rotation.col(2) - first.rotation.col(2).dot(up) * up;
  if (ahead.norm() < 0.1) ahead = first.rotation.col(1) - first.rotation.col(1).dot(up) * up;
  Eigen::Matrix3d axes;  // of the output in the map
  axes.col(2) = up.normalized();
  axes.col(0) = ahead.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  const Eigen::Vector3d origin = first.translation + (ground - up.dot(first.translation)) * up;
  frame.output_from_map = geometry::Rigid3(axes, origin).inverse();
  return frame;
}

}  // namespace plumbline::pipeline
