// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/dense_fusion.hpp"

#include <malloc.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "fused_parts.hpp"
#include "fusion_tiles.hpp"
#include "plumbline/cloud/exposure.hpp"
#include "plumbline/cloud/free_space.hpp"
#include "plumbline/cloud/rooms.hpp"
#include "plumbline/cloud/sheets.hpp"
#include "plumbline/cloud/view_points.hpp"
#include "view_voxels.hpp"

namespace plumbline::cloud {
namespace {

constexpr double kCell_m = 0.1;            ///< of plans and colours; also the margin of tiles
constexpr std::size_t kTilesAtATime = 64;  ///< at most: a bit each

/// Edge of the blocks of sheets: wide enough for a plane through noise, narrow enough for furniture.
double block_m(double voxel_m) { return std::max(0.02, 2.0 * voxel_m); }

/// Occupied cells that `megabytes` hold at so many bytes for one side of a voxel.
std::size_t cells_within(double megabytes, double bytes_per_side, const DenseFusionOptions& options) {
  constexpr double kLayers = 1.2;  // occupied voxels per voxel of a cell's side
  const double per_axis = std::max(1.0, kCell_m / options.voxels.voxel_m);
  return static_cast<std::size_t>(
      std::max(64.0, megabytes * 1e6 / (kLayers * per_axis * per_axis * bytes_per_side)));
}

/// Of a tile that is being finished: in the voxel map, extracted, and in sheets.
std::size_t cells_per_tile(const DenseFusionOptions& options) {
  return cells_within(options.tile_mb, 220.0, options);
}

/// Of the tiles that are filled together, in the voxel maps.
std::size_t cells_at_a_time(const DenseFusionOptions& options) {
  return cells_within(6.0 * options.tile_mb, 90.0, options);
}

/// The first error in the order of the items, if any.
template <typename T>
std::optional<core::Error> first_error(const std::vector<core::Result<T>>& results) {
  for (const auto& result : results) {
    if (!result) return result.error();
  }
  return std::nullopt;
}

/// Pages that the allocator keeps for clouds and voxels that are gone: what comes next takes as much again.
void give_back_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

class Fusion {
 public:
  Fusion(const FusionViews& views, const DenseFusionOptions& options, const core::Executor& executor)
      : views_(views), poses_(views.world_from_camera), options_(options), executor_(executor) {
    options_.voxels.robots = !views.robots.empty();
  }

  core::Result<FusedCloud> run(FusionReport& report) {
    if (auto looked = look(report); !looked) return tl::unexpected<core::Error>(looked.error());
    std::vector<FusedCloud> all;
    const std::size_t most_cells = cells_at_a_time(options_);
    for (std::size_t first = 0, count = 0; first < tiles_.size(); first += count) {
      count = 1;
      std::size_t cells = tiles_[first].occupied;
      while (count < kTilesAtATime && first + count < tiles_.size() &&
             cells + tiles_[first + count].occupied <= most_cells) {
        cells += tiles_[first + count++].occupied;
      }
      std::vector<VoxelMap> voxels;
      for (std::size_t k = 0; k < count; ++k) voxels.emplace_back(options_.voxels);
      if (auto filled = fill(first, voxels); !filled) return tl::unexpected<core::Error>(filled.error());
      give_back_memory();
      std::vector<FusedCloud> parts(count);
      std::vector<FusionReport> reports(count);
      executor_.parallel_for(count, [&](std::size_t k) {
        parts[k] = finished(tiles_[first + k], voxels[k], reports[k]);
        voxels[k] = VoxelMap(options_.voxels);
      });
      for (std::size_t k = 0; k < count; ++k) {
        all.push_back(std::move(parts[k]));
        report.dust += reports[k].dust;
        report.seen_through += reports[k].seen_through;
      }
    }
    rasters_ = {};
    give_back_memory();
    return joined(std::move(all), executor_);
  }

 private:
  /// Asks every view: where it reaches, what it looks through, its colours.
  core::Result<void> look(FusionReport& report) {
    std::vector<std::vector<ColorCell>> cells(poses_.size());
    std::vector<core::Result<void>> done(poses_.size());
    rasters_.resize(poses_.size());
    is_look_.assign(poses_.size(), 0);
    executor_.parallel_for(poses_.size(), [&](std::size_t v) {
      auto summary = summary_of(v);
      if (!summary) {
        done[v] = tl::unexpected<core::Error>(summary.error());
        return;
      }
      is_look_[v] = summary->look ? 1 : 0;
      cells[v] = color_cells(summary->spots, poses_[v], kCell_m);
      rasters_[v] = std::move(summary->raster);
      if (is_look_[v] != 0) return;
      set_limits(rasters_[v]);
      rasters_[v].nearest = {};  // limits are all that is asked
    });
    if (const auto error = first_error(done)) return tl::unexpected<core::Error>(*error);
    executor_.parallel_for(2, [&](std::size_t k) {
      if (k == 0) {
        tiles_ = plan_tiles(cells, cells_per_tile(options_));
      } else if (options_.exposure) {
        gains_ = color_gains(cells, executor_);
      }
    });
    report.tiles = tiles_.size();
    for (const Eigen::Vector3f& gain : gains_) {
      report.least_gain = std::min(report.least_gain, static_cast<double>(gain.minCoeff()));
      report.most_gain = std::max(report.most_gain, static_cast<double>(gain.maxCoeff()));
    }
    return {};
  }

  [[nodiscard]] core::Result<ViewSummary> summary_of(std::size_t v) {
    const auto room = workshops_.take();
    if (auto got = read(v, room->points); !got) return tl::unexpected<core::Error>(got.error());
    return summarise_view(room->points, views_.cameras[v], options_);
  }
  core::Result<void> read(std::size_t v, ViewPoints& points) const {
    if (views_.points) return views_.points(v, points);
    const auto cloud = views_.read(v);
    if (!cloud) return tl::unexpected<core::Error>(cloud.error());
    take_points(**cloud, points);
    return {};
  }

  /// What is needed to read a view and to sum it up.
  struct Workshop {
    ViewPoints points;
    ViewVoxels voxels;
  };
  /// A view on its way into voxels: samples, and the tiles that runs of them belong to.
  struct Run {
    std::size_t begin = 0;
    std::size_t end = 0;
    std::uint64_t tiles = 0;  ///< a bit each
  };
  struct LaidView {
    ViewSamples view;
    std::vector<Run> runs;
    std::optional<core::Error> error;
  };

  /// Lays the views into the voxels of the tiles from `first` on, a few views at a time: each is read once
  /// for all of these tiles, and every tile takes the views in their order.
  core::Result<void> fill(std::size_t first, std::vector<VoxelMap>& voxels) {
    constexpr std::size_t kViewsAtATime = 12;
    std::vector<std::uint32_t> views;
    for (std::size_t k = 0; k < voxels.size(); ++k) {
      views.insert(views.end(), tiles_[first + k].views.begin(), tiles_[first + k].views.end());
    }
    std::sort(views.begin(), views.end());
    views.erase(std::unique(views.begin(), views.end()), views.end());
    // The next views are read while the last ones are laid down. Both keep their memory.
    std::vector<LaidView> laid(kViewsAtATime), next(kViewsAtATime);
    std::size_t lying = 0;
    for (std::size_t at = 0; at < views.size() || lying > 0;) {
      const std::size_t coming = std::min(kViewsAtATime, views.size() - at);
      executor_.parallel_for(voxels.size() + coming, [&](std::size_t i) {
        if (i < coming) {
          lay(views[at + i], first, voxels.size(), next[i]);
        } else {
          lay_down(i - coming, laid, lying, voxels[i - coming]);
        }
      });
      for (std::size_t i = 0; i < coming; ++i) {
        if (next[i].error) return tl::unexpected<core::Error>(*next[i].error);
      }
      at += coming;
      lying = coming;
      laid.swap(next);
    }
    workshops_.clear();
    return {};
  }

  void lay(std::uint32_t v, std::size_t first, std::size_t tiles, LaidView& laid) {
    const auto room = workshops_.take();
    if (auto got = read(v, room->points); !got) {
      laid.error = got.error();
      return;
    }
    if (!gains_.empty()) apply_gain(room->points, gains_[v]);
    VoxelMap::sample(room->points, poses_[v], options_.voxels, views_.robots.empty() ? 0 : views_.robots[v],
                     room->voxels, laid.view);
    laid.runs.clear();
    std::uint64_t reached = 0;
    for (std::size_t k = 0; k < tiles; ++k) {
      const std::vector<std::uint32_t>& of_tile = tiles_[first + k].views;
      if (std::binary_search(of_tile.begin(), of_tile.end(), v)) reached |= std::uint64_t{1} << k;
    }
    // Neighbours in a picture mostly share their cell.
    const double per_m = 1.0 / kCell_m;
    Eigen::Vector3i last = Eigen::Vector3i::Constant(std::numeric_limits<int>::min());
    std::uint64_t bits = 0;
    const std::vector<VoxelSample>& samples = laid.view.samples;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Eigen::Vector3d at =
          (((VoxelMap::voxel_of(samples[i]).cast<double>().array() + 0.5) * options_.voxels.voxel_m)
               .matrix() +
           samples[i].offset.cast<double>()) *
          per_m;
      const Eigen::Vector3i cell = whole(at);
      if (cell != last) {
        last = cell;
        bits = tiles_around(cell, first, reached);
      }
      if (laid.runs.empty() || laid.runs.back().tiles != bits) laid.runs.push_back({i, i, bits});
      laid.runs.back().end = i + 1;
    }
  }

  static Eigen::Vector3i whole(const Eigen::Vector3d& at) {
    Eigen::Vector3i cell = at.cast<int>();
    for (int axis = 0; axis < 3; ++axis) cell[axis] -= at[axis] < static_cast<double>(cell[axis]) ? 1 : 0;
    return cell;
  }

  /// Of the tiles from `first` on that `reached` names, those that hold the cell or have it in their margin.
  [[nodiscard]] std::uint64_t tiles_around(const Eigen::Vector3i& cell, std::size_t first,
                                           std::uint64_t reached) const {
    std::uint64_t bits = 0;
    for (std::size_t k = 0; reached >> k != 0; ++k) {
      if ((reached >> k & 1U) == 0) continue;
      const Eigen::AlignedBox3i& box = tiles_[first + k].cells;
      const bool inside = ((cell - box.min()).array() >= -1).all() && ((cell - box.max()).array() <= 1).all();
      if (inside) bits |= std::uint64_t{1} << k;
      if (k == 63) break;
    }
    return bits;
  }

  /// The first `count` of `laid`.
  static void lay_down(std::size_t tile, const std::vector<LaidView>& laid, std::size_t count,
                       VoxelMap& voxels) {
    for (std::size_t v = 0; v < count; ++v) {
      const LaidView& view = laid[v];
      voxels.begin_view();
      const VoxelSample* samples = view.view.samples.data();
      std::size_t begin = 0;
      std::size_t end = 0;  // of runs that follow one another
      for (const Run& run : view.runs) {
        if ((run.tiles >> tile & 1U) == 0) continue;
        if (run.begin != end) {
          voxels.add(samples + begin, end - begin);
          begin = run.begin;
        }
        end = run.end;
      }
      voxels.add(samples + begin, end - begin);
    }
  }

  /// The points of a tile; `voxels` is used up.
  [[nodiscard]] FusedCloud finished(const FusionTile& tile, VoxelMap& voxels, FusionReport& report) const {
    const Eigen::AlignedBox3d box = tile.box(kCell_m);
    FusedCloud points = voxels.extract();
    voxels.clear();
    clean(points, report);
    if (options_.settle) {
      voxels.merge(points);
      points = voxels.extract();
    }
    const auto least = static_cast<std::uint32_t>(options_.min_observations);
    leave(points, [&](std::size_t i) {
      const Eigen::Vector3d p = (*points.cloud)[i].getVector3fMap().cast<double>();
      return points.columns.observations[i] >= least && (p.array() >= box.min().array()).all() &&
             (p.array() < box.max().array()).all();
    });
    return points;
  }

  /// Without what is seen through and without dust; settled.
  void clean(FusedCloud& points, FusionReport& report) const {
    Sheets sheets(points, block_m(options_.voxels.voxel_m));
    std::vector<std::uint8_t> goes(sheets.all().size(), 0);
    if (options_.free_space) goes = seen_through(sheets, rasters_, is_look_, poses_);
    sheets.fit_planes();
    if (options_.settle) sheets.settle(points);
    const auto least = static_cast<std::uint32_t>(options_.min_support);
    leave(points, [&](std::size_t i) {
      const std::uint32_t s = sheets.of(i);
      if (s == Sheets::kNone) return true;
      if (goes[s] != 0) {
        ++report.seen_through;
        return false;
      }
      if (sheets.all()[s].support >= least) return true;
      ++report.dust;
      return false;
    });
  }

  const FusionViews& views_;
  const std::vector<geometry::Rigid3>& poses_;
  DenseFusionOptions options_;
  const core::Executor& executor_;
  std::vector<FusionTile> tiles_;
  std::vector<DepthRaster> rasters_;    ///< by view
  std::vector<std::uint8_t> is_look_;   ///< by view: free space only
  std::vector<Eigen::Vector3f> gains_;  ///< by view; empty: colours as they are
  Rooms<Workshop> workshops_;
};

}  // namespace

core::Result<FusedCloud> fuse_views(const std::vector<geometry::Rigid3>& world_from_camera,
                                    const ReadView& read, const sensor::Pinhole& camera,
                                    const DenseFusionOptions& options, const core::Executor& executor,
                                    FusionReport* report) {
  FusionViews views;
  views.world_from_camera = world_from_camera;
  views.cameras.assign(world_from_camera.size(), camera);
  views.read = read;
  return fuse_views(views, options, executor, report);
}

core::Result<FusedCloud> fuse_views(const FusionViews& views, const DenseFusionOptions& options,
                                    const core::Executor& executor, FusionReport* report) {
  FusionReport unused;
  return Fusion(views, options, executor).run(report == nullptr ? unused : *report);
}

FusedCloud coarser(const Cloud& cloud, const CloudColumns& columns, double voxel_m) {
  constexpr float kMost = 0.9999F;
  FusedCloud points;
  points.cloud = std::make_shared<Cloud>(cloud);
  const std::size_t count = cloud.size();
  points.columns.observations = columns.observations;
  points.columns.observations.resize(count, 1);
  points.weight.assign(count, 1.0F);
  for (std::size_t i = 0; i < columns.confidence.size(); ++i) {
    const float confidence = std::clamp(columns.confidence[i], 1e-4F, kMost);
    points.weight[i] = confidence / (1.0F - confidence);
  }
  points.spread_m.assign(count, 0.0F);
  points.noise_m.assign(count, 0.0F);
  VoxelMapOptions options;
  options.voxel_m = voxel_m;
  VoxelMap voxels(options);
  voxels.merge(points);
  return voxels.extract();
}

}  // namespace plumbline::cloud
