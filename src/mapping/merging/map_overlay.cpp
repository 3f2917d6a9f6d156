// SPDX-License-Identifier: BSD-3-Clause
#include "merging/map_overlay.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "merging/landmark_cells.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

constexpr double kReach_m = 0.12;  // landmarks that are one may lie so far apart
constexpr double kCell_m = 2.0 * kReach_m;
constexpr std::size_t kMostTried = 6000;
constexpr double kNear_m = 0.4;  // range of trusted depth
constexpr double kFar_m = 5.0;

enum class Seen { kNot, kThere, kThrough };

/// Compares a keyframe's depth with a surface at `point` in its camera frame.
Seen seen(const cv::Mat& depth, const sensor::Pinhole& camera, const Eigen::Vector3d& point) {
  const Eigen::Vector2d pixel = camera.project(point);
  const int x = static_cast<int>(std::floor(pixel.x() * depth.cols / camera.width));
  const int y = static_cast<int>(std::floor(pixel.y() * depth.rows / camera.height));
  if (x < 1 || y < 1 || x + 1 >= depth.cols || y + 1 >= depth.rows) return Seen::kNot;
  float low = 1e9F;
  float high = 0.0F;
  for (int v = y - 1; v <= y + 1; ++v) {
    const float* row = depth.ptr<float>(v);
    for (int u = x - 1; u <= x + 1; ++u) {
      if (!(row[u] > 0.0F)) return Seen::kNot;
      low = std::min(low, row[u]);
      high = std::max(high, row[u]);
    }
  }
  const double tolerance = 0.06 + 3.0 * sensor::depth_sigma(point.z());
  if (point.z() < static_cast<double>(low) - tolerance) return Seen::kThrough;
  return point.z() > static_cast<double>(high) + tolerance ? Seen::kNot : Seen::kThere;
}

struct PlacedView {
  const cv::Mat* depth;
  sensor::Pinhole camera;
  Rigid3 camera_from_world;
};

std::vector<PlacedView> views_of(const MapPart& part) {
  std::vector<PlacedView> views;
  for (const KeyframeId id : part.map->keyframe_ids()) {
    const auto& features = part.map->keyframe(id).features;
    if (features == nullptr || features->thumbnail_depth.empty()) continue;
    views.push_back({&features->thumbnail_depth, part.cameras.at(id.robot), part.map->camera_from_world(id)});
  }
  return views;
}

}  // namespace

MapOverlay::Landmark MapOverlay::landmark(const maps::Map& map, core::PointId id) {
  const maps::MapPoint& point = map.point(id);
  return {point.position, point.view_direction, point.reference_distance, point.descriptor};
}

MapOverlay::Side MapOverlay::side(const MapPart& part) {
  Side side;
  side.part = part;
  std::vector<std::pair<std::uint64_t, core::PointId>> order;
  for (const core::PointId id : part.map->point_ids()) {
    const maps::MapPoint& point = part.map->point(id);
    if (point.observations.size() >= 2)
      order.emplace_back(cloud::pack_cell(cloud::cell_of(point.position / kCell_m)), id);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [key, id] : order) {
    side.cells.push_back(key);
    side.landmarks.push_back(landmark(*part.map, id));
  }
  return side;
}

MapOverlay::MapOverlay(const MapPart& a, const MapPart& b) : a_(side(a)), b_(side(b)) {
  constexpr std::size_t kSample = 300;
  double pairs = 0.0;
  for (std::size_t i = 0; i < a_.landmarks.size(); i += stride(a_.landmarks.size(), kSample)) {
    for (std::size_t j = 0; j < b_.landmarks.size(); j += stride(b_.landmarks.size(), kSample)) {
      pairs += 1.0;
      if (alike(a_.landmarks[i].descriptor, b_.landmarks[j].descriptor)) alike_ += 1.0;
    }
  }
  alike_ /= std::max(1.0, pairs);
}

/// Counts a landmark of the side there that looks alike, and the probability of that by chance.
void MapOverlay::match(const Side& side, const Landmark& landmark, const Eigen::Vector3d& at,
                       OverlayFit& sum) const {
  // Cells are twice the reach wide: eight of them hold all that is near.
  const Eigen::Vector3i low = cloud::cell_of((at - Eigen::Vector3d::Constant(kReach_m)) / kCell_m);
  bool found = false;
  int near = 0;

  for (int corner = 0; corner < 8; ++corner) {
    const std::uint64_t key = cloud::pack_cell(corner_of(low, corner));
    auto cell = std::lower_bound(side.cells.begin(), side.cells.end(), key);
    for (; cell != side.cells.end() && *cell == key; ++cell) {
      const Landmark& other = side.landmarks[static_cast<std::size_t>(cell - side.cells.begin())];
      if ((other.position - at).norm() > kReach_m) continue;
      ++near;
      found = found || alike(other.descriptor, landmark.descriptor);
    }
  }

  sum.matched += found ? 1 : 0;
  sum.chance += 1.0 - std::pow(1.0 - alike_, near);
}

void MapOverlay::overlay(const Side& moved, const Side& fixed, const Rigid3& fixed_from_moved,
                         OverlayFit& sum) const {
  constexpr double kLikeSide = 0.8;  // cosine between the directions from which a landmark was seen
  constexpr double kTimes = 1.8;     // nearer or farther: a corner does not look the same from everywhere
  const std::vector<PlacedView> views = views_of(fixed.part);

  const std::size_t step = stride(moved.landmarks.size(), kMostTried);
  for (std::size_t i = 0; i < moved.landmarks.size(); i += step) {
    const Landmark& landmark = moved.landmarks[i];
    const Eigen::Vector3d at = fixed_from_moved * landmark.position;
    const Eigen::Vector3d direction = fixed_from_moved.rotation * landmark.view;
    bool there = false;
    bool through = false;

    // Only views from a similar side and distance count: from elsewhere the corner looks different, and
    // its absence would prove nothing.
    for (const PlacedView& view : views) {
      const Eigen::Vector3d in_camera = view.camera_from_world * at;
      const double distance = in_camera.norm();
      if (in_camera.z() < kNear_m || in_camera.z() > kFar_m || distance > kTimes * landmark.distance_m ||
          distance * kTimes < landmark.distance_m) {
        continue;
      }
      if (in_camera.dot(view.camera_from_world.rotation * direction) < kLikeSide * distance) continue;

      const Seen what = seen(*view.depth, view.camera, in_camera);
      there = there || what == Seen::kThere;
      through = through || what == Seen::kThrough;
    }

    // A surface that one view confirms exists, even if another one with a slightly wrong pose looks past it.
    if (there) {
      ++sum.expected;
      match(fixed, landmark, at, sum);
    } else if (through) {
      ++sum.contradicted;
    }
  }
}

namespace {

struct SurfaceCell {
  double there = 0.0;
  double through = 0.0;
};

/// Surface samples of one map in the views of another, in cells.
std::map<std::uint64_t, SurfaceCell> overlay_surfaces(const MapPart& moved, const MapPart& fixed,
                                                      const Rigid3& fixed_from_moved) {
  constexpr double kFacing = 0.25;  // cosine
  constexpr double kSurfaceCell_m = 0.3;
  const std::vector<PlacedView> views = views_of(fixed);
  const std::vector<KeyframeId> ids = moved.map->keyframe_ids();
  std::size_t count = 0;
  for (const KeyframeId id : ids) count += moved.map->keyframe(id).surface.size();

  std::map<std::uint64_t, SurfaceCell> cells;
  const std::size_t step = stride(count, kMostTried);
  std::size_t next = 0;  // of all samples, one keyframe's after the other's
  for (const KeyframeId id : ids) {
    const Rigid3 fixed_from_camera = fixed_from_moved * moved.map->camera_from_world(id).inverse();
    const std::vector<maps::SurfaceSample>& samples = moved.map->keyframe(id).surface;
    for (; next < samples.size(); next += step) {
      const Eigen::Vector3d at = fixed_from_camera * samples[next].point.cast<double>();
      const Eigen::Vector3d normal = fixed_from_camera.rotation * samples[next].normal.cast<double>();
      bool there = false;
      bool through = false;

      // Each view that the surface faces.
      for (const PlacedView& view : views) {
        const Eigen::Vector3d in_camera = view.camera_from_world * at;
        if (in_camera.z() < kNear_m || in_camera.z() > kFar_m) continue;
        if (-(view.camera_from_world.rotation * normal).dot(in_camera) < kFacing * in_camera.norm()) continue;
        const Seen what = seen(*view.depth, view.camera, in_camera);
        there = there || what == Seen::kThere;
        through = through || what == Seen::kThrough;
      }

      if (!there && !through) continue;
      SurfaceCell& cell = cells[cloud::pack_cell(cloud::cell_of(at / kSurfaceCell_m))];
      (there ? cell.there : cell.through) += 1.0;
    }

    next -= samples.size();
  }

  return cells;
}

}  // namespace

double MapOverlay::surface_log_odds(const Rigid3& a_from_b) const {
  constexpr double kThrough = 0.02;      // share that is seen through, of one place
  constexpr double kThroughOther = 0.2;  // and of another one
  constexpr double kWhole = 3.0;         // samples from which on a cell counts whole
  const double there = std::log((1.0 - kThrough) / (1.0 - kThroughOther));
  const double through = std::log(kThrough / kThroughOther);
  double sum = 0.0;
  for (const auto& cells : {overlay_surfaces(b_.part, a_.part, a_from_b),
                            overlay_surfaces(a_.part, b_.part, a_from_b.inverse())}) {
    for (const auto& [key, cell] : cells) {
      sum += (cell.there * there + cell.through * through) / std::max(cell.there + cell.through, kWhole);
    }
  }
  return std::min(0.0, sum);
}

OverlayFit MapOverlay::fit(const Rigid3& a_from_b) const {
  OverlayFit sum;
  overlay(b_, a_, a_from_b, sum);
  overlay(a_, b_, a_from_b.inverse(), sum);
  return sum;
}

}  // namespace plumbline::mapping
