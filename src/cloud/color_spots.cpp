// SPDX-License-Identifier: BSD-3-Clause
// Mean places and colours of small cubes of a view.
#include <algorithm>
#include <array>
#include <cmath>

#include "plumbline/cloud/exposure.hpp"
#include "plumbline/cloud/sum_table.hpp"
#include "plumbline/core/clones.hpp"
#include "voxel_key.hpp"

namespace plumbline::cloud {
namespace {

constexpr std::size_t kBlock = 256;  // points at a time
constexpr float kSpot_m = 0.05F;
constexpr float kFar_m = 1e4F;
constexpr int kDark = 12;
constexpr int kBright = 245;

/// Of a small cube.
struct SpotSum {
  std::uint64_t key = 0;
  Eigen::Vector3f point{0, 0, 0};
  Eigen::Vector3f color{0, 0, 0};
  float count = 0.0F;
  float colored = 0.0F;
};

/// Where coordinates lie in a grid of cubes; all of them far away: 0.
PLUMBLINE_CLONES void cubes_of(const float* at_m, std::size_t count, std::int32_t* cubes) {
  for (std::size_t i = 0; i < count; ++i) {
    const float at = (std::abs(at_m[i]) < kFar_m ? at_m[i] : 0.0F) / kSpot_m;
    // A cast and a step: there is no instruction for floor() on every machine.
    const auto cube = static_cast<std::int32_t>(at);
    cubes[i] = cube - (at < static_cast<float>(cube) ? 1 : 0);
  }
}

/// Which colours are neither dark nor saturated.
PLUMBLINE_CLONES void find_colored(const std::uint8_t* r, const std::uint8_t* g, const std::uint8_t* b,
                                   std::size_t count, std::uint8_t* colored) {
  for (std::size_t i = 0; i < count; ++i) {
    const bool dark = (r[i] < kDark) | (g[i] < kDark) | (b[i] < kDark);
    const bool bright = (r[i] > kBright) | (g[i] > kBright) | (b[i] > kBright);
    colored[i] = dark | bright ? 0 : 1;
  }
}

}  // namespace

std::vector<ColorSpot> color_spots(const ViewPoints& points) {
  SumTable<SpotSum> table;
  std::array<std::array<std::int32_t, kBlock>, 3> cubes;
  std::array<std::uint8_t, kBlock> colored;
  for (std::size_t first = 0; first < points.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, points.size() - first);
    const float *x = points.x.data() + first, *y = points.y.data() + first, *z = points.z.data() + first;
    const std::uint8_t *r = points.r.data() + first, *g = points.g.data() + first,
                       *b = points.b.data() + first;
    cubes_of(x, count, cubes[0].data());
    cubes_of(y, count, cubes[1].data());
    cubes_of(z, count, cubes[2].data());
    find_colored(r, g, b, count, colored.data());
    for (std::size_t i = 0; i < count; ++i) {
      if (!(std::abs(x[i]) < kFar_m && std::abs(y[i]) < kFar_m && std::abs(z[i]) < kFar_m)) continue;
      SpotSum& sum = table.of(pack_cell({cubes[0][i], cubes[1][i], cubes[2][i]}));
      sum.point += Eigen::Vector3f(x[i], y[i], z[i]);
      sum.count += 1.0F;
      if (colored[i] == 0) continue;
      sum.color += Eigen::Vector3f(r[i], g[i], b[i]);
      sum.colored += 1.0F;
    }
  }
  std::vector<ColorSpot> spots;
  spots.reserve(table.sums().size());
  for (const SpotSum& sum : table.sums()) {
    spots.push_back({sum.point / sum.count, sum.color / std::max(1.0F, sum.colored), sum.colored});
  }
  return spots;
}

std::vector<ColorSpot> color_spots(const Cloud& camera_cloud) {
  ViewPoints points;
  take_points(camera_cloud, points);
  return color_spots(points);
}

}  // namespace plumbline::cloud
