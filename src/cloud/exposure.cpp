// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/exposure.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

#include "plumbline/cloud/sum_table.hpp"
#include "scalar.hpp"
#include "voxel_key.hpp"

namespace plumbline::cloud {
namespace {

constexpr int kRounds = 20;
constexpr float kRobust = 0.15F;  // residuals of the logarithm beyond this weigh less
constexpr float kPrior = 3.0F;    // a view's gain is held at 1 by as much as this many cells
constexpr float kFewestPoints = 5.0F;
constexpr float kMostLog = 0.693F;

/// A cell as a view saw it: index of the cell among all shared ones, and logarithms of its colour.
struct Sighting {
  std::uint32_t cell;
  Eigen::Array3f log_color;
};

/// Keeps cells that two views or more saw in colour, numbered from 0.
std::vector<std::vector<Sighting>> shared_cells(const std::vector<std::vector<ColorCell>>& views,
                                                std::size_t& count) {
  std::vector<std::uint64_t> keys;
  for (const auto& view : views) {
    for (const ColorCell& cell : view) {
      if (cell.points >= kFewestPoints) keys.push_back(cell.cell);
    }
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint64_t> shared;
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i] == keys[i - 1] && (shared.empty() || shared.back() != keys[i])) shared.push_back(keys[i]);
  }
  count = shared.size();
  std::vector<std::vector<Sighting>> sightings(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (const ColorCell& cell : views[v]) {
      if (cell.points < kFewestPoints) continue;
      const auto found = std::lower_bound(shared.begin(), shared.end(), cell.cell);
      if (found == shared.end() || *found != cell.cell) continue;
      sightings[v].push_back({static_cast<std::uint32_t>(found - shared.begin()), cell.color.array().log()});
    }
  }
  return sightings;
}

Eigen::Array3f robust_weight(const Eigen::Array3f& residual) { return kRobust / residual.abs().max(kRobust); }

/// Of a small cube.
struct SpotSum {
  std::uint64_t key = 0;
  Eigen::Vector3f point{0, 0, 0};
  Eigen::Vector3f color{0, 0, 0};
  float count = 0.0F;
  float colored = 0.0F;
};

}  // namespace

std::vector<ColorSpot> color_spots(const Cloud& camera_cloud) {
  constexpr float kSpot_m = 0.05F;
  constexpr float kFar_m = 1e4F;
  constexpr int kDark = 12;
  constexpr int kBright = 245;
  SumTable<SpotSum> table;
  for (const Point& p : camera_cloud.points) {
    if (!(p.getVector3fMap().cwiseAbs().maxCoeff() < kFar_m)) continue;
    const Eigen::Vector3f point = p.getVector3fMap();
    SpotSum& sum = table.of(pack_cell((point / kSpot_m).array().floor().cast<int>()));
    sum.point += point;
    sum.count += 1.0F;
    const auto [dark, bright] = std::minmax({p.r, p.g, p.b});
    if (dark < kDark || bright > kBright) continue;
    sum.color += Eigen::Vector3f(p.r, p.g, p.b);
    sum.colored += 1.0F;
  }
  std::vector<ColorSpot> spots;
  spots.reserve(table.sums().size());
  for (const SpotSum& sum : table.sums()) {
    spots.push_back({sum.point / sum.count, sum.color / std::max(1.0F, sum.colored), sum.colored});
  }
  return spots;
}

std::vector<ColorCell> color_cells(const std::vector<ColorSpot>& spots,
                                   const geometry::Rigid3& world_from_camera, double cell_m) {
  const Eigen::Matrix3f rotation = (world_from_camera.rotation / cell_m).cast<float>();
  const Eigen::Vector3f translation = (world_from_camera.translation / cell_m).cast<float>();
  std::vector<ColorCell> all;
  all.reserve(spots.size());
  for (const ColorSpot& spot : spots) {
    const Eigen::Vector3f at = rotation * spot.point + translation;
    if (!(at.cwiseAbs().maxCoeff() < 1e6F)) continue;
    all.push_back({pack_cell(at.array().floor().cast<int>()), spot.points * spot.color, spot.points});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const ColorCell& a, const ColorCell& b) { return a.cell < b.cell; });
  std::vector<ColorCell> cells;
  for (const ColorCell& one : all) {
    if (cells.empty() || cells.back().cell != one.cell) {
      cells.push_back(one);
      continue;
    }
    cells.back().color += one.color;
    cells.back().points += one.points;
  }
  for (ColorCell& cell : cells) {
    if (cell.points > 0.0F) cell.color /= cell.points;
  }
  return cells;
}

std::vector<Eigen::Vector3f> color_gains(const std::vector<std::vector<ColorCell>>& views) {
  std::size_t count = 0;
  const auto sightings = shared_cells(views, count);
  std::vector<Eigen::Array3f> gains(views.size(), Eigen::Array3f::Zero());  // logarithms
  std::vector<Eigen::Array3f> mean(count), weight(count);
  for (int round = 0; round < kRounds; ++round) {
    // The first round's means are not robust: there is nothing yet to measure residuals from.
    const std::vector<Eigen::Array3f> before = mean;
    std::fill(mean.begin(), mean.end(), Eigen::Array3f::Zero());
    std::fill(weight.begin(), weight.end(), Eigen::Array3f::Zero());
    for (std::size_t v = 0; v < views.size(); ++v) {
      for (const Sighting& s : sightings[v]) {
        const Eigen::Array3f value = s.log_color + gains[v];
        const Eigen::Array3f w =
            round == 0 ? Eigen::Array3f::Ones().eval() : robust_weight(value - before[s.cell]);
        mean[s.cell] += w * value;
        weight[s.cell] += w;
      }
    }
    for (std::size_t c = 0; c < count; ++c) mean[c] /= weight[c];
    Eigen::Array3f drift = Eigen::Array3f::Zero();
    for (std::size_t v = 0; v < views.size(); ++v) {
      Eigen::Array3f sum = Eigen::Array3f::Zero();
      Eigen::Array3f total = Eigen::Array3f::Constant(kPrior);
      for (const Sighting& s : sightings[v]) {
        const Eigen::Array3f wanted = mean[s.cell] - s.log_color;
        const Eigen::Array3f w = robust_weight(wanted - gains[v]);
        sum += w * wanted;
        total += w;
      }
      gains[v] = (sum / total).max(-kMostLog).min(kMostLog);
      drift += gains[v];
    }
    if (!views.empty()) drift /= static_cast<float>(views.size());
    for (Eigen::Array3f& gain : gains) gain -= drift;
  }
  std::vector<Eigen::Vector3f> factors;
  factors.reserve(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    factors.emplace_back(sightings[v].empty() ? Eigen::Vector3f::Ones().eval()
                                              : gains[v].max(-kMostLog).min(kMostLog).exp().matrix().eval());
  }
  return factors;
}

void apply_gain(Cloud& cloud, const Eigen::Vector3f& gain) {
  for (Point& p : cloud.points) {
    p.r = to_byte(static_cast<double>(gain.x() * static_cast<float>(p.r)));
    p.g = to_byte(static_cast<double>(gain.y() * static_cast<float>(p.g)));
    p.b = to_byte(static_cast<double>(gain.z() * static_cast<float>(p.b)));
  }
}

}  // namespace plumbline::cloud
