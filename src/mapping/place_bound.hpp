// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// How many pairs can fit a pose at most, told so fast that poses which cannot win need not be looked at.
#include <array>
#include <cstddef>
#include <vector>

#include "place_pose.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {

/// When a pair of points or lines fits a pose.
namespace pose_gate {
constexpr double kNear_m = 0.1;  ///< nothing nearer to the camera fits
constexpr double kPoint_px =
    4.5;  ///< at octave 0: 3 standard deviations of 1.5 px, the landmark's own among it
constexpr double kLine_px = 5.0;     ///< between the ends of one line and the other
constexpr double kLineCosine = 0.9;  ///< between their directions
inline double depth_m(double measured_m) { return 0.03 + 4.0 * sensor::depth_sigma(measured_m); }
}  // namespace pose_gate

class InlierBound {
 public:
  InlierBound(const PosePairs& pairs, const sensor::Pinhole& camera);
  /// No fewer than fit `query_from_match`, or a pose that lies within 0.1 px and 2 mm of it.
  [[nodiscard]] std::size_t of(const geometry::Rigid3& query_from_match) const;

 private:
  std::vector<double> points_;  ///< in columns: match x, y, z, query x, y, squared gate, depth, its gate
  std::vector<double> lines_;   ///< match's start and end (x, y, z each), query's (x, y each)
  std::size_t point_count_;
  std::size_t line_count_;
  std::array<double, 4> camera_;  ///< fx, fy, cx, cy
};

}  // namespace plumbline::mapping
