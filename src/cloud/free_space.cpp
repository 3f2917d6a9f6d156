// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/free_space.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "evidence.hpp"

namespace plumbline::cloud {
namespace {

constexpr int kSolid = 4;          // clouds that see a surface where none looks through leave no doubt
constexpr double kAround_m = 0.1;  // no more than the margin of a tile
constexpr int kPasses = 3;         // the side of a person is 0.3 m deep

/// What of a view matters for a box: null transforms are never used.
struct NearView {
  const DepthRaster* raster;
  Eigen::Matrix3f rotation;
  Eigen::Vector3f translation;
};

enum class Verdict : std::uint8_t { kStays, kDoubtful, kHardlySeen, kGoes };

struct Votes {
  int free = 0;
  int surface = 0;
  int hidden = 0;
};

/// Views whose furthest measurement may reach into a box.
struct NearViews {
  std::vector<NearView> clouds;
  std::vector<NearView> looks;
};

/// The sheets of one brick, and a ball that holds their positions.
struct Cluster {
  Eigen::Vector3f centre{0, 0, 0};
  float radius = 0.0F;
  std::vector<std::uint32_t> sheets;
  std::vector<float> x, y, z;  ///< of the sheets, metres

  void set_positions(const std::vector<Eigen::Vector3f>& positions) {
    x.clear();
    y.clear();
    z.clear();
    for (const std::uint32_t s : sheets) {
      x.push_back(positions[s].x());
      y.push_back(positions[s].y());
      z.push_back(positions[s].z());
    }
  }
};

std::vector<Cluster> clusters_of(const Sheets& sheets, const std::vector<Eigen::Vector3f>& positions) {
  std::vector<Cluster> clusters(sheets.brick_count());
  for (std::size_t b = 0; b < clusters.size(); ++b) {
    Cluster& cluster = clusters[b];
    const Eigen::Vector3i low = sheets.brick(b) * Sheets::kBrick;
    const Eigen::Vector3i high = low + Eigen::Vector3i::Constant(Sheets::kBrick - 1);
    Eigen::AlignedBox3f box;
    sheets.visit_in_brick(b, low, high, [&](std::uint32_t s) {
      cluster.sheets.push_back(s);
      box.extend(positions[s]);
    });
    cluster.centre = box.center();
    for (const std::uint32_t s : cluster.sheets) {
      cluster.radius = std::max(cluster.radius, (positions[s] - cluster.centre).norm());
    }
    cluster.set_positions(positions);
  }
  return clusters;
}

/// Whether the view can say anything about places within `radius` of `centre` (camera frame): the picture
/// less its outermost cells, up to what it measured.
class Frustum {
 public:
  explicit Frustum(const DepthRaster& raster) : furthest_(raster.furthest_m + 0.5F) {
    constexpr auto kCell = static_cast<float>(DepthRaster::kCell_px);
    const auto fx = static_cast<float>(raster.camera.fx), fy = static_cast<float>(raster.camera.fy);
    const auto cx = static_cast<float>(raster.camera.cx), cy = static_cast<float>(raster.camera.cy);
    const float right = kCell * static_cast<float>(raster.width - 1);
    const float low = kCell * static_cast<float>(raster.height - 1);
    sides_.row(0) << fx, 0.0F, cx - kCell;
    sides_.row(1) << -fx, 0.0F, right - cx;
    sides_.row(2) << 0.0F, fy, cy - kCell;
    sides_.row(3) << 0.0F, -fy, low - cy;
    sides_.rowwise().normalize();
  }
  [[nodiscard]] bool reaches(const Eigen::Vector3f& centre, float radius) const {
    constexpr float kRounding_m = 1e-3F;
    const float reach = radius + kRounding_m;
    if (centre.z() < -reach || centre.z() > furthest_ + reach) return false;
    return (sides_ * centre).minCoeff() >= -reach;
  }

 private:
  float furthest_;
  Eigen::Matrix<float, 4, 3> sides_;  ///< normals of the planes through the camera, inwards
};

/// What the views say about each sheet of the clusters.
void count(const std::vector<Cluster>& clusters, const std::vector<NearView>& views,
           std::vector<Votes>& votes) {
  std::vector<Evidence> found;
  for (const NearView& view : views) {
    const Frustum frustum(*view.raster);
    const Asking asking(*view.raster, view.rotation, view.translation);
    for (const Cluster& cluster : clusters) {
      if (!frustum.reaches(view.rotation * cluster.centre + view.translation, cluster.radius)) continue;
      found.resize(cluster.sheets.size());
      asking.ask(cluster.x.data(), cluster.y.data(), cluster.z.data(), found.size(), found.data());
      for (std::size_t i = 0; i < found.size(); ++i) {
        Votes& of_sheet = votes[cluster.sheets[i]];
        of_sheet.free += found[i] == Evidence::kFree ? 1 : 0;
        of_sheet.surface += found[i] == Evidence::kSurface ? 1 : 0;
        of_sheet.hidden += found[i] == Evidence::kHidden ? 1 : 0;
      }
    }
  }
}

Verdict judge(const Votes& v) {
  // One view against another is enough when no third one knows better.
  if (v.free > 0 && 2 * v.free >= v.surface && (v.free > 1 || v.surface < 2)) return Verdict::kGoes;
  const bool rarely_seen = v.hidden >= 3 && 3 * v.surface <= v.hidden;
  if (rarely_seen) return Verdict::kHardlySeen;
  return v.free > 0 ? Verdict::kDoubtful : Verdict::kStays;
}

/// Of every sheet. Looks are asked only where clouds leave a doubt.
std::vector<Verdict> judge(const Sheets& sheets, const NearViews& views) {
  std::vector<Eigen::Vector3f> positions;
  positions.reserve(sheets.all().size());
  for (const Sheet& sheet : sheets.all()) positions.push_back(sheets.position(sheet).cast<float>());
  std::vector<Cluster> clusters = clusters_of(sheets, positions);
  std::vector<Votes> votes(positions.size());
  count(clusters, views.clouds, votes);
  const auto clear = [&](std::uint32_t s) {
    return judge(votes[s]) == Verdict::kGoes || (votes[s].free == 0 && votes[s].surface >= kSolid);
  };
  for (Cluster& cluster : clusters) {
    auto& open = cluster.sheets;
    open.erase(std::remove_if(open.begin(), open.end(), clear), open.end());
  }
  clusters.erase(
      std::remove_if(clusters.begin(), clusters.end(), [](const Cluster& c) { return c.sheets.empty(); }),
      clusters.end());
  for (Cluster& cluster : clusters) cluster.set_positions(positions);
  count(clusters, views.looks, votes);
  std::vector<Verdict> verdicts;
  verdicts.reserve(votes.size());
  for (const Votes& v : votes) verdicts.push_back(judge(v));
  return verdicts;
}

/// What goes with what is around it.
class Surroundings {
 public:
  explicit Surroundings(const Sheets& sheets)
      : sheets_(sheets), reach_(std::max(1, static_cast<int>(kAround_m / sheets.block_m()))) {}

  /// Notes where something goes: nothing else can go with it far away.
  void look(const std::vector<Verdict>& verdicts) {
    near_.assign(sheets_.brick_count(), 0);
    Eigen::Vector3i last(0, 0, 0);
    bool any = false;
    for (std::size_t s = 0; s < verdicts.size(); ++s) {
      if (verdicts[s] != Verdict::kGoes) continue;
      const Eigen::Vector3i& block = sheets_.all()[s].block;
      if (any && block == last) continue;
      any = true;
      last = block;
      visit_bricks(block, [&](std::uint32_t brick) { near_[brick] = 1; });
    }
  }

  /// Whether at least half of the points around that are no matter of doubt go.
  [[nodiscard]] bool go(std::size_t sheet, const std::vector<Verdict>& verdicts) const {
    const Eigen::Vector3i& block = sheets_.all()[sheet].block;
    if (near_[sheets_.brick_at(Sheets::brick_of(block))] == 0) return false;
    const Eigen::Vector3d position = sheets_.position(sheets_.all()[sheet]);
    const double radius = std::max(kAround_m, sheets_.block_m());
    std::size_t going = 0;
    std::size_t staying = 0;
    visit_bricks(block, [&](std::uint32_t brick) {
      const Eigen::Vector3i reach = Eigen::Vector3i::Constant(reach_);
      sheets_.visit_in_brick(brick, block - reach, block + reach, [&](std::uint32_t s) {
        if (verdicts[s] != Verdict::kGoes && verdicts[s] != Verdict::kStays) return;
        if ((sheets_.position(sheets_.all()[s]) - position).norm() > radius) return;
        (verdicts[s] == Verdict::kGoes ? going : staying) += sheets_.all()[s].points;
      });
    });
    return going > 0 && going >= staying;
  }

 private:
  /// The bricks that hold something of what is around a block.
  template <typename Visit>
  void visit_bricks(const Eigen::Vector3i& block, const Visit& visit) const {
    const Eigen::Vector3i reach = Eigen::Vector3i::Constant(reach_);
    const Eigen::Vector3i low = Sheets::brick_of(block - reach), high = Sheets::brick_of(block + reach);
    for (int x = low.x(); x <= high.x(); ++x) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int z = low.z(); z <= high.z(); ++z) {
          const std::uint32_t brick = sheets_.brick_at({x, y, z});
          if (brick != Sheets::kNone) visit(brick);
        }
      }
    }
  }

  const Sheets& sheets_;
  int reach_;                       ///< blocks
  std::vector<std::uint8_t> near_;  ///< by brick: something near it goes
};

NearViews views_near(const Eigen::AlignedBox3d& box, const std::vector<DepthRaster>& rasters,
                     const std::vector<std::uint8_t>& is_look,
                     const std::vector<geometry::Rigid3>& world_from_camera) {
  constexpr double kWidest = 1.5;  // distance over depth at the picture's corners, at most
  NearViews views;
  for (std::size_t v = 0; v < rasters.size(); ++v) {
    const double distance = box.exteriorDistance(world_from_camera[v].translation);
    if (distance > kWidest * static_cast<double>(rasters[v].furthest_m)) continue;
    const geometry::Rigid3 camera_from_world = world_from_camera[v].inverse();
    (is_look[v] != 0 ? views.looks : views.clouds)
        .push_back({&rasters[v], camera_from_world.rotation.cast<float>(),
                    camera_from_world.translation.cast<float>()});
  }
  return views;
}

}  // namespace

CloudPtr depth_look(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera, double min_depth_m,
                    double max_depth_m) {
  constexpr int kCell = DepthRaster::kCell_px;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto least = static_cast<float>(min_depth_m), most = static_cast<float>(max_depth_m);
  const int columns = (camera.width + kCell - 1) / kCell, rows = (camera.height + kCell - 1) / kCell;
  Point none;
  none.x = none.y = none.z = none.normal_x = none.normal_y = none.normal_z = kNan;
  none.r = none.g = none.b = 0;
  auto look = std::make_shared<Cloud>();
  look->points.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), none);
  look->width = static_cast<std::uint32_t>(columns);
  look->height = static_cast<std::uint32_t>(rows);
  look->is_dense = false;
  const int height = std::min(frame.depth.rows, rows * kCell),
            width = std::min(frame.depth.cols, columns * kCell);
  for (int v = 0; v < height; ++v) {
    const float* depth = frame.depth.ptr<float>(v);
    Point* cells = look->points.data() + static_cast<std::ptrdiff_t>(v / kCell) * columns;
    for (int u = 0; u < width; ++u) {
      const float z = depth[u];
      if (!(z >= least && z <= most)) continue;
      float& nearest = cells[u / kCell].z;
      if (!(nearest <= z)) nearest = z;
    }
  }
  const auto fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
  constexpr float kMiddle = 0.5F * static_cast<float>(kCell) - 0.5F;
  for (std::size_t i = 0; i < look->points.size(); ++i) {
    Point& p = look->points[i];
    if (!(p.z > 0.0F)) continue;
    const auto column = static_cast<float>(i % look->width), row = static_cast<float>(i / look->width);
    p.x = (static_cast<float>(kCell) * column + kMiddle - cx) / fx * p.z;
    p.y = (static_cast<float>(kCell) * row + kMiddle - cy) / fy * p.z;
  }
  return look;
}

bool is_look(const Cloud& camera_cloud, const sensor::Pinhole& camera) {
  constexpr int kCell = DepthRaster::kCell_px;
  if (camera_cloud.height < 2 ||
      camera_cloud.width != static_cast<std::uint32_t>((camera.width + kCell - 1) / kCell) ||
      camera_cloud.height != static_cast<std::uint32_t>((camera.height + kCell - 1) / kCell)) {
    return false;
  }
  return std::none_of(camera_cloud.points.begin(), camera_cloud.points.end(),
                      [](const Point& p) { return std::isfinite(p.normal_x); });
}

std::vector<std::uint8_t> seen_through(const Sheets& sheets, const std::vector<DepthRaster>& rasters,
                                       const std::vector<std::uint8_t>& is_look,
                                       const std::vector<geometry::Rigid3>& world_from_camera) {
  std::vector<std::uint8_t> goes(sheets.all().size(), 0);
  Eigen::AlignedBox3d box;
  for (const Sheet& sheet : sheets.all()) box.extend(sheets.centre(sheet.block));
  if (sheets.all().empty()) return goes;
  const NearViews views = views_near(box, rasters, is_look, world_from_camera);
  std::vector<Verdict> verdicts = judge(sheets, views);
  Surroundings around(sheets);
  for (int pass = 0; pass < kPasses; ++pass) {
    const std::vector<Verdict> before = verdicts;
    around.look(before);
    for (std::size_t s = 0; s < goes.size(); ++s) {
      // Only what is hardly seen goes with what was itself a doubt: else good surfaces would go one by one.
      const bool asked = before[s] == Verdict::kHardlySeen || (pass == 0 && before[s] == Verdict::kDoubtful);
      if (asked && around.go(s, before)) verdicts[s] = Verdict::kGoes;
    }
  }
  for (std::size_t s = 0; s < goes.size(); ++s) goes[s] = verdicts[s] == Verdict::kGoes ? 1 : 0;
  return goes;
}

}  // namespace plumbline::cloud
