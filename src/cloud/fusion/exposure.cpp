// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/fusion/exposure.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>

#include "io/scalar.hpp"
#include "plumbline/cloud/fusion/cell_map.hpp"

namespace plumbline::cloud {
namespace {

constexpr int kExposureRounds = 20;
constexpr float kRobustResidual = 0.15F;  // residuals of the logarithm beyond this weigh less
constexpr float kPrior = 3.0F;            // a view's gain is held at 1 by as much as this many cells
constexpr float kFewestPoints = 5.0F;
constexpr float kMostLog = 0.693F;
constexpr int kDark = 12;
constexpr int kBright = 245;

/// Mean colour of one view in a cell.
struct CellColor {
  std::uint64_t cell = 0;
  std::uint32_t view = 0;
  Eigen::Array3f log_color;
  Eigen::Array3f weight = Eigen::Array3f::Ones();
};

/// Number of cells that `view` saw in colour.
std::size_t count_colored(const std::vector<ColorCell>& view) {
  return static_cast<std::size_t>(
      std::count_if(view.begin(), view.end(), [](const auto& cell) { return cell.points >= kFewestPoints; }));
}

/// Colours of the cells that at least two views saw, cell by cell. There are thousands for each view, so the
/// list is allocated once, and sorted and thinned in place.
std::vector<CellColor> shared_colors(const std::vector<std::vector<ColorCell>>& views) {
  std::size_t count = 0;
  for (const auto& view : views) count += count_colored(view);
  std::vector<CellColor> all;
  all.reserve(count);

  // The mean colour of few points is too noisy
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (const ColorCell& cell : views[v]) {
      if (cell.points < kFewestPoints) continue;
      all.push_back({cell.cell, static_cast<std::uint32_t>(v), cell.color.array().log(), {1, 1, 1}});
    }
  }

  // Colours of one cell next to each other
  std::sort(all.begin(), all.end(), [](const CellColor& a, const CellColor& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.view < b.view;
  });

  // A cell in a single view says nothing about exposure
  auto kept = all.begin();
  for (auto first = all.begin(), end = first; first != all.end(); first = end) {
    end = std::find_if(first, all.end(), [&](const CellColor& c) { return c.cell != first->cell; });
    if (end - first == 1) continue;
    kept = kept == first ? end : std::move(first, end, kept);
  }

  all.erase(kept, all.end());
  return all;
}

Eigen::Array3f robust_weight(const Eigen::Array3f& residual) {
  return kRobustResidual / residual.abs().max(kRobustResidual);
}

}  // namespace

std::vector<ColorCell> color_cells(const Cloud& camera_cloud, const geometry::Rigid3& world_from_camera,
                                   double cell_m) {
  CellMap<ColorCell> sums;
  const Eigen::Matrix3f turn = (world_from_camera.rotation / cell_m).cast<float>();
  const Eigen::Vector3f shift = (world_from_camera.translation / cell_m).cast<float>();
  ColorCell* last = nullptr;
  for (const Point& p : camera_cloud.points) {
    const Eigen::Vector3f at = turn * p.getVector3fMap() + shift;
    if (!(at.cwiseAbs().maxCoeff() < 1e6F)) continue;

    // Neighbours in an image mostly share their cell.
    const std::uint64_t key = pack_cell(at.array().floor().cast<int>());
    if (last == nullptr || last->cell != key) last = &sums[key];
    last->cell = key;

    // Dark and saturated colours do not show the exposure
    const auto [least, most] = std::minmax({p.r, p.g, p.b});
    if (least < kDark || most > kBright) continue;
    last->color += Eigen::Vector3f(p.r, p.g, p.b);
    last->points += 1.0F;
  }

  // Means in the order of the cells
  std::vector<ColorCell> cells;
  cells.reserve(sums.size());
  for (const auto& [key, sum] : sums)
    cells.push_back({key, sum.color / std::max(1.0F, sum.points), sum.points});
  std::sort(cells.begin(), cells.end(),
            [](const ColorCell& a, const ColorCell& b) { return a.cell < b.cell; });
  return cells;
}

std::vector<Eigen::Vector3f> color_gains(const std::vector<std::vector<ColorCell>>& views) {
  std::vector<CellColor> colors = shared_colors(views);
  struct Sum {
    Eigen::Array3f log_gain = Eigen::Array3f::Zero();
    Eigen::Array3f wanted = Eigen::Array3f::Zero();
    Eigen::Array3f weight = Eigen::Array3f::Zero();
  };

  std::vector<Sum> of_views(views.size());
  for (int round = 0; round < kExposureRounds; ++round) {
    // The prior keeps views without shared cells unchanged
    for (Sum& view : of_views) {
      view.wanted.setZero();
      view.weight.setConstant(kPrior);
    }

    // Mean colour of a cell with the present gains
    for (std::size_t first = 0, end = 0; first < colors.size(); first = end) {
      Eigen::Array3f sum = Eigen::Array3f::Zero();
      Eigen::Array3f weight = Eigen::Array3f::Zero();
      for (end = first; end < colors.size() && colors[end].cell == colors[first].cell; ++end) {
        const CellColor& s = colors[end];
        sum += s.weight * (s.log_color + of_views[s.view].log_gain);
        weight += s.weight;
      }

      const Eigen::Array3f mean = sum / weight;

      // Gain that each view needs; outliers count less
      for (std::size_t i = first; i < end; ++i) {
        CellColor& s = colors[i];
        Sum& view = of_views[s.view];
        const Eigen::Array3f wanted = mean - s.log_color;
        s.weight = robust_weight(wanted - view.log_gain);
        view.wanted += s.weight * wanted;
        view.weight += s.weight;
      }
    }

    // Only ratios are observable: the mean gain is 1
    Eigen::Array3f drift = Eigen::Array3f::Zero();
    for (Sum& view : of_views) {
      view.log_gain = (view.wanted / view.weight).max(-kMostLog).min(kMostLog);
      drift += view.log_gain;
    }

    if (!views.empty()) drift /= static_cast<float>(views.size());
    for (Sum& view : of_views) view.log_gain -= drift;
  }

  // Limited again, since the mean was subtracted
  std::vector<Eigen::Vector3f> factors(views.size(), Eigen::Vector3f::Ones());
  for (const CellColor& s : colors)
    factors[s.view] = of_views[s.view].log_gain.max(-kMostLog).min(kMostLog).exp();
  return factors;
}

void apply_gain(Cloud& cloud, const Eigen::Vector3f& gain) {
  for (Point& p : cloud.points) {
    p.r = to_byte(static_cast<double>(gain[0] * static_cast<float>(p.r)));
    p.g = to_byte(static_cast<double>(gain[1] * static_cast<float>(p.g)));
    p.b = to_byte(static_cast<double>(gain[2] * static_cast<float>(p.b)));
  }
}

}  // namespace plumbline::cloud
