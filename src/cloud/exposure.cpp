// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/exposure.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "scalar.hpp"
#include "voxel_key.hpp"

namespace plumbline::cloud {
namespace {

constexpr int kRounds = 20;
constexpr float kRobust = 0.15F;  // residuals of the logarithm beyond this weigh less
constexpr float kPrior = 3.0F;    // a view's gain is held at 1 by as much as this many cells
constexpr float kFewestPoints = 5.0F;
constexpr float kMostLog = 0.693F;

/// Red, green, blue, and nothing: four numbers are worked on at once.
using Tint = Eigen::Array4f;

/// A cell as a view saw it: index of the cell among all shared ones, and logarithms of its colour.
struct Sighting {
  Tint log_color;
  std::uint32_t cell;
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
      Tint log_color = Tint::Zero();
      log_color.head<3>() = cell.color.array().log();
      sightings[v].push_back({log_color, static_cast<std::uint32_t>(found - shared.begin())});
    }
  }
  return sightings;
}

Tint robust_weight(const Tint& residual) { return kRobust / residual.abs().max(kRobust); }

}  // namespace

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
  std::vector<Tint> gains(views.size(), Tint::Zero());  // logarithms
  std::vector<Tint> mean(count), weight(count);
  for (int round = 0; round < kRounds; ++round) {
    // The first round's means are not robust: there is nothing yet to measure residuals from.
    const std::vector<Tint> before = mean;
    std::fill(mean.begin(), mean.end(), Tint::Zero());
    std::fill(weight.begin(), weight.end(), Tint::Zero());
    for (std::size_t v = 0; v < views.size(); ++v) {
      for (const Sighting& s : sightings[v]) {
        const Tint value = s.log_color + gains[v];
        const Tint w = round == 0 ? Tint::Ones().eval() : robust_weight(value - before[s.cell]);
        mean[s.cell] += w * value;
        weight[s.cell] += w;
      }
    }
    for (std::size_t c = 0; c < count; ++c) mean[c] /= weight[c];
    Tint drift = Tint::Zero();
    for (std::size_t v = 0; v < views.size(); ++v) {
      Tint sum = Tint::Zero();
      Tint total = Tint::Constant(kPrior);
      for (const Sighting& s : sightings[v]) {
        const Tint wanted = mean[s.cell] - s.log_color;
        const Tint w = robust_weight(wanted - gains[v]);
        sum += w * wanted;
        total += w;
      }
      gains[v] = (sum / total).max(-kMostLog).min(kMostLog);
      drift += gains[v];
    }
    if (!views.empty()) drift /= static_cast<float>(views.size());
    for (Tint& gain : gains) gain -= drift;
  }
  std::vector<Eigen::Vector3f> factors;
  factors.reserve(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    factors.emplace_back(sightings[v].empty()
                             ? Eigen::Vector3f::Ones().eval()
                             : gains[v].head<3>().max(-kMostLog).min(kMostLog).exp().matrix().eval());
  }
  return factors;
}

void apply_gain(ViewPoints& points, const Eigen::Vector3f& gain) {
  const std::array<std::vector<std::uint8_t>*, 3> columns{&points.r, &points.g, &points.b};
  for (int k = 0; k < 3; ++k) {
    std::array<std::uint8_t, 256> brighter{};
    for (std::size_t value = 0; value < brighter.size(); ++value)
      brighter[value] = to_byte(static_cast<double>(gain[k] * static_cast<float>(value)));
    for (std::uint8_t& value : *columns[static_cast<std::size_t>(k)]) value = brighter[value];
  }
}

}  // namespace plumbline::cloud
