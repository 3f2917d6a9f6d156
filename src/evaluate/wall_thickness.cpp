// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/evaluate/wall_thickness.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "layers.hpp"
#include "plumbline/core/random.hpp"
#include "plumbline/evaluate/statistics.hpp"
#include "surfaces/point_index.hpp"

namespace plumbline::evaluate {
namespace {

using Points = std::vector<Eigen::Vector3f>;
using PointIndices = std::vector<std::uint32_t>;
using Voxel = std::array<std::int64_t, 3>;
using Voxels = std::map<Voxel, PointIndices>;  ///< voxels that hold points, ordered by x, y, z

constexpr std::size_t kLeastPatchPoints = 20;
constexpr std::size_t kLeastCellPoints = 8;
constexpr double kLeastMainShare = 0.3;  // a doubled wall's main layer may hold less than half of the points
constexpr double kLeastCoverage = 0.75;  // of the patch's cells
constexpr double kLeastFitReach = 5e-4;  // m, of the fit
constexpr double kSlack = 1e-4;          // m, for layers exactly max_spacing_m apart

struct LocalPlane {
  Eigen::Vector3d normal;
  Eigen::Vector3d center;
  [[nodiscard]] double height(const Eigen::Vector3f& p) const {
    return normal.dot(p.cast<double>() - center);
  }
};

/// Least squares for one layer, or for two parallel ones with a common normal; goes through the fuller one.
LocalPlane fitted(const Points& points, const PointIndices& some, const LocalPlane& before) {
  // Both layers share a normal
  std::vector<double> heights;
  for (const std::uint32_t i : some) heights.push_back(before.height(points[i]));
  const Layers layers = split_layers(heights);
  const double border = layers.two ? layers.border : std::numeric_limits<double>::infinity();

  // Each layer has its own mean
  std::array<Eigen::Vector3d, 2> mean = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::array<double, 2> count = {0.0, 0.0};
  const auto layer = [&](std::uint32_t i) { return before.height(points[i]) < border ? std::size_t{0} : 1; };
  for (const std::uint32_t i : some) {
    mean[layer(i)] += points[i].cast<double>();
    count[layer(i)] += 1.0;
  }
  for (std::size_t k = 0; k < 2; ++k) mean[k] /= std::max(count[k], 1.0);

  // Scatter about the layers' means
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::uint32_t i : some) {
    const Eigen::Vector3d d = points[i].cast<double>() - mean[layer(i)];
    scatter += d * d.transpose();
  }

  // The fuller layer gives the position
  Eigen::Vector3d normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
  if (normal.dot(before.normal) < 0.0) normal = -normal;
  return {normal, count[0] > count[1] ? mean[0] : mean[1]};
}

PointIndices within(const Points& points, const PointIndices& some, const LocalPlane& plane, double reach) {
  PointIndices inside;
  for (const std::uint32_t i : some) {
    if (std::abs(plane.height(points[i])) <= reach) inside.push_back(i);
  }
  return inside;
}

/// MSAC over at most 400 of the points.
std::optional<LocalPlane> main_plane(const Points& points, const PointIndices& voxel, double flatness_m,
                                     core::SplitMix draw) {
  constexpr int kTrials = 80;

  // At most 400 points
  PointIndices some;
  const std::size_t stride = (voxel.size() + 399) / 400;
  for (std::size_t i = 0; i < voxel.size(); i += stride) some.push_back(voxel[i]);

  // Planes through three random points
  double best_cost = static_cast<double>(some.size()) * flatness_m * flatness_m;
  std::optional<LocalPlane> best;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Eigen::Vector3d a = points[some[draw.below(some.size())]].cast<double>();
    const Eigen::Vector3d b = points[some[draw.below(some.size())]].cast<double>();
    const Eigen::Vector3d c = points[some[draw.below(some.size())]].cast<double>();
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double area = normal.norm();
    if (area < flatness_m * flatness_m) continue;  // too small a triangle to hold a plane

    const LocalPlane plane{normal / area, a};

    // Truncated squares: MSAC's cost
    double cost = 0.0;
    for (const std::uint32_t i : some) {
      const double h = plane.height(points[i]);
      cost += std::min(h * h, flatness_m * flatness_m);
    }

    // The plane with the least cost
    if (cost < best_cost) {
      best_cost = cost;
      best = plane;
    }
  }
  return best;
}

/// Points by cubic cell; huge coordinates are clamped.
Voxels voxels_of(const Points& points, double edge_m) {
  Voxels voxels;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Array3d at = (points[i].cast<double>() / edge_m).array().floor().max(-1e15).min(1e15);
    const Eigen::Array<std::int64_t, 3, 1> cell = at.cast<std::int64_t>();
    voxels[{cell.x(), cell.y(), cell.z()}].push_back(static_cast<std::uint32_t>(i));
  }
  return voxels;
}

class PatchMeasure {
 public:
  // Cells small enough for the patch, large enough for the density.
  PatchMeasure(const SurfaceSamples& cloud, const Voxels& voxels, double spacing_m,
               const WallThicknessOptions& options)
      : cloud_(cloud), voxels_(voxels), options_(options) {
    const double cell = std::max(options.cell_m, 4.0 * spacing_m);  // some 16 points a cell and layer
    cells_ =
        std::clamp(static_cast<std::size_t>(options.patch_m / cell + 1e-9), std::size_t{1}, std::size_t{50});
  }

  /// `seed`: of the random choices.
  [[nodiscard]] std::optional<WallPatch> measure(const Voxel& voxel, std::uint64_t seed) const {
    const PointIndices& own = voxels_.at(voxel);
    if (own.size() < kLeastPatchPoints) return std::nullopt;
    auto plane = main_plane(cloud_.points, own, options_.flatness_m, core::SplitMix(seed));
    if (!plane) return std::nullopt;
    const PointIndices main = within(cloud_.points, own, *plane, options_.flatness_m);
    if (main.size() < kLeastPatchPoints) return std::nullopt;
    if (static_cast<double>(main.size()) < kLeastMainShare * static_cast<double>(own.size()))
      return std::nullopt;
    plane->center = mean_of(main);
    if (!cloud_.normals.empty()) turn_to_majority(main, *plane);
    const PointIndices near = gather(voxel, *plane);
    for (int pass = 0; pass < 4; ++pass) {
      const auto refined = refine(near, *plane);
      if (!refined) return std::nullopt;
      plane = refined;
    }
    return over_cells(heights_by_cell(near, *plane), *plane);
  }

 private:
  [[nodiscard]] Eigen::Vector3d mean_of(const PointIndices& some) const {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const std::uint32_t i : some) mean += cloud_.points[i].cast<double>();
    return mean / static_cast<double>(some.size());
  }

  void turn_to_majority(const PointIndices& main, LocalPlane& plane) const {
    std::size_t against = 0;
    for (const std::uint32_t i : main)
      against += cloud_.normals[i].cast<double>().dot(plane.normal) < 0.0 ? 1 : 0;
    if (2 * against > main.size()) plane.normal = -plane.normal;
  }

  /// Points around the patch, before and behind it; those of neighbouring voxels too, since a wall's second
  /// layer may lie just beyond the voxel's border.
  [[nodiscard]] PointIndices gather(const Voxel& voxel, const LocalPlane& plane) const {
    constexpr double kMargin = 1.2;  // the plane still turns a little
    PointIndices near;
    const auto take = [&](std::uint32_t i) {
      const Eigen::Vector3d d = cloud_.points[i].cast<double>() - plane.center;
      const double h = plane.normal.dot(d);
      if (std::abs(h) > kMargin * options_.max_spacing_m) return;
      if ((d - h * plane.normal).squaredNorm() > kMargin * 0.5 * options_.patch_m * options_.patch_m) return;
      if (!cloud_.normals.empty() && !(cloud_.normals[i].cast<double>().dot(plane.normal) > 0.5)) return;
      near.push_back(i);
    };
    for (int k = 0; k < 27; ++k) {
      const auto found = voxels_.find({voxel[0] + k / 9 - 1, voxel[1] + k / 3 % 3 - 1, voxel[2] + k % 3 - 1});
      if (found != voxels_.end()) std::for_each(found->second.begin(), found->second.end(), take);
    }
    return near;
  }

  /// Fits again to both layers if there are two; else to what lies near the plane by its own measure, so that
  /// a corner does not tilt it. Takes points all round the centre, which moves along the normal only.
  [[nodiscard]] std::optional<LocalPlane> refine(const PointIndices& near, const LocalPlane& plane) const {
    const double radius_sq = 0.25 * options_.patch_m * options_.patch_m;
    PointIndices round;
    std::vector<double> heights;
    for (const std::uint32_t i : near) {
      const double h = plane.height(cloud_.points[i]);
      const double across_sq = (cloud_.points[i].cast<double>() - plane.center).squaredNorm() - h * h;
      if (std::abs(h) > options_.max_spacing_m + kSlack || across_sq > radius_sq) continue;
      round.push_back(i);
      heights.push_back(h);
    }
    if (!split_layers(heights).two) round = within(cloud_.points, round, plane, own_reach(heights));
    if (round.size() < kLeastPatchPoints) return std::nullopt;
    LocalPlane refined = fitted(cloud_.points, round, plane);
    refined.center = plane.center + refined.normal * refined.normal.dot(refined.center - plane.center);
    return refined;
  }

  /// Three robust standard deviations of the main layer.
  [[nodiscard]] double own_reach(const std::vector<double>& heights) const {
    std::vector<double> off;
    for (const double h : heights) {
      if (std::abs(h) <= options_.flatness_m) off.push_back(std::abs(h));
    }
    return std::clamp(3.0 * 1.4826 * summarize(off).median, kLeastFitReach, options_.flatness_m);
  }

  /// Heights over the plane, by cell; only points of this wall.
  [[nodiscard]] std::vector<std::vector<double>> heights_by_cell(const PointIndices& near,
                                                                 const LocalPlane& plane) const {
    const Eigen::Vector3d u = plane.normal.unitOrthogonal();
    const Eigen::Vector3d v = plane.normal.cross(u);
    const double half = 0.5 * options_.patch_m;
    const auto per_side = static_cast<double>(cells_);
    std::vector<std::vector<double>> heights(cells_ * cells_);
    for (const std::uint32_t i : near) {
      const Eigen::Vector3d d = cloud_.points[i].cast<double>() - plane.center;
      const double h = plane.normal.dot(d);
      const double a = std::floor((u.dot(d) + half) / options_.patch_m * per_side);
      const double b = std::floor((v.dot(d) + half) / options_.patch_m * per_side);
      if (std::abs(h) > options_.max_spacing_m + kSlack) continue;
      if (a < 0.0 || b < 0.0 || a >= per_side || b >= per_side) continue;
      heights[static_cast<std::size_t>(a) * cells_ + static_cast<std::size_t>(b)].push_back(h);
    }
    return heights;
  }

  /// Median thickness over cells; none if the patch is not covered.
  [[nodiscard]] std::optional<WallPatch> over_cells(std::vector<std::vector<double>> heights,
                                                    const LocalPlane& plane) const {
    std::vector<double> thickness;
    std::size_t layered = 0;
    std::size_t covered = 0;  // by the main layer
    for (std::vector<double>& cell : heights) {
      if (cell.size() < kLeastCellPoints) continue;
      const auto main = std::count_if(cell.begin(), cell.end(),
                                      [this](double h) { return std::abs(h) <= options_.flatness_m; });
      covered += 2 * static_cast<std::size_t>(main) >= kLeastCellPoints ? 1 : 0;
      const Layers layers = split_layers(cell);
      thickness.push_back(layers.thickness());
      layered += layers.two ? 1 : 0;
    }
    if (static_cast<double>(covered) < kLeastCoverage * static_cast<double>(heights.size())) {
      return std::nullopt;
    }
    return WallPatch{plane.center, plane.normal, summarize(thickness).median, 2 * layered > thickness.size()};
  }

  const SurfaceSamples& cloud_;
  const Voxels& voxels_;
  const WallThicknessOptions& options_;
  std::size_t cells_ = 1;  ///< along one side of a patch
};

}  // namespace

/// The options of wall thickness.
void WallThicknessOptions::declare(core::OptionTable& table) {
  table.number("wall_patch", patch_m, {0.05, 5.0}, "m",
               "Edge length of the planar patches on which wall thickness is measured");
  table.number("wall_cell", cell_m, {0.005, 1.0}, "m", "Edge length of the cells of a patch");
  table.number("wall_max_spacing", max_spacing_m, {0.005, 1.0}, "m",
               "Largest distance between layers of one wall");
  table.number("wall_flatness", flatness_m, {0.001, 0.5}, "m",
               "Largest deviation of a patch's main layer from a plane");
}

/// One patch at most for each occupied cube.
std::vector<WallPatch> wall_patches(const SurfaceSamples& cloud, double spacing_m,
                                    const WallThicknessOptions& options, const core::Executor& executor) {
  const Voxels voxels = voxels_of(cloud.points, options.patch_m);
  const PatchMeasure measure(cloud, voxels, spacing_m, options);
  std::vector<Voxel> places;
  for (const auto& [place, points] : voxels) places.push_back(place);
  std::vector<std::optional<WallPatch>> found(places.size());
  for_chunks(executor, found.size(), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) found[i] = measure.measure(places[i], i);
  });
  std::vector<WallPatch> patches;
  for (const auto& patch : found) {
    if (patch) patches.push_back(*patch);
  }
  return patches;
}

/// Statistics over the patches.
WallThickness thickness_of(const std::vector<WallPatch>& patches) {
  std::vector<double> thickness_mm;
  std::size_t layered = 0;
  for (const WallPatch& patch : patches) {
    thickness_mm.push_back(1000.0 * patch.thickness_m);
    layered += patch.layered ? 1 : 0;
  }
  const Statistics s = summarize(thickness_mm);
  WallThickness wall;
  wall.patches = s.count;
  wall.rms_mm = s.rmse;
  wall.mean_mm = s.mean;
  wall.median_mm = s.median;
  wall.p90_mm = s.p90;
  if (s.count > 0) wall.layered_percent = 100.0 * static_cast<double>(layered) / static_cast<double>(s.count);
  return wall;
}

}  // namespace plumbline::evaluate
