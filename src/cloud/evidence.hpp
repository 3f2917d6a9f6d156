// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a view says about many places.
#include <Eigen/Core>
#include <cstddef>

#include "plumbline/cloud/free_space.hpp"

namespace plumbline::cloud {

/// evidence() of places in the world.
class Asking {
 public:
  Asking(const DepthRaster& raster, const Eigen::Matrix3f& camera_from_world,
         const Eigen::Vector3f& translation);
  /// `x`, `y`, `z`: metres, world. Into `found`: an entry for each.
  void ask(const float* x, const float* y, const float* z, std::size_t count, Evidence* found) const;

  struct Projection {
    float rotation[9];  ///< row after row
    float translation[3];
    float fx, fy, cx, cy;
    float furthest_m;
    float last_column, last_row;
    std::int32_t width;
  };

 private:
  const DepthRaster& raster_;
  Projection projection_;
};

}  // namespace plumbline::cloud
