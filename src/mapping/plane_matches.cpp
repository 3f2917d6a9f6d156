// SPDX-License-Identifier: BSD-3-Clause
#include "plane_matches.hpp"

#include <algorithm>
#include <cmath>

#include "plumbline/core/clones.hpp"

namespace plumbline::mapping {

void PlaneMatches::clear() {
  matches_.clear();
  size_ = 0;
}

void PlaneMatches::add(const Eigen::Vector3d& moved, const Eigen::Vector3d& normal, double distance,
                       double variance) {
  const std::size_t lane = size_++ % kLanes;
  if (lane == 0) matches_.emplace_back();
  Four& four = matches_.back();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    four.moved[axis][lane] = moved[axis];
    four.normal[axis][lane] = normal[axis];
  }
  four.distance[lane] = distance;
  four.inverse_variance[lane] = 1.0 / variance;
}

Eigen::Vector3d PlaneMatches::middle() const {
  Doubles sum[3] = {};
  for (const Four& four : matches_) {
    for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += four.moved[axis];  // what is no match lies at 0
  }
  Eigen::Vector3d middle;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    middle[axis] = (sum[axis][0] + sum[axis][1]) + (sum[axis][2] + sum[axis][3]);
  }
  return middle / static_cast<double>(size_);
}

double PlaneMatches::spread(const Eigen::Vector3d& middle) const {
  Doubles sum = {};
  for (const Four& four : matches_) {
    const Doubles x = four.moved[0] - middle.x();
    const Doubles y = four.moved[1] - middle.y();
    const Doubles z = four.moved[2] - middle.z();
    sum += four.inverse_variance > 0.0 ? x * x + y * y + z * z : Doubles{};
  }
  return std::sqrt(((sum[0] + sum[1]) + (sum[2] + sum[3])) / static_cast<double>(size_));
}

double PlaneMatches::median_error() const {
  std::vector<double> squares(kLanes * matches_.size());
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    const Four& four = matches_[i];
    const Doubles squared = four.distance * four.distance * four.inverse_variance;
    for (std::size_t lane = 0; lane < kLanes; ++lane) squares[kLanes * i + lane] = squared[lane];
  }
  squares.resize(size_);
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(size_ / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return std::sqrt(*middle);
}

PLUMBLINE_CLONES
MatchEquations PlaneMatches::equations(const Eigen::Vector3d& centre, double lever,
                                       const MatchLoss& loss) const {
  constexpr double kHuber = 1.345;
  constexpr double kTukey = 4.685;
  const double unit = 1.0 / (loss.scale * loss.scale);
  Doubles h[6][6] = {};
  Doubles g[6] = {};
  Doubles weights = {};
  Doubles squares = {};
  Longs inliers = {};
  for (const Four& four : matches_) {
    const Doubles squared = four.distance * four.distance * four.inverse_variance;
    const Doubles ratio2 = squared * unit;
    Doubles w;
    if (loss.narrow) {
      const Doubles rest = 1.0 - ratio2 / (kTukey * kTukey);
      w = rest > 0.0 ? rest * rest : Doubles{};
    } else {
      Doubles ratio;
      for (std::size_t lane = 0; lane < kLanes; ++lane) ratio[lane] = std::sqrt(ratio2[lane]);
      w = ratio <= kHuber ? Doubles{} + 1.0 : kHuber / ratio;
    }
    w *= four.inverse_variance;
    const Longs counts = w > 0.0;
    const Doubles x = (four.moved[0] - centre.x()) / lever;
    const Doubles y = (four.moved[1] - centre.y()) / lever;
    const Doubles z = (four.moved[2] - centre.z()) / lever;
    const Doubles j[6] = {four.normal[0],
                          four.normal[1],
                          four.normal[2],
                          y * four.normal[2] - z * four.normal[1],
                          z * four.normal[0] - x * four.normal[2],
                          x * four.normal[1] - y * four.normal[0]};
    for (std::size_t r = 0; r < 6; ++r) {
      const Doubles wj = w * j[r];
      for (std::size_t c = r; c < 6; ++c) h[r][c] += wj * j[c];
      g[r] += wj * four.distance;
    }
    weights += w;
    squares += counts ? squared : Doubles{};
    inliers -= counts;
  }
  MatchEquations result;
  for (int r = 0; r < 6; ++r) {
    for (int c = r; c < 6; ++c) {
      const Doubles& sum = h[r][c];
      result.h(r, c) = result.h(c, r) = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    }
    result.g(r) = (g[r][0] + g[r][1]) + (g[r][2] + g[r][3]);
  }
  result.weights = (weights[0] + weights[1]) + (weights[2] + weights[3]);
  result.squares = (squares[0] + squares[1]) + (squares[2] + squares[3]);
  result.inliers = static_cast<int>((inliers[0] + inliers[1]) + (inliers[2] + inliers[3]));
  return result;
}

}  // namespace plumbline::mapping
