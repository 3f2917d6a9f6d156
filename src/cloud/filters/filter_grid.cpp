// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <pcl/filters/approximate_voxel_grid.h>
#include <pcl/filters/uniform_sampling.h>
#include <pcl/filters/voxel_grid.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "filters/filter_tools.hpp"
#include "plumbline/cloud/columns.hpp"

namespace plumbline::cloud {
namespace {

/// "" or why PCL's grids, which number their cells with 31 bits, cannot hold this cloud. PCL itself only
/// prints a warning and hands the cloud back unfiltered.
std::string check_extent(const Cloud& cloud, double leaf) {
  if (cloud.empty()) return "";
  Eigen::Vector3d min = cloud[0].getVector3fMap().cast<double>();
  Eigen::Vector3d max = min;
  for (const Point& p : cloud.points) {
    min = min.cwiseMin(p.getVector3fMap().cast<double>());
    max = max.cwiseMax(p.getVector3fMap().cast<double>());
  }

  // Cell numbers and coordinates must fit 31 bits
  constexpr double kMost = 2147483647.0;
  const Eigen::Array3d cells = ((max - min) / leaf).array().floor() + 2.0;
  const double furthest = std::max(max.cwiseAbs().maxCoeff(), min.cwiseAbs().maxCoeff()) / leaf;
  if (cells.prod() <= kMost && furthest < kMost / 4.0) return "";

  // The smallest leaf that fits, for the message
  double needed = leaf;
  const auto fits = [&](double l) {
    return (((max - min) / l).array().floor() + 2.0).prod() <= kMost && furthest * leaf / l < kMost / 4.0;
  };
  while (!fits(needed)) needed *= 1.1;

  const Eigen::Vector3d size = max - min;
  return fmt::format(
      "leaf {:g} m is too small for a cloud of {:.4g} x {:.4g} x {:.4g} m ({:.2g} cells, at most 2.1e9); "
      "use a leaf of {:.2g} m or more, or remove far points first (crop_box, pass_through)",
      leaf, size.x(), size.y(), size.z(), cells.prod(), needed);
}

/// Replaces unknown normals by 0, so that they do not spoil the mean normal of their cell. If all or none are
/// known, nothing is copied.
CloudConstPtr without_unknown_normals(const CloudConstPtr& cloud) {
  std::size_t known = 0;
  std::size_t curved = 0;
  for (const Point& p : cloud->points) {
    known += has_normal(p) ? 1U : 0U;
    curved += std::isfinite(p.curvature) ? 1U : 0U;
  }
  if ((known == 0 || known == cloud->size()) && curved == cloud->size()) return cloud;
  auto changed = std::make_shared<Cloud>(*cloud);
  for (Point& p : changed->points) {
    if (!has_normal(p)) p.normal_x = p.normal_y = p.normal_z = 0.0F;
    if (!std::isfinite(p.curvature)) p.curvature = 0.0F;
  }
  return changed;
}

/// Unit normals again; NaN where no point of the cell had one.
void restore_normals(Cloud& cloud) {
  for (Point& p : cloud.points) {
    const float length = p.getNormalVector3fMap().norm();
    const float scale = length > 1e-6F ? 1.0F / length : std::numeric_limits<float>::quiet_NaN();
    p.getNormalVector3fMap() *= scale;
  }
}

/// Number of the cell of every point as PCL's VoxelGrid has it: its output is sorted by that.
std::vector<std::int64_t> cells_of(const Cloud& points, float leaf) {
  const float inverse = 1.0F / leaf;
  const auto cell = [inverse](float v) { return static_cast<std::int64_t>(std::floor(v * inverse)); };

  // Smallest and largest cell along each axis
  std::array<std::int64_t, 3> least{};
  std::array<std::int64_t, 3> most{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [min, max] =
        std::minmax_element(points.begin(), points.end(),
                            [axis](const auto& a, const auto& b) { return a.data[axis] < b.data[axis]; });
    least[axis] = cell(min->data[axis]);
    most[axis] = cell(max->data[axis]);
  }

  // Cells are numbered along x, then y, then z
  const std::int64_t across = most[0] - least[0] + 1;
  const std::int64_t layer = across * (most[1] - least[1] + 1);
  std::vector<std::int64_t> cells;
  cells.reserve(points.size());
  for (const Point& p : points.points) {
    cells.push_back(cell(p.x) - least[0] + (cell(p.y) - least[1]) * across + (cell(p.z) - least[2]) * layer);
  }

  return cells;
}

/// One row for every cell of at least `least` points, in the order of the cells: the means, the most
/// observations, the first robot.
CloudColumns mean_columns(const CloudColumns& columns, const std::vector<std::int64_t>& cells,
                          std::size_t least) {
  // Points of one cell next to each other, in their order
  std::vector<std::size_t> order(cells.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return cells[a] < cells[b]; });

  // Each run of equal cells is one row
  std::vector<std::size_t> firsts;
  std::vector<std::pair<std::size_t, std::size_t>> runs;  // of `order`
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && cells[order[end]] == cells[order[begin]]) ++end;
    if (end - begin < least) continue;
    firsts.push_back(order[begin]);
    runs.emplace_back(begin, end);
  }

  // Means replace the values of the first point
  CloudColumns result = pick_columns(columns, firsts);
  const auto mean = [&](const std::vector<float>& from, std::vector<float>& to) {
    for (std::size_t r = 0; r < to.size(); ++r) {
      double sum = 0.0;
      for (std::size_t k = runs[r].first; k < runs[r].second; ++k) sum += static_cast<double>(from[order[k]]);
      to[r] = static_cast<float>(sum / static_cast<double>(runs[r].second - runs[r].first));
    }
  };

  mean(columns.confidence, result.confidence);
  for (std::size_t o = 0; o < result.others.size(); ++o)
    mean(columns.others[o].values, result.others[o].values);

  // A cell was observed as often as its best point
  for (std::size_t r = 0; r < result.observations.size(); ++r) {
    for (std::size_t k = runs[r].first; k < runs[r].second; ++k) {
      result.observations[r] = std::max(result.observations[r], columns.observations[order[k]]);
    }
  }

  return result;
}

class GridFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.number("leaf", leaf_m_, {1e-4, 1000.0}, "m", "Edge length of a cell");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    const CloudConstPtr points = finite_list(input);

    // PCL would return such a cloud unfiltered
    const std::string problem = check_extent(*points, leaf_m_);
    if (!problem.empty()) return core::usage_error(problem);
    if (points->empty()) return like(*input);
    CloudPtr output = resample(points);

    // The sensor pose remains that of the input
    output->sensor_origin_ = input->sensor_origin_;
    output->sensor_orientation_ = input->sensor_orientation_;
    make_list(*output);
    if (context.columns != nullptr && context.made_columns != nullptr && !context.columns->empty()) {
      *context.made_columns = columns(*points, carry_columns(*input, *context.columns, *points));
    }
    return output;
  }

 protected:
  /// Columns of the resampled points if they are not a subset of the input's.
  [[nodiscard]] virtual CloudColumns columns(const Cloud& /*points*/, const CloudColumns& /*all*/) const {
    return {};
  }

  /// `points`: finite, not empty.
  virtual CloudPtr resample(const CloudConstPtr& points) const = 0;
  [[nodiscard]] float leaf() const { return static_cast<float>(leaf_m_); }
  /// Cells are numbered from the origin, the same in every part of a cloud.
  [[nodiscard]] double cell_diagonal_m() const { return leaf_m_ * std::sqrt(3.0); }

 private:
  double leaf_m_ = 0.01;
};

class VoxelGridFilter : public GridFilter {
 public:
  void declare(core::OptionTable& table) override {
    GridFilter::declare(table);
    table.integer("min_points", min_points_, {1, 100000}, "", "Remove cells with fewer points");
  }
  [[nodiscard]] std::optional<double> reach_m() const override { return cell_diagonal_m(); }
  CloudPtr resample(const CloudConstPtr& points) const override {
    pcl::VoxelGrid<Point> grid;
    grid.setLeafSize(leaf(), leaf(), leaf());
    grid.setMinimumPointsNumberPerVoxel(static_cast<unsigned>(min_points_));

    // Unknown normals must not spoil a cell's mean
    CloudPtr output = filtered_by(grid, without_unknown_normals(points));
    restore_normals(*output);
    return output;
  }
  [[nodiscard]] CloudColumns columns(const Cloud& points, const CloudColumns& all) const override {
    return mean_columns(all, cells_of(points, leaf()), static_cast<std::size_t>(min_points_));
  }

 private:
  int min_points_ = 1;
};

class ApproximateVoxelGridFilter : public GridFilter {
 public:
  CloudPtr resample(const CloudConstPtr& points) const override {
    pcl::ApproximateVoxelGrid<Point> grid;
    grid.setLeafSize(leaf(), leaf(), leaf());

    // Unknown normals must not spoil a cell's mean
    CloudPtr output = filtered_by(grid, without_unknown_normals(points));
    restore_normals(*output);
    return output;
  }
};

class UniformSamplingFilter : public GridFilter {
 public:
  [[nodiscard]] std::optional<double> reach_m() const override { return cell_diagonal_m(); }
  /// PCL gives the points in the order of a hash table; here they stay in the order of the input.
  CloudPtr resample(const CloudConstPtr& points) const override {
    pcl::UniformSampling<Point> sampling(true);
    sampling.setRadiusSearch(static_cast<double>(leaf()));
    filtered_by(sampling, points);
    std::vector<bool> removed(points->size(), false);
    for (const auto index : *sampling.getRemovedIndices()) removed[static_cast<std::size_t>(index)] = true;
    auto output = std::make_shared<Cloud>();
    for (std::size_t i = 0; i < points->size(); ++i) {
      if (!removed[i]) output->points.push_back((*points)[i]);
    }
    return output;
  }
};

}  // namespace

FilterInfo voxel_grid_filter() {
  return {
      "voxel_grid", "Replaces the points of every grid cell by their mean.",
      "PCL's VoxelGrid: positions, normals and colours are averaged; so are the other columns, but a cell "
      "has the most observations of its points and the robot of the first. If there are too many cells to "
      "number, for which PCL would warn and return the cloud unfiltered, the error names a leaf size that "
      "fits.",
      "- type: voxel_grid\n  leaf: 1 cm\n", [] { return std::make_unique<VoxelGridFilter>(); }};
}

FilterInfo approximate_voxel_grid_filter() {
  return {"approximate_voxel_grid", "Like voxel_grid in one pass; a cell may give more than one point.",
          "PCL's ApproximateVoxelGrid: faster on clouds whose neighbours in space are neighbours in memory.",
          "- type: approximate_voxel_grid\n  leaf: 1 cm\n",
          [] { return std::make_unique<ApproximateVoxelGridFilter>(); }};
}

FilterInfo uniform_sampling_filter() {
  return {"uniform_sampling", "Keeps of every grid cell the point nearest to its centre.",
          "PCL's UniformSampling: points are chosen, never averaged. They stay in the order of the input.",
          "- type: uniform_sampling\n  leaf: 2 cm\n",
          [] { return std::make_unique<UniformSamplingFilter>(); }};
}

}  // namespace plumbline::cloud
