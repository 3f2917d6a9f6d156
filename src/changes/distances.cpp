// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/changes/distances.hpp"

#include <algorithm>

#include "plumbline/cloud/fusion/cell_map.hpp"
#include "point_search.hpp"

namespace plumbline::changes {
namespace {

/// Mean and spread along the normal of the points in a cylinder about the core point (M3C2).
CylinderPoints points_in_cylinder(const Surface& cloud, const PointSearch& search,
                                  const Eigen::Vector3f& core, const Eigen::Vector3f& normal,
                                  const DistanceOptions& options, PointSearch::Found& found) {
  constexpr float kAlike = 0.5F;  // cosine of 60 degrees
  const double radius = 0.5 * options.diameter_m;
  search.within(core, std::hypot(radius, options.depth_m), found);
  std::sort(found.begin(), found.end());  // sums are rounded in this order

  CylinderPoints result;

  // Positions along the cylinder's axis of points that face the same way
  double sum = 0.0, squares = 0.0;
  for (const auto& [index, squared] : found) {
    const float facing = cloud.normals[index].dot(normal);
    if ((cloud.oriented ? facing : std::abs(facing)) < kAlike) continue;

    // The sphere that was searched contains the cylinder
    const double along = static_cast<double>((cloud.points[index] - core).dot(normal));
    if (std::abs(along) > options.depth_m || static_cast<double>(squared) - along * along > radius * radius)
      continue;
    ++result.count;
    sum += along;
    squares += along * along;
  }

  // Sample mean and standard deviation
  if (result.count == 0) return result;
  const double n = result.count;
  result.mean_m = sum / n;
  if (result.count > 1)
    result.sigma_m = std::sqrt(std::max(0.0, (squares - n * result.mean_m * result.mean_m) / (n - 1.0)));
  return result;
}

}  // namespace

double detection_limit(const CylinderPoints& before, const CylinderPoints& after, double registration_m) {
  const auto variance = [](const CylinderPoints& p) { return p.sigma_m * p.sigma_m / std::max(1U, p.count); };
  return 1.96 * (std::sqrt(variance(before) + variance(after)) + registration_m);
}

/// M3C2 distances of all core points; places with too few points in either cloud stay unknown.
std::vector<Distance> distances(const std::vector<Eigen::Vector3f>& cores,
                                const std::vector<Eigen::Vector3f>& normals, const SurfacePair& surfaces,
                                double registration_m, const DistanceOptions& options,
                                const core::Executor& executor) {
  constexpr std::size_t kBlock = 1024;

  // Core points are independent, so blocks run in parallel
  const PointSearch first(surfaces.before.points), second(surfaces.after.points);
  const auto least = static_cast<std::uint32_t>(options.min_points);
  std::vector<Distance> result(cores.size());

  executor.parallel_for((cores.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    PointSearch::Found found;

    for (std::size_t i = block * kBlock; i < std::min(cores.size(), (block + 1) * kBlock); ++i) {
      Distance& d = result[i];
      d.before = points_in_cylinder(surfaces.before, first, cores[i], normals[i], options, found);
      d.after = points_in_cylinder(surfaces.after, second, cores[i], normals[i], options, found);
      if (d.before.count < least || d.after.count < least) continue;
      d.shift_m = static_cast<float>(d.after.mean_m - d.before.mean_m);
      d.limit_m = static_cast<float>(detection_limit(d.before, d.after, registration_m));
    }
  });

  return result;
}

/// Standard error of the registration, from the median shifts of blocks of half a metre.
double registration_sigma(const std::vector<Eigen::Vector3f>& cores,
                          const std::vector<Eigen::Vector3f>& normals,
                          const std::vector<Distance>& distances) {
  constexpr double kBlock_m = 0.5;
  constexpr std::size_t kFewest = 20;  // core points of a block
  std::vector<std::pair<std::uint64_t, float>> ways;

  // Known shifts by block and direction
  for (std::size_t i = 0; i < cores.size(); ++i) {
    if (!distances[i].known()) continue;
    const Eigen::Vector3i cell = cloud::cell_of(cores[i].cast<double>() / kBlock_m);
    ways.emplace_back(cloud::pack_cell({6 * cell.x() + cloud::facing(normals[i]), cell.y(), cell.z()}),
                      distances[i].shift_m);
  }
  std::sort(ways.begin(), ways.end());

  // Blocks with few core points are too noisy
  std::vector<double> medians;
  for (std::size_t begin = 0, end = 0; begin < ways.size(); begin = end) {
    while (end < ways.size() && ways[end].first == ways[begin].first) ++end;
    if (end - begin >= kFewest)
      medians.push_back(std::abs(static_cast<double>(ways[(begin + end) / 2].second)));
  }

  // Most blocks have not changed: the 65th percentile of the absolute value of a normal error is 0.9346 sigma
  if (medians.size() < 5) return 0.0;
  const auto at = medians.begin() + static_cast<long>(0.65 * static_cast<double>(medians.size() - 1));
  std::nth_element(medians.begin(), at, medians.end());
  return *at / 0.9346;
}

}  // namespace plumbline::changes
