// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <pcl/common/centroid.h>
#include <pcl/common/colors.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_plane.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include "filters/filter_tools.hpp"

namespace plumbline::cloud {
namespace {

enum class PlaneFit { kNever, kOnce, kSpread };
enum class Mode { kKeep, kRemove, kLabel };
constexpr int kNoSegment = -1;

/// Cloud for `mode`, from the segment of every finite point of `input`, in order.
CloudPtr by_segment(const Cloud& input, const std::vector<int>& segments, Mode mode) {
  std::size_t next = 0;
  if (mode != Mode::kLabel) {
    return select(input, [&](std::size_t, const Point&) {
      return (segments[next++] != kNoSegment) == (mode == Mode::kKeep);
    });
  }

  CloudPtr output = select(input, [](std::size_t, const Point&) { return true; });

  for (Point& p : output->points) {
    if (!finite(p)) continue;
    const int segment = segments[next++];
    // Glasbey's colours are easily distinguished; the first is black.
    const auto color = static_cast<std::size_t>(segment + 1) % (pcl::GlasbeyLUT::size() - 1) + 1;
    const pcl::RGB rgb = segment == kNoSegment ? pcl::RGB(128, 128, 128) : pcl::GlasbeyLUT::at(color);
    p.r = rgb.r;
    p.g = rgb.g;
    p.b = rgb.b;
  }

  return output;
}

/// False for points on a line, or fewer than three positions: PCL would complain on the console.
bool spans_a_plane(const Cloud& points, const pcl::Indices& indices) {
  if (indices.size() < 3) return false;
  Eigen::Matrix3d covariance;
  Eigen::Vector4d centroid;
  pcl::computeMeanAndCovarianceMatrix(points, indices, covariance, centroid);
  const Eigen::Vector3d size = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues();
  return size[1] > 1e-10 * size[2] && size[1] > 1e-14;
}

double furthest_coordinate(const Cloud& cloud) {
  float furthest = 0.0F;
  for (const Point& p : cloud) furthest = std::max(furthest, p.getVector3fMap().cwiseAbs().maxCoeff());
  return static_cast<double>(furthest);
}

class PlaneFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.number("distance", distance_m_, {1e-4, 10.0}, "m", "Largest distance of a plane's points");
    table.integer("planes", planes_, {1, 100}, "", "Number of planes to find, the largest first");
    table.integer("min_points", min_points_, {3, 100000000}, "", "Smallest number of points of a plane");
    table.integer("iterations", iterations_, {1, 1000000}, "", "Largest number of RANSAC samples");
    table.choice<PlaneFit>(
        "refine", refine_,
        {{"on", PlaneFit::kOnce}, {"off", PlaneFit::kNever}, {"spread", PlaneFit::kSpread}},
        "Fit each plane to all of its points, then choose its points again; spread: repeatedly, in the end "
        "the points within twice their standard deviation");
    table.choice<Mode>("mode", mode_,
                       {{"keep", Mode::kKeep}, {"remove", Mode::kRemove}, {"label", Mode::kLabel}},
                       "Keep the planes, remove them, or colour each (and grey the rest)");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext&) const override {
    const CloudConstPtr points = finite_list(input);
    std::vector<int> segments(points->size(), kNoSegment);

    // The largest plane first, the next among the other points
    auto rest = std::make_shared<pcl::Indices>(points->size());
    for (std::size_t i = 0; i < rest->size(); ++i) (*rest)[i] = static_cast<pcl::index_t>(i);
    for (int plane = 0; plane < planes_ && spans_a_plane(*points, *rest); ++plane) {
      const pcl::Indices found = largest_plane(points, rest);
      if (found.size() < static_cast<std::size_t>(min_points_)) break;
      for (const auto i : found) segments[static_cast<std::size_t>(i)] = plane;
      rest->erase(std::remove_if(rest->begin(), rest->end(),
                                 [&](auto i) { return segments[static_cast<std::size_t>(i)] != kNoSegment; }),
                  rest->end());
    }
    return by_segment(*input, segments, mode_);
  }

 private:
  /// RANSAC among some of the points; empty when there is no plane.
  [[nodiscard]] pcl::Indices largest_plane(const CloudConstPtr& points, const pcl::IndicesPtr& among) const {
    pcl::PointIndices inliers;
    if (refine_ == PlaneFit::kSpread) {
      const auto model = std::make_shared<pcl::SampleConsensusModelPlane<Point>>(points, *among);
      pcl::RandomSampleConsensus<Point> ransac(model, distance_m_);
      ransac.setMaxIterations(iterations_);
      if (!ransac.computeModel()) return {};
      ransac.refineModel(2.0, 50);
      ransac.getInliers(inliers.indices);
      return inliers.indices;
    }

    pcl::SACSegmentation<Point> segmentation;  // always the same random numbers
    segmentation.setModelType(pcl::SACMODEL_PLANE);
    segmentation.setMethodType(pcl::SAC_RANSAC);
    segmentation.setDistanceThreshold(distance_m_);
    segmentation.setMaxIterations(iterations_);
    segmentation.setOptimizeCoefficients(refine_ == PlaneFit::kOnce);
    segmentation.setInputCloud(points);
    segmentation.setIndices(among);

    pcl::ModelCoefficients coefficients;
    segmentation.segment(inliers, coefficients);
    return inliers.indices;
  }

  double distance_m_ = 0.02;
  int planes_ = 1;
  int min_points_ = 100;
  int iterations_ = 1000;
  PlaneFit refine_ = PlaneFit::kOnce;
  Mode mode_ = Mode::kKeep;
};

class ClustersFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.number(
        "distance", distance_m_, {1e-4, 10.0}, "m",
        "Largest distance of points that belong together; at least twice the spacing of a fused cloud");
    table.number(
        "leaf", leaf_m_, {0.0, 10.0}, "m",
        "Edge length of cells whose means replace their points for this, which is faster; 0: all points");
    table.integer("min_points", min_points_, {1, 100000000}, "", "Smallest number of points of a cluster");
    table.number(
        "min_share", min_share_, {0.0, 1.0}, "ratio",
        "Unless they hold this share of all points, as in a small or coarse cloud; 1: only if they are all");
    table.integer("count", count_, {0, 1000000}, "", "Number of clusters, the largest first; 0: all");
    table.choice<Mode>("mode", mode_,
                       {{"keep", Mode::kKeep}, {"remove", Mode::kRemove}, {"label", Mode::kLabel}},
                       "Keep the clusters, remove them, or colour each (and grey the rest)");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    const CloudConstPtr points = finite_list(input);
    std::vector<int> segments(points->size(), kNoSegment);
    if (points->empty()) return by_segment(*input, segments, mode_);

    const double distance = std::max(distance_m_, 2.0 * context.spacing_m);
    const int fewest =
        std::min(min_points_, static_cast<int>(std::ceil(min_share_ * static_cast<double>(points->size()))));

    // Over means of cells, if a leaf is given
    std::vector<pcl::Indices> clusters;
    if (leaf_m_ > 0.0) {
      constexpr double kMostCells = 1e9;  // from the origin: pcl::VoxelGrid numbers them with 31 bits
      const double furthest = furthest_coordinate(*points);
      if (furthest > kMostCells * leaf_m_) {
        return core::usage_error(
            fmt::format("points lie {:.3g} m away from the origin, too far for cells of {:g} m; remove them "
                        "first (crop_box) or use a leaf of {:.2g} m or more",
                        furthest, leaf_m_, 1.01 * furthest / kMostCells));
      }

      clusters = clusters_of_cells(points, distance, fewest);
    } else {
      clusters = clusters_of(points, distance, fewest);
    }

    // Largest first; of equals the one that comes first in the cloud.
    std::sort(clusters.begin(), clusters.end(), [](const pcl::Indices& a, const pcl::Indices& b) {
      return a.size() != b.size() ? a.size() > b.size() : a.front() < b.front();
    });

    // Each cluster is a segment
    if (count_ > 0) clusters.resize(std::min(clusters.size(), static_cast<std::size_t>(count_)));
    for (std::size_t c = 0; c < clusters.size(); ++c) {
      for (const auto i : clusters[c]) segments[static_cast<std::size_t>(i)] = static_cast<int>(c);
    }

    return by_segment(*input, segments, mode_);
  }

 private:
  // Groups of points connected by steps of at most `distance_m`.
  static std::vector<pcl::Indices> clusters_of(const CloudConstPtr& points, double distance_m,
                                               int min_points) {
    const auto tree = std::make_shared<pcl::search::KdTree<Point>>(false);
    tree->setInputCloud(points);
    pcl::EuclideanClusterExtraction<Point> extraction;
    extraction.setClusterTolerance(distance_m);
    extraction.setMinClusterSize(min_points);
    extraction.setSearchMethod(tree);
    extraction.setInputCloud(points);
    std::vector<pcl::PointIndices> found;
    extraction.extract(found);
    std::vector<pcl::Indices> clusters;
    clusters.reserve(found.size());
    for (pcl::PointIndices& cluster : found) clusters.push_back(std::move(cluster.indices));
    return clusters;
  }

  /// Clusters the means of cells; points follow their mean. Block by block: however far the cloud reaches, no
  /// grid has more cells than pcl::VoxelGrid can count.
  [[nodiscard]] std::vector<pcl::Indices> clusters_of_cells(const CloudConstPtr& points, double distance_m,
                                                            int min_points) const {
    constexpr float kBlock = 64.0F;  // cells along each side
    const auto leaf = static_cast<float>(leaf_m_);
    const auto block = [&](float x) { return static_cast<int>(std::floor(x / (kBlock * leaf))); };

    // Blocks of few enough cells for PCL to number
    std::map<std::array<int, 3>, pcl::IndicesPtr> blocks;
    for (std::size_t i = 0; i < points->size(); ++i) {
      const Point& p = (*points)[i];
      pcl::IndicesPtr& indices = blocks[{block(p.x), block(p.y), block(p.z)}];
      if (indices == nullptr) indices = std::make_shared<pcl::Indices>();
      indices->push_back(static_cast<pcl::index_t>(i));
    }

    // Means of cells; every point knows the mean of its cell
    pcl::VoxelGrid<Point> grid;
    grid.setInputCloud(points);
    grid.setLeafSize(leaf, leaf, leaf);
    grid.setDownsampleAllData(false);  // positions alone
    grid.setSaveLeafLayout(true);
    const auto means = std::make_shared<Cloud>();
    std::vector<std::uint32_t> mean_of(points->size());

    for (const auto& [place, indices] : blocks) {
      Cloud part;
      grid.setIndices(indices);
      grid.filter(part);

      for (const auto index : *indices) {
        const auto i = static_cast<std::size_t>(index);
        mean_of[i] = static_cast<std::uint32_t>(means->size()) +
                     static_cast<std::uint32_t>(grid.getCentroidIndex((*points)[i]));
      }
      *means += part;
    }

    // Voxels that touch are one cluster
    const std::vector<pcl::Indices> groups = clusters_of(means, distance_m, 1);
    std::vector<std::uint32_t> group_of(means->size());
    for (std::size_t g = 0; g < groups.size(); ++g) {
      for (const auto mean : groups[g])
        group_of[static_cast<std::size_t>(mean)] = static_cast<std::uint32_t>(g);
    }

    // Points join the cluster of their mean
    std::vector<pcl::Indices> clusters(groups.size());
    for (std::size_t i = 0; i < points->size(); ++i) {
      clusters[group_of[mean_of[i]]].push_back(static_cast<pcl::index_t>(i));
    }

    // Small clusters are left out
    const auto few = [&](const pcl::Indices& c) { return c.size() < static_cast<std::size_t>(min_points); };
    clusters.erase(std::remove_if(clusters.begin(), clusters.end(), few), clusters.end());
    return clusters;
  }

  double distance_m_ = 0.05;
  double leaf_m_ = 0.0;
  int min_points_ = 100;
  double min_share_ = 1.0;
  int count_ = 1;
  Mode mode_ = Mode::kKeep;
};

}  // namespace

FilterInfo plane_filter() {
  return {"plane", "Finds the largest planes and keeps, removes or colours their points.",
          "PCL's SACSegmentation, one plane after the other among the remaining points; `refine: spread` is "
          "the rule of PCL's program pcl_sac_segmentation_plane. The same cloud gives the same planes. Only "
          "the points themselves count: a plane includes everything near it, also furniture that it cuts.",
          "- type: plane\n  distance: 2 cm\n  planes: 2\n  mode: remove\n",
          [] { return std::make_unique<PlaneFilter>(); }};
}

FilterInfo clusters_filter() {
  return {
      "clusters", "Finds connected clusters and keeps, removes or colours the largest ones.",
      "PCL's EuclideanClusterExtraction: two points are in one cluster when steps of at most `distance` lead "
      "from one to the other. With `leaf` the steps lead over the means of PCL's VoxelGrid, and every point "
      "goes with the mean of its cell: a distance of twice the leaf joins neighbouring cells. `count: 0` "
      "with `mode: keep` removes isolated pieces, as `filters/map.yaml` does: those of fewer than "
      "`min_points` points.",
      "- type: clusters\n  distance: 5 cm\n  min_points: 200\n  count: 1\n  mode: keep\n",
      [] { return std::make_unique<ClustersFilter>(); }};
}

}  // namespace plumbline::cloud
