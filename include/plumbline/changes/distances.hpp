// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Signed distances between two clouds along normals, each with its detection limit: M3C2 (Lague, Brodu,
// Leroux, "Accurate 3D comparison of complex topography with terrestrial laser scanner", ISPRS Journal 82,
// 2013).
#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "plumbline/core/executor.hpp"

namespace plumbline::changes {

/// A measured surface; metres. Points are finite.
struct Surface {
  std::vector<Eigen::Vector3f> points;
  std::vector<Eigen::Vector3f> normals;  ///< unit, one a point
  bool oriented = true;                  ///< normals point to the side that the surface was seen from
};

/// The same place on two days, in one frame. The surfaces must outlive this.
struct SurfacePair {
  const Surface& before;
  const Surface& after;
};

struct DistanceOptions {
  double diameter_m = 0.1;  ///< of the cylinder whose points are averaged
  double depth_m = 0.08;    ///< half its length: the largest distance
  int min_points = 4;       ///< of each cloud, in a cylinder
};

/// Points of one cloud in a cylinder along a normal, of those that face the same way within 60 degrees.
struct CylinderPoints {
  std::uint32_t count = 0;
  double mean_m = 0.0;   ///< along the normal, from the core point
  double sigma_m = 0.0;  ///< standard deviation along the normal: the roughness
};

/// At one core point.
struct Distance {
  CylinderPoints before, after;
  float shift_m =
      std::numeric_limits<float>::quiet_NaN();  ///< along the normal; NaN: one cloud has too few points
  float limit_m = std::numeric_limits<float>::quiet_NaN();  ///< 95 % detection limit
  [[nodiscard]] bool known() const { return std::isfinite(shift_m); }
};

/// 1.96 (sqrt(s1^2 / n1 + s2^2 / n2) + registration), after Lague et al., equation 1.
double detection_limit(const CylinderPoints& before, const CylinderPoints& after, double registration_m);

/// Distances at `cores` with their `normals`. `registration_m`: standard deviation of how the two clouds are
/// laid together. The same for any number of threads.
std::vector<Distance> distances(const std::vector<Eigen::Vector3f>& cores,
                                const std::vector<Eigen::Vector3f>& normals, const SurfacePair& surfaces,
                                double registration_m, const DistanceOptions& options,
                                const core::Executor& executor);

/// Standard deviation of the registration as places tell it: of the medians of blocks of half a metre, each
/// facing one way, 65 % lie within 0.93 of it. A third of all surface may have changed. 0 if there are fewer
/// than five blocks.
double registration_sigma(const std::vector<Eigen::Vector3f>& cores,
                          const std::vector<Eigen::Vector3f>& normals,
                          const std::vector<Distance>& distances);

}  // namespace plumbline::changes
