// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/local_mapping/viewing_cones.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace plumbline::mapping {
namespace {

constexpr double kZoneRad = 10.0 * 3.14159265358979323846 / 180.0;
constexpr double kLeastChanged = 0.05;  // share of the matches that D_r counts as, at least

double ratio(double a, double b) { return b > 0.0 ? a / b : 0.0; }

}  // namespace

int viewing_zone(double angle_rad) {
  for (int zone = 0; zone < 3; ++zone) {
    if (angle_rad <= (zone + 1) * kZoneRad) return zone;
  }
  return 3;
}

double viewing_angle(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                     const Eigen::Vector3d& camera_centre) {
  const Eigen::Vector3d ray = camera_centre - point;
  return std::atan2(normal.cross(ray).norm(), normal.dot(ray));
}

ConeThreshold cone_threshold(const ConeCounts& now, const ConeCounts& first, double epsilon, bool scaled) {
  const double m_c = now.matched;
  const double m_r = first.matched;
  const double d_c = now.changed;
  const double d_r = std::max<double>(first.changed, kLeastChanged * (scaled ? m_c : m_r));
  ConeThreshold t;
  t.theta = ratio(m_r - m_c, m_r);
  t.beta = ratio(d_c, m_c) - ratio(d_r, m_r);
  t.alpha = ratio(d_c, m_c) - 0.5;
  t.initial = 0.5 * (m_c * ratio(d_r, m_r) + now.all * ratio(d_r, first.all));
  t.adaptive = (1.0 + epsilon * t.theta - t.beta - t.alpha) * t.initial;
  return t;
}

void count_in_grid(const Eigen::Vector2d& pixel, int width, int height, GridCounts& grid) {
  const auto cell = [](double x, int size) {
    return std::clamp(static_cast<int>(std::floor(3.0 * x / size)), 0, 2);
  };
  ++grid[static_cast<std::size_t>(3 * cell(pixel.y(), height) + cell(pixel.x(), width))];
}

GridBalance grid_balance(const GridCounts& grid) {
  GridBalance balance;
  const auto first = std::max_element(grid.begin(), grid.end());
  auto second = grid.end();
  double sum = 0.0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  const auto place = [&](GridCounts::const_iterator cell) {
    const auto i = static_cast<int>(cell - grid.begin());
    return Eigen::Vector2d(i % 3 - 1, i / 3 - 1);
  };

  for (auto cell = grid.begin(); cell != grid.end(); ++cell) {
    if (cell != first && (second == grid.end() || *cell > *second)) second = cell;
    sum += *cell;
    centre += *cell * place(cell);
  }

  if (!(sum > 0.0)) return balance;

  // The ideal is 1: two equally full cells in opposite corners of the grid, 2 sqrt(2) cells apart.
  balance.ecog = (place(first) - place(second)).norm() * *second / (2.0 * std::sqrt(2.0) * *first);
  balance.offset = (centre / sum).norm();
  return balance;
}

bool balanced(const GridBalance& balance, Balance asked) {
  if (asked == Balance::kOff) return true;
  return asked == Balance::kAbove ? balance.ecog > balance.offset : balance.ecog < balance.offset;
}

}  // namespace plumbline::mapping
