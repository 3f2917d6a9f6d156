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

/// What a view saw of a shared cell, or what a shared cell was to a view.
struct Sighting {
  Tint log_color;
  std::uint32_t other;  ///< the cell, or the view
};

/// Sightings of all views, and again of all cells, each in the order of the views.
struct Sightings {
  std::vector<std::vector<Sighting>> of_view;
  std::vector<Sighting> of_cells;
  std::vector<std::size_t> cell_begin;  ///< of each cell, into of_cells; one more at the end
  [[nodiscard]] std::size_t cells() const { return cell_begin.size() - 1; }
};

/// Calls body(i) for all i < count, many at a time.
template <typename Body>
void each(std::size_t count, std::size_t grain, const core::Executor& executor, const Body& body) {
  executor.parallel_for((count + grain - 1) / grain, [&](std::size_t part) {
    const std::size_t end = std::min(count, (part + 1) * grain);
    for (std::size_t i = part * grain; i < end; ++i) body(i);
  });
}

/// Cells that two views or more saw in colour, ascending.
std::vector<std::uint64_t> shared_cells(const std::vector<std::vector<ColorCell>>& views,
                                        const core::Executor& executor) {
  std::vector<std::uint64_t> keys;
  for (const auto& view : views) {
    for (const ColorCell& cell : view) {
      if (cell.points >= kFewestPoints) keys.push_back(cell.cell);
    }
  }
  const auto middle = keys.begin() + static_cast<std::ptrdiff_t>(keys.size() / 2);
  executor.parallel_for(2, [&](std::size_t half) {
    half == 0 ? std::sort(keys.begin(), middle) : std::sort(middle, keys.end());
  });
  std::inplace_merge(keys.begin(), middle, keys.end());
  std::vector<std::uint64_t> shared;
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i] == keys[i - 1] && (shared.empty() || shared.back() != keys[i])) shared.push_back(keys[i]);
  }
  return shared;
}

Sightings sightings_of(const std::vector<std::vector<ColorCell>>& views, const core::Executor& executor) {
  const std::vector<std::uint64_t> shared = shared_cells(views, executor);
  Sightings all;
  all.of_view.resize(views.size());
  executor.parallel_for(views.size(), [&](std::size_t v) {
    for (const ColorCell& cell : views[v]) {
      if (cell.points < kFewestPoints) continue;
      const auto found = std::lower_bound(shared.begin(), shared.end(), cell.cell);
      if (found == shared.end() || *found != cell.cell) continue;
      Tint log_color = Tint::Zero();
      log_color.head<3>() = cell.color.array().log();
      all.of_view[v].push_back({log_color, static_cast<std::uint32_t>(found - shared.begin())});
    }
  });
  all.cell_begin.assign(shared.size() + 1, 0);
  for (const auto& view : all.of_view) {
    for (const Sighting& s : view) ++all.cell_begin[s.other + 1];
  }
  for (std::size_t c = 0; c < shared.size(); ++c) all.cell_begin[c + 1] += all.cell_begin[c];
  all.of_cells.resize(all.cell_begin.back());
  std::vector<std::size_t> next(all.cell_begin.begin(), all.cell_begin.end() - 1);
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (const Sighting& s : all.of_view[v])
      all.of_cells[next[s.other]++] = {s.log_color, static_cast<std::uint32_t>(v)};
  }
  return all;
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

std::vector<Eigen::Vector3f> color_gains(const std::vector<std::vector<ColorCell>>& views,
                                         const core::Executor& executor) {
  constexpr std::size_t kCellsAtATime = 2048;
  constexpr std::size_t kViewsAtATime = 16;
  const Sightings sightings = sightings_of(views, executor);
  std::vector<Tint> gains(views.size(), Tint::Zero());  // logarithms
  std::vector<Tint> mean(sightings.cells());
  for (int round = 0; round < kRounds; ++round) {
    each(mean.size(), kCellsAtATime, executor, [&](std::size_t c) {
      Tint sum = Tint::Zero();
      Tint weight = Tint::Zero();
      for (std::size_t i = sightings.cell_begin[c]; i < sightings.cell_begin[c + 1]; ++i) {
        const Sighting& s = sightings.of_cells[i];
        const Tint value = s.log_color + gains[s.other];
        // The first round's means are not robust: there is nothing yet to measure residuals from.
        const Tint w = round == 0 ? Tint::Ones().eval() : robust_weight(value - mean[c]);
        sum += w * value;
        weight += w;
      }
      mean[c] = sum / weight;
    });
    each(views.size(), kViewsAtATime, executor, [&](std::size_t v) {
      Tint sum = Tint::Zero();
      Tint total = Tint::Constant(kPrior);
      for (const Sighting& s : sightings.of_view[v]) {
        const Tint wanted = mean[s.other] - s.log_color;
        const Tint w = robust_weight(wanted - gains[v]);
        sum += w * wanted;
        total += w;
      }
      gains[v] = (sum / total).max(-kMostLog).min(kMostLog);
    });
    Tint drift = Tint::Zero();
    for (const Tint& gain : gains) drift += gain;
    if (!views.empty()) drift /= static_cast<float>(views.size());
    for (Tint& gain : gains) gain -= drift;
  }
  std::vector<Eigen::Vector3f> factors;
  factors.reserve(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    factors.emplace_back(sightings.of_view[v].empty()
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
