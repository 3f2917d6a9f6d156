// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/fusion/dense_fusion.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "fusion/fusion_tiles.hpp"
#include "plumbline/cloud/fusion/exposure.hpp"
#include "plumbline/cloud/fusion/free_space.hpp"
#include "plumbline/cloud/fusion/surfels.hpp"
#include "plumbline/cloud/sensor_pose.hpp"

namespace plumbline::cloud {
namespace {

constexpr double kCell_m = 0.1;  ///< of plans and colours; also the margin of tiles

/// Edge of the blocks of surfels: wide enough for a plane through noise, narrow enough for furniture.
double block_m(double voxel_m) { return std::max(0.02, 2.0 * voxel_m); }

/// Number of occupied cells that `megabytes` can hold, with `bytes_per_side` for each voxel side.
std::size_t cells_within(double megabytes, double bytes_per_side, const DenseFusionOptions& options) {
  constexpr double kLayers = 1.2;  // occupied voxels per voxel of a cell's side
  const double per_axis = std::max(1.0, kCell_m / options.voxels.voxel_m);
  return static_cast<std::size_t>(
      std::max(64.0, megabytes * 1e6 / (kLayers * per_axis * per_axis * bytes_per_side)));
}

/// Cells of a tile that is being finished: in the voxel map, as points, and in surfels.
std::size_t cells_per_tile(const DenseFusionOptions& options) {
  return cells_within(options.tile_mb, 240.0, options);
}

/// Cells of the tiles that are filled together, in the voxel maps.
std::size_t cells_at_a_time(const DenseFusionOptions& options) {
  return cells_within(3.0 * options.tile_mb, 110.0, options);
}

/// The first error in the order of the items, if any.
core::Result<void> first_error(const std::vector<core::Result<void>>& results) {
  for (const auto& result : results) {
    if (!result) return result;
  }
  return {};
}

class Fusion {
 public:
  Fusion(const FusionViews& views, const DenseFusionOptions& options, const core::Executor& executor)
      : views_(views), world_from_cloud_(views.world_from_camera), options_(options), executor_(executor) {}

  core::Result<FusedCloud> run(FusionReport& report) {
    if (auto done = read_views(report); !done) return tl::unexpected<core::Error>(done.error());
    FusedCloud all{std::make_shared<Cloud>(), {}};
    if (!views_.covariances.empty()) all.columns.others.push_back({kSigmaColumn, {}});
    add({}, all);

    // Tiles that fit into memory together
    const std::size_t most_cells = cells_at_a_time(options_);
    for (std::size_t first = 0, count = 0; first < tiles_.size(); first += count) {
      std::size_t cells = 0;
      for (count = 0; first + count < tiles_.size(); ++count) {
        cells += tiles_[first + count].occupied;
        if (count > 0 && cells > most_cells) break;
      }

      std::vector<VoxelMap> voxels(count, VoxelMap(options_.voxels));
      if (auto filled = fill(first, voxels); !filled) return tl::unexpected<core::Error>(filled.error());

      finish(first, voxels, report, all);
    }

    return all;
  }

 private:
  [[nodiscard]] bool several_robots() const { return !views_.robots.empty(); }

  /// Reads every view: its extent, its free space, its colours.
  core::Result<void> read_views(FusionReport& report) {
    const std::size_t count = views_.world_from_camera.size();
    std::vector<std::vector<ColorCell>> cells(count);
    std::vector<core::Result<void>> done(count);
    rasters_.resize(count);
    is_depth_view_.assign(count, 0);
    read_.resize(count);
    std::atomic<std::size_t> kept_bytes{0};

    executor_.parallel_for(count, [&](std::size_t v) {
      const auto cloud = views_.read(v);
      if (!cloud) {
        done[v] = tl::unexpected<core::Error>(cloud.error());
        return;
      }
      world_from_cloud_[v] = views_.world_from_camera[v] * sensor_pose(**cloud);

      // Depth-only views have free space, but no surface
      is_depth_view_[v] = is_depth_view(**cloud, views_.cameras[v]) ? 1 : 0;
      if (is_depth_view_[v] == 0) cells[v] = color_cells(**cloud, world_from_cloud_[v], kCell_m);
      if (options_.free_space) rasters_[v] = depth_raster(**cloud, views_.cameras[v]);

      // Clouds that fit into half the memory of a tile are not read a second time.
      const std::size_t bytes = (*cloud)->size() * sizeof(Point);
      if (is_depth_view_[v] == 0 && kept_bytes.fetch_add(bytes) + bytes <= most_kept_bytes())
        read_[v] = *cloud;
    });

    if (auto failed = first_error(done); !failed) return failed;
    if (!views_.covariances.empty()) find_pose_noise(cells);

    // Tiles bound the memory of the fusion
    tiles_ = plan_tiles(cells, cells_per_tile(options_));
    report.tiles = tiles_.size();

    // Gains that make shared cells agree in colour
    if (!options_.exposure) return {};
    gains_ = color_gains(cells);
    for (const Eigen::Vector3f& gain : gains_) {
      report.least_gain = std::min(report.least_gain, static_cast<double>(gain.minCoeff()));
      report.most_gain = std::max(report.most_gain, static_cast<double>(gain.maxCoeff()));
    }

    return {};
  }

  /// Inserts the views into the voxels of the tiles from `first` on, a few views at a time: each is read once
  /// for all of these tiles, and every tile takes the views in their order. Meanwhile the next views are
  /// measured.
  core::Result<void> fill(std::size_t first, std::vector<VoxelMap>& voxels) {
    constexpr std::size_t kViewsAtATime = 2;

    // Views that any of these tiles needs, each once
    std::vector<std::uint32_t> views;
    for (std::size_t k = 0; k < voxels.size(); ++k) {
      views.insert(views.end(), tiles_[first + k].views.begin(), tiles_[first + k].views.end());
    }
    std::sort(views.begin(), views.end());
    views.erase(std::unique(views.begin(), views.end()), views.end());

    // The next views are measured while the last are inserted
    std::vector<std::vector<VoxelSample>> measured;  // of the views from `at` on
    for (std::size_t at = 0; at < views.size() || !measured.empty();) {
      const std::size_t next = at + measured.size();
      std::vector<std::vector<VoxelSample>> samples(std::min(kViewsAtATime, views.size() - next));
      std::vector<core::Result<void>> done(samples.size());

      executor_.parallel_for(samples.size() + voxels.size(), [&](std::size_t i) {
        if (i < samples.size()) {
          done[i] = measure(views[next + i], samples[i]);
        } else {
          const std::size_t k = i - samples.size();
          insert(tiles_[first + k], views.data() + at, measured, voxels[k]);
        }
      });

      if (auto failed = first_error(done); !failed) return failed;
      at = next;
      measured = std::move(samples);
    }

    return {};
  }

  /// `samples` are those of `views`.
  void insert(const FusionTile& tile, const std::uint32_t* views,
              const std::vector<std::vector<VoxelSample>>& samples, VoxelMap& voxels) const {
    const Eigen::AlignedBox3i region = tile.voxels(kCell_m, options_.voxels.voxel_m);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const bool reaches = std::binary_search(tile.views.begin(), tile.views.end(), views[i]);
      if (reaches) voxels.insert(samples[i], region);
    }
  }

  core::Result<void> measure(std::size_t v, std::vector<VoxelSample>& samples) {
    // A view that reaches into tiles filled later is read again for these.
    CloudPtr cloud = std::exchange(read_[v], nullptr);
    if (cloud == nullptr) {
      auto again = views_.read(v);
      if (!again) return tl::unexpected<core::Error>(again.error());
      cloud = std::move(*again);
    }
    if (!gains_.empty()) apply_gain(*cloud, gains_[v]);

    // Robots are counted only if there are several
    const std::uint8_t robot = several_robots() ? views_.robots[v] : std::uint8_t{0};
    samples = VoxelMap::measured(*cloud, world_from_cloud_[v], options_.voxels, robot);
    return {};
  }

  [[nodiscard]] std::size_t most_kept_bytes() const {
    return static_cast<std::size_t>(0.5e6 * options_.tile_mb);
  }

  /// Estimate for all tiles, from the first ones and with some reserve: reserved memory costs nothing until
  /// it is used, while a growing list would exist twice.
  [[nodiscard]] std::size_t expected_points(const std::vector<VoxelMap>& first_tiles) const {
    constexpr double kReserve = 1.2;
    std::size_t voxels = 0, cells = 0, all_cells = 0;
    for (const VoxelMap& tile : first_tiles) voxels += tile.size();
    for (std::size_t k = 0; k < tiles_.size(); ++k) {
      if (k < first_tiles.size()) cells += tiles_[k].occupied;
      all_cells += tiles_[k].occupied;
    }
    return static_cast<std::size_t>(kReserve * static_cast<double>(voxels) * static_cast<double>(all_cells) /
                                    static_cast<double>(std::max<std::size_t>(1, cells)));
  }

  /// Appends the points of the tiles from `first` on, a few tiles at a time: their points are larger than the
  /// voxels that they replace.
  void finish(std::size_t first, std::vector<VoxelMap>& voxels, FusionReport& report, FusedCloud& all) const {
    constexpr std::size_t kTilesAtATime = 4;
    if (first == 0) all.cloud->points.reserve(expected_points(voxels));
    for (std::size_t begin = 0; begin < voxels.size(); begin += kTilesAtATime) {
      std::vector<std::vector<FusedPoint>> parts(std::min(kTilesAtATime, voxels.size() - begin));
      std::vector<FusionReport> reports(parts.size());
      executor_.parallel_for(parts.size(), [&](std::size_t k) {
        parts[k] = finished(tiles_[first + begin + k], std::move(voxels[begin + k]), reports[k]);
      });

      for (std::size_t k = 0; k < parts.size(); ++k) {
        add(parts[k], all);
        report.isolated += reports[k].isolated;
        report.seen_through += reports[k].seen_through;
      }
    }
  }

  /// The points of a tile.
  [[nodiscard]] std::vector<FusedPoint> finished(const FusionTile& tile, VoxelMap voxels,
                                                 FusionReport& report) const {
    std::vector<FusedPoint> points = voxels.points();
    voxels = VoxelMap(options_.voxels);
    clean(points, report);
    if (options_.plane_projection) points = VoxelMap::merged(points, options_.voxels);
    const Eigen::AlignedBox3d box = tile.box(kCell_m);
    const auto least = static_cast<std::uint32_t>(options_.min_observations);
    const auto stays = [&](const FusedPoint& fused) {
      const Eigen::Array3d p = fused.point.getVector3fMap().cast<double>();
      return fused.observations >= least && (p >= box.min().array()).all() && (p < box.max().array()).all();
    };
    points.erase(std::remove_if(points.begin(), points.end(), [&](const auto& p) { return !stays(p); }),
                 points.end());
    return points;
  }

  /// Removes points that are seen through and isolated points, and projects the rest.
  void clean(std::vector<FusedPoint>& points, FusionReport& report) const {
    Surfels surfels(points, block_m(options_.voxels.voxel_m));

    // Surfels in the free space of other views
    std::vector<std::uint8_t> goes(surfels.all().size(), 0);
    if (options_.free_space) goes = seen_through(surfels, rasters_, is_depth_view_, world_from_cloud_);

    // Thin walls: points onto the planes of their surfels
    surfels.fit_planes();
    if (options_.plane_projection) surfels.project(points);

    const auto least = static_cast<std::uint32_t>(options_.min_support);
    std::size_t kept = 0;

    // Isolated points have too few neighbours of similar normal
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::uint32_t s = surfels.of(i);
      if (s != Surfels::kNone && goes[s] != 0) {
        ++report.seen_through;
      } else if (s != Surfels::kNone && surfels.all()[s].support < least) {
        ++report.isolated;
      } else {
        points[kept++] = points[i];
      }
    }

    points.resize(kept);
  }

  /// Carries the covariances of the poses to the points that their views measured.
  void find_pose_noise(const std::vector<std::vector<ColorCell>>& cells) {
    for (std::size_t v = 0; v < cells.size(); ++v) {
      const geometry::Rigid3 camera_from_world = views_.world_from_camera[v].inverse();
      const bool known = views_.covariances[v].allFinite();
      for (const ColorCell& seen : cells[v]) {
        const Eigen::Vector3d centre = (unpack_cell(seen.cell).cast<double>().array() + 0.5) * kCell_m;
        Eigen::Matrix<double, 3, 6> by_pose;
        by_pose << Eigen::Matrix3d::Identity(), -geometry::skew(camera_from_world * centre);
        by_pose = camera_from_world.rotation.transpose() * by_pose;
        PoseNoise& noise = pose_noise_[seen.cell];
        if (!known) continue;
        const float weight = 1.0F + seen.points;
        noise.sum += weight * (by_pose * views_.covariances[v] * by_pose.transpose()).cast<float>();
        noise.weight += weight;
      }
    }
  }

  /// Appends the points of a tile, with their columns.
  void add(const std::vector<FusedPoint>& points, FusedCloud& all) const {
    append(points, several_robots(), all);
    if (views_.covariances.empty()) return;
    std::vector<float>& sigmas = all.columns.others.front().values;
    constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

    // Noise of the point's cell; a point outside all known cells takes that of the point before.
    const PoseNoise* pose = nullptr;
    for (const FusedPoint& fused : points) {
      const Eigen::Vector3d at = fused.point.getVector3fMap().cast<double>() / kCell_m;
      const auto found = pose_noise_.find(pack_cell(cell_of(at)));

      if (found != pose_noise_.end()) pose = &found->second;

      // Variance along the normal, of depth and of poses
      float variance = fused.noise_m * fused.noise_m / static_cast<float>(std::max(1U, fused.observations));
      if (pose != nullptr) {
        const Eigen::Vector3f normal = fused.point.getNormalVector3fMap();
        const float sum = normal.allFinite() ? normal.dot(pose->sum * normal) : pose->sum.trace() / 3.0F;
        variance += pose->weight > 0.0F ? std::max(0.0F, sum / pose->weight) : kUnknown;
      }

      sigmas.push_back(std::sqrt(variance));
    }
  }

  /// Weighted covariance of the world positions of points in a cell, m^2; weight 0: not known.
  struct PoseNoise {
    Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
    float weight = 0.0F;
  };

  const FusionViews& views_;
  std::vector<geometry::Rigid3> world_from_cloud_;  ///< by view
  DenseFusionOptions options_;
  const core::Executor& executor_;
  std::vector<FusionTile> tiles_;
  std::vector<DepthRaster> rasters_;         ///< by view; empty ones without free space
  std::vector<std::uint8_t> is_depth_view_;  ///< by view
  std::vector<CloudPtr> read_;               ///< by view; null: to be read again
  std::vector<Eigen::Vector3f> gains_;       ///< by view; empty: colours are not changed
  CellMap<PoseNoise> pose_noise_;            ///< by cell; empty: not known
};

}  // namespace

void DenseFusionOptions::declare(core::OptionTable& table) {
  voxels.declare(table);
  table.integer("min_observations", min_observations, {1, 1000}, "",
                "Smallest number of keyframes that see a voxel which is kept");
  table.boolean("plane_projection", plane_projection,
                "Project the points of flat pieces of surface onto their common plane, for thin walls");
  table.boolean("free_space", free_space,
                "Remove points that other keyframes look through: people, flying pixels");
  table.boolean("exposure", exposure, "Balance colours between keyframes");
  table.integer("min_support", min_support, {0, 1000}, "",
                "Remove points with fewer neighbours of similar normal than this; 0: keep all");
  table.number("tile_mb", tile_mb, {16.0, 100000.0}, "",
               "Memory per tile, MB; tiles that take up to three times this in total are filled at a time");
}

core::Result<FusedCloud> fuse_views(const FusionViews& views, const DenseFusionOptions& options,
                                    const core::Executor& executor, FusionReport* report) {
  FusionReport unused;
  return Fusion(views, options, executor).run(report == nullptr ? unused : *report);
}

FusedCloud coarser(const Cloud& cloud, const CloudColumns& columns, double voxel_m) {
  constexpr float kMost = 0.9999F;
  std::vector<FusedPoint> points(cloud.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    // Confidence is weight / (1 + weight)
    const float confidence =
        i < columns.confidence.size() ? std::clamp(columns.confidence[i], 1e-4F, kMost) : 0.5F;
    points[i].point = cloud[i];
    points[i].weight = confidence / (1.0F - confidence);
    points[i].observations = i < columns.observations.size() ? columns.observations[i] : 1;
  }
  VoxelMapOptions options;
  options.voxel_m = voxel_m;
  FusedCloud result{std::make_shared<Cloud>(), {}};
  append(VoxelMap::merged(points, options), false, result);
  return result;
}

}  // namespace plumbline::cloud
