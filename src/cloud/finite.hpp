// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Points without a measurement: their coordinates are NaN.
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "plumbline/cloud/types.hpp"

namespace plumbline::cloud {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

inline bool finite(const Point& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

inline std::size_t count_finite(const Cloud& cloud) {
  return static_cast<std::size_t>(std::count_if(cloud.begin(), cloud.end(), finite));
}

}  // namespace plumbline::cloud
