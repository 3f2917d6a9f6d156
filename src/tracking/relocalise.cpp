// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/relocalise.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <vector>

#include "plumbline/optimize/pose_solver.hpp"

namespace plumbline::tracking {
namespace {

struct Pair {
  core::PointId point;
  int feature = -1;
};

/// Landmarks of a keyframe against all features of the frame: clearly best, and each other's best.
std::vector<Pair> match_all(const maps::Map& map, core::KeyframeId keyframe,
                            const features::FrameFeatures& frame) {
  constexpr int kMaxHamming = 60;
  constexpr double kRatio = 0.8;
  std::vector<int> distances(frame.descriptors.size());
  struct Best {
    int distance = 257;
    core::PointId point;
  };

  std::vector<Best> by_feature(distances.size());
  for (core::PointId id : map.points_of(keyframe)) {
    if (!id.valid() || distances.empty()) continue;
    features::hamming_distances(map.point(id).descriptor, frame.descriptors.data(), distances.size(),
                                distances.data());

    // Best match, and second best at another place
    const auto best = std::min_element(distances.begin(), distances.end());
    const auto feature = static_cast<std::size_t>(best - distances.begin());
    int second = 257;
    for (std::size_t i = 0; i < distances.size(); ++i) {
      const bool elsewhere = (frame.points[i].pixel - frame.points[feature].pixel).norm() > 4.0F;
      if (elsewhere) second = std::min(second, distances[i]);
    }

    // Unambiguous, and the best landmark of its feature
    if (*best > kMaxHamming || *best > kRatio * second) continue;
    if (*best < by_feature[feature].distance) by_feature[feature] = {*best, id};
  }

  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < by_feature.size(); ++i) {
    if (by_feature[i].point.valid()) pairs.push_back({by_feature[i].point, static_cast<int>(i)});
  }

  return pairs;
}

/// OpenCV's result is that of EPnP for all inliers, which in front of a plane may be off by decimetres from
/// the individual ones.
geometry::Rigid3 settled(const geometry::Rigid3& start, const std::vector<cv::Point3d>& world,
                         const std::vector<cv::Point2d>& pixels, const std::vector<int>& inliers,
                         const sensor::Pinhole& camera) {
  optimize::PoseProblem problem;
  problem.camera = camera;
  for (const int i : inliers) {
    const auto k = static_cast<std::size_t>(i);
    optimize::PointTerm term;
    term.world = {world[k].x, world[k].y, world[k].z};
    term.pixel = {pixels[k].x, pixels[k].y};
    problem.points.push_back(term);
  }
  optimize::PoseSolverOptions solver;
  solver.max_iterations = 30;
  return optimize::solve_pose(problem, start, solver).camera_from_world;
}

}  // namespace

std::optional<Relocalisation> relocalise(const maps::Map& map,
                                         const std::vector<core::KeyframeId>& candidates,
                                         const features::FrameFeatures& features,
                                         const sensor::Pinhole& camera, int min_inliers) {
  std::optional<Relocalisation> best;
  const cv::Matx33d k(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
  for (core::KeyframeId id : candidates) {
    const std::vector<Pair> pairs = match_all(map, id, features);
    // P3P has up to four solutions; a fourth pair must be there to choose, whatever the threshold.
    if (static_cast<int>(pairs.size()) < std::max(4, min_inliers)) continue;

    std::vector<cv::Point3d> world;
    std::vector<cv::Point2d> pixels;
    for (const Pair& pair : pairs) {
      const Eigen::Vector3d& p = map.point(pair.point).position;
      const Eigen::Vector2f& uv = features.points[static_cast<std::size_t>(pair.feature)].pixel;
      world.emplace_back(p.x(), p.y(), p.z());
      pixels.emplace_back(static_cast<double>(uv.x()), static_cast<double>(uv.y()));
    }

    cv::Vec3d rotation;
    cv::Vec3d translation;
    std::vector<int> inliers;

    // OpenCV's RANSAC seeds its own generator the same way each time.
    const bool solved = cv::solvePnPRansac(world, pixels, k, cv::noArray(), rotation, translation, false, 200,
                                           4.0F, 0.99, inliers, cv::SOLVEPNP_P3P);
    const int count = static_cast<int>(inliers.size());
    if (!solved || count < min_inliers || (best && best->inliers >= count)) continue;

    // Refined with all inliers
    const Eigen::Vector3d r(rotation[0], rotation[1], rotation[2]);
    const geometry::Rigid3 start(geometry::exp_so3(r),
                                 Eigen::Vector3d(translation[0], translation[1], translation[2]));
    best = Relocalisation{id, settled(start, world, pixels, inliers, camera), count};
  }

  return best;
}

}  // namespace plumbline::tracking
