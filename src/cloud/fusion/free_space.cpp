// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/fusion/free_space.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "finite.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::cloud {
namespace {

constexpr int kSolid = 4;          // clouds that see a surface where none looks through leave no doubt
constexpr double kAround_m = 0.1;  // no more than the margin of a tile
constexpr int kPasses = 3;         // the side of a person is 0.3 m deep

enum class Verdict : std::uint8_t { kStays, kDoubtful, kHardlySeen, kGoes };

/// Counts of the views' evidence about a point.
class Votes {
 public:
  int& operator[](Evidence evidence) { return of_[static_cast<std::size_t>(evidence)]; }
  int operator[](Evidence evidence) const { return of_[static_cast<std::size_t>(evidence)]; }

 private:
  std::array<int, 4> of_{};
};

/// A view whose furthest measurement may reach into a box.
struct NearView {
  const DepthRaster* raster;
  Eigen::Matrix3f rotation;  ///< camera from world
  Eigen::Vector3f translation;
};
struct NearViews {
  std::vector<NearView> clouds;
  std::vector<NearView> depth_views;
};

NearViews views_near(const Eigen::AlignedBox3d& box, const std::vector<DepthRaster>& rasters,
                     const std::vector<std::uint8_t>& is_depth_view,
                     const std::vector<geometry::Rigid3>& world_from_camera) {
  constexpr double kWidest = 1.5;  // distance over depth at the image's corners, at most
  NearViews views;
  for (std::size_t v = 0; v < rasters.size(); ++v) {
    // The view's furthest depth ends before the box
    const double distance = box.exteriorDistance(world_from_camera[v].translation);
    if (distance > kWidest * static_cast<double>(rasters[v].furthest_m)) continue;
    const geometry::Rigid3 camera_from_world = world_from_camera[v].inverse();
    (is_depth_view[v] != 0 ? views.depth_views : views.clouds)
        .push_back({&rasters[v], camera_from_world.rotation.cast<float>(),
                    camera_from_world.translation.cast<float>()});
  }
  return views;
}

/// Counts the views' evidence for each of the surfels `asked`.
void count(const std::vector<std::uint32_t>& asked, const std::vector<Eigen::Vector3f>& positions,
           const std::vector<NearView>& views, std::vector<Votes>& votes) {
  if (asked.empty()) return;
  for (const NearView& view : views) {
    const DepthLimits limits(*view.raster);
    for (const std::uint32_t s : asked) {
      ++votes[s][limits.evidence(view.rotation * positions[s] + view.translation)];
    }
  }
}

Verdict judge(const Votes& v) {
  const int free = v[Evidence::kFree], surface = v[Evidence::kSurface], hidden = v[Evidence::kHidden];
  // A single view through the place only decides against a single view of a surface.
  if (free > 0 && 2 * free >= surface && (free > 1 || surface < 2)) return Verdict::kGoes;
  if (hidden >= 3 && 3 * surface <= hidden) return Verdict::kHardlySeen;
  return free > 0 ? Verdict::kDoubtful : Verdict::kStays;
}

/// Verdict on every surfel. Depth views are tested only where clouds leave a doubt.
std::vector<Verdict> judge(const std::vector<Eigen::Vector3f>& positions, const NearViews& views) {
  std::vector<Votes> votes(positions.size());
  std::vector<std::uint32_t> asked(positions.size());
  std::iota(asked.begin(), asked.end(), 0U);
  count(asked, positions, views.clouds, votes);
  const auto clear = [&](std::uint32_t s) {
    return judge(votes[s]) == Verdict::kGoes ||
           (votes[s][Evidence::kFree] == 0 && votes[s][Evidence::kSurface] >= kSolid);
  };
  asked.erase(std::remove_if(asked.begin(), asked.end(), clear), asked.end());
  count(asked, positions, views.depth_views, votes);
  std::vector<Verdict> verdicts;
  verdicts.reserve(votes.size());
  for (const Votes& v : votes) verdicts.push_back(judge(v));
  return verdicts;
}

/// Removal of surfels together with their surroundings.
class Surroundings {
 public:
  Surroundings(const std::vector<Surfel>& surfels, const std::vector<Eigen::Vector3f>& positions,
               double radius_m)
      : surfels_(surfels), positions_(positions), radius_m_(radius_m) {
    for (std::uint32_t s = 0; s < positions.size(); ++s) cells_[pack_cell(cell(s))].push_back(s);
  }

  /// True if at least half of the certain points within the radius are removed.
  [[nodiscard]] bool go(std::uint32_t surfel, const std::vector<Verdict>& verdicts) const {
    std::size_t going = 0;
    std::size_t staying = 0;
    const auto squared = static_cast<float>(radius_m_ * radius_m_);
    for (int k = 0; k < 27; ++k) {
      const auto found =
          cells_.find(pack_cell(cell(surfel) + Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1)));
      if (found == cells_.end()) continue;
      for (const std::uint32_t s : found->second) {
        if (verdicts[s] != Verdict::kGoes && verdicts[s] != Verdict::kStays) continue;
        if ((positions_[s] - positions_[surfel]).squaredNorm() > squared) continue;
        (verdicts[s] == Verdict::kGoes ? going : staying) += surfels_[s].points;
      }
    }
    return going > 0 && going >= staying;
  }

 private:
  [[nodiscard]] Eigen::Vector3i cell(std::uint32_t s) const {
    return cell_of(positions_[s].cast<double>() / radius_m_);
  }

  const std::vector<Surfel>& surfels_;
  const std::vector<Eigen::Vector3f>& positions_;
  double radius_m_;
  CellMap<std::vector<std::uint32_t>> cells_;  ///< surfels by cells of the radius
};

}  // namespace

DepthRaster depth_raster(const Cloud& camera_cloud, const sensor::Pinhole& camera) {
  constexpr int kCell = DepthRaster::kCell_px;
  DepthRaster raster;
  raster.camera = camera;
  raster.width = (camera.width + kCell - 1) / kCell;
  raster.height = (camera.height + kCell - 1) / kCell;

  raster.nearest.assign(static_cast<std::size_t>(raster.width) * static_cast<std::size_t>(raster.height), 0);

  // Nearest depth of each cell; in mm, 16 bits suffice for 65 m
  for (const Point& p : camera_cloud.points) {
    if (!(p.z > 0.0F && p.z < 65.0F)) continue;
    const Eigen::Vector2d pixel = camera.project(p.getVector3fMap().cast<double>());
    if (!camera.contains(pixel, -0.49)) continue;
    const int column = static_cast<int>(pixel.x() + 0.5) / kCell;
    const int row = static_cast<int>(pixel.y() + 0.5) / kCell;
    std::uint16_t& cell = raster.nearest[static_cast<std::size_t>(row * raster.width + column)];

    const auto mm = static_cast<std::uint16_t>(std::max(1.0F, 1000.0F * p.z + 0.5F));
    if (cell == 0 || mm < cell) cell = mm;
    raster.furthest_m = std::max(raster.furthest_m, p.z);
  }

  return raster;
}

DepthLimits::DepthLimits(const DepthRaster& raster)
    : raster_(raster), nearest_(raster.nearest.size(), 0), furthest_(raster.nearest.size(), 0) {
  constexpr int kFewestCells = 7;  // of 3 x 3
  const auto width = static_cast<std::size_t>(raster.width);
  std::vector<std::uint16_t> least(width), most(width), measured(width);  // of three cells one above another

  for (int row = 1; row + 1 < raster.height; ++row) {
    const std::size_t begin = static_cast<std::size_t>(row) * width;
    const std::uint16_t* at = raster.nearest.data() + begin;
    for (std::size_t i = 0; i < width; ++i) {
      const std::uint16_t above = *(at + i - width), here = at[i], below = at[i + width];
      // 0 (no depth) minus 1 wraps around to the largest number.
      const auto before = [](std::uint16_t depth) { return static_cast<std::uint16_t>(depth - 1); };
      least[i] = std::min({before(above), before(here), before(below)});
      most[i] = std::max({above, here, below});
      measured[i] = static_cast<std::uint16_t>((above != 0) + (here != 0) + (below != 0));
    }

    // Limits over 3 x 3 cells, if enough have depth
    for (std::size_t i = 1; i + 1 < width; ++i) {
      if (measured[i - 1] + measured[i] + measured[i + 1] < kFewestCells) continue;
      nearest_[begin + i] = static_cast<std::uint16_t>(std::min({least[i - 1], least[i], least[i + 1]}) + 1);
      furthest_[begin + i] = std::max({most[i - 1], most[i], most[i + 1]});
    }
  }
}

Evidence DepthLimits::evidence(const Eigen::Vector3f& point) const {
  constexpr float kCell = DepthRaster::kCell_px;
  constexpr double kSigmas = 3.0;
  constexpr double kPose_m = 0.03;  // poses are not exact
  const float z = point.z();
  if (!(z > 0.05F && z <= raster_.furthest_m + 0.5F)) return Evidence::kNone;

  // Cells at the border lack neighbours
  const sensor::Pinhole& camera = raster_.camera;
  const float column =
      (static_cast<float>(camera.fx) * point.x() / z + static_cast<float>(camera.cx)) / kCell;
  const float row = (static_cast<float>(camera.fy) * point.y() / z + static_cast<float>(camera.cy)) / kCell;
  if (!(column >= 1.0F && row >= 1.0F && column < static_cast<float>(raster_.width - 1) &&
        row < static_cast<float>(raster_.height - 1))) {
    return Evidence::kNone;
  }

  // A cell without depth is no evidence
  const auto cell =
      static_cast<std::size_t>(static_cast<int>(row) * raster_.width + static_cast<int>(column));
  if (furthest_[cell] == 0) return Evidence::kNone;

  // Depths between the nearest and the furthest are surface
  const auto margin = [](double depth) { return kSigmas * sensor::depth_sigma(depth) + kPose_m; };
  const double near_m = 0.001 * nearest_[cell];
  const double far_m = 0.001 * furthest_[cell];
  if (static_cast<double>(z) < near_m - margin(near_m)) return Evidence::kFree;

  return static_cast<double>(z) > far_m + margin(far_m) ? Evidence::kHidden : Evidence::kSurface;
}

CloudPtr depth_view(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera, double min_depth_m,
                    double max_depth_m) {
  constexpr int kCell = DepthRaster::kCell_px;
  const auto least = static_cast<float>(min_depth_m), most = static_cast<float>(max_depth_m);
  const int columns = (camera.width + kCell - 1) / kCell, rows = (camera.height + kCell - 1) / kCell;

  // NaN in cells without depth
  Point none;
  none.x = none.y = none.z = none.normal_x = none.normal_y = none.normal_z = kNan;
  none.r = none.g = none.b = 0;

  auto view = std::make_shared<Cloud>();
  view->points.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), none);
  view->width = static_cast<std::uint32_t>(columns);
  view->height = static_cast<std::uint32_t>(rows);
  view->is_dense = false;
  const int height = std::min(frame.depth.rows, rows * kCell),
            width = std::min(frame.depth.cols, columns * kCell);

  // Nearest depth of each cell
  for (int v = 0; v < height; ++v) {
    const float* depth = frame.depth.ptr<float>(v);
    Point* cells = view->points.data() + static_cast<std::ptrdiff_t>(v / kCell) * columns;

    for (int u = 0; u < width; ++u) {
      const float z = depth[u];
      if (!(z >= least && z <= most)) continue;
      float& nearest = cells[u / kCell].z;
      if (!(nearest <= z)) nearest = z;
    }
  }

  // Points on the rays through the cells' centres
  const auto fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
  constexpr float kMiddle = 0.5F * static_cast<float>(kCell) - 0.5F;
  for (std::size_t i = 0; i < view->points.size(); ++i) {
    Point& p = view->points[i];
    if (!(p.z > 0.0F)) continue;
    const auto column = static_cast<float>(i % view->width), row = static_cast<float>(i / view->width);
    p.x = (static_cast<float>(kCell) * column + kMiddle - cx) / fx * p.z;
    p.y = (static_cast<float>(kCell) * row + kMiddle - cy) / fy * p.z;
  }

  return view;
}

bool is_depth_view(const Cloud& camera_cloud, const sensor::Pinhole& camera) {
  constexpr int kCell = DepthRaster::kCell_px;
  if (camera_cloud.height < 2 ||
      camera_cloud.width != static_cast<std::uint32_t>((camera.width + kCell - 1) / kCell) ||
      camera_cloud.height != static_cast<std::uint32_t>((camera.height + kCell - 1) / kCell)) {
    return false;
  }

  // Only surface views have normals
  return std::none_of(camera_cloud.points.begin(), camera_cloud.points.end(),
                      [](const Point& p) { return std::isfinite(p.normal_x); });
}

std::vector<std::uint8_t> seen_through(const Surfels& surfels, const std::vector<DepthRaster>& rasters,
                                       const std::vector<std::uint8_t>& is_depth_view,
                                       const std::vector<geometry::Rigid3>& world_from_camera) {
  std::vector<std::uint8_t> goes(surfels.all().size(), 0);
  if (goes.empty()) return goes;

  Eigen::AlignedBox3d box;
  std::vector<Eigen::Vector3f> positions;
  positions.reserve(goes.size());

  for (const Surfel& surfel : surfels.all()) {
    const Eigen::Vector3d position = surfels.position(surfel);
    box.extend(position);
    positions.push_back(position.cast<float>());
  }

  std::vector<Verdict> verdicts =
      judge(positions, views_near(box, rasters, is_depth_view, world_from_camera));
  const Surroundings around(surfels.all(), positions, std::max(kAround_m, surfels.block_m()));

  for (int pass = 0; pass < kPasses; ++pass) {
    const std::vector<Verdict> before = verdicts;
    for (std::uint32_t s = 0; s < goes.size(); ++s) {
      // Only hardly seen surfels are removed along with doubtful ones; otherwise good surfaces would be
      // removed one by one.
      const bool asked = before[s] == Verdict::kHardlySeen || (pass == 0 && before[s] == Verdict::kDoubtful);
      if (asked && around.go(s, before)) verdicts[s] = Verdict::kGoes;
    }
  }

  for (std::size_t s = 0; s < goes.size(); ++s) goes[s] = verdicts[s] == Verdict::kGoes ? 1 : 0;
  return goes;
}

}  // namespace plumbline::cloud
