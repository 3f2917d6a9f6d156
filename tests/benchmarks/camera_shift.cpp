// SPDX-License-Identifier: BSD-3-Clause
// How far keyframes move if the camera is another one: predicted from the finished map (all its measurements
// as the other camera would have made them, adjusted anew), and found by mapping the recording again.
//   camera_shift BASE AGAIN...    results of `map` with refine=off; BASE with map.db, AGAIN mapped with other
//   cameras camera_shift RESULT           what the covariance of its estimated camera means for its keyframes
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/geometry/alignment.hpp"
#include "plumbline/mapping/adjustment/map_recalibration.hpp"
#include "plumbline/maps/stored_run.hpp"
#include "plumbline/optimize/camera_calibration.hpp"

namespace {

namespace fs = std::filesystem;
namespace maps = plumbline::maps;
namespace mapping = plumbline::mapping;
namespace sensor = plumbline::sensor;
using Points = std::vector<Eigen::Vector3d>;

double rms(const Points& points) {
  double sum = 0.0;
  for (const Eigen::Vector3d& p : points) sum += p.squaredNorm();
  return std::sqrt(sum / static_cast<double>(points.size()));
}

/// Shifts from `base` to `other`, which is laid on it.
Points shifts(const Points& base, const Points& other) {
  const auto base_from_other = plumbline::geometry::align_points(other, base);
  Points moved;
  for (std::size_t i = 0; i < base.size(); ++i) moved.push_back(base_from_other * other[i] - base[i]);
  return moved;
}

/// The map's keyframes after it was adjusted for the camera.
Points predicted(const maps::StoredRun& run, const sensor::Camera& before, const sensor::Camera& after) {
  maps::Map map = run.stored().map;
  std::vector<maps::FramePose> frames = run.stored().frames;
  mapping::recalibrate_map(sensor::Recalibration(before.color, before, after), map, frames);
  const auto robot = map.keyframe_ids().front().robot;
  mapping::GlobalAdjustmentOptions options;
  options.pose_graph = false;
  options.first_gate = 0.0;
  mapping::adjust_map(map, {{robot, before.color}}, mapping::loop_edges(map), options);
  Points places;
  for (const auto id : map.keyframe_ids()) places.push_back(map.camera_from_world(id).inverse().translation);
  return places;
}

/// RMS shift of keyframes by one standard deviation of each number, and by all with their covariance.
void tell_of_posterior(const maps::StoredRun& run, const sensor::Camera& camera) {
  using plumbline::optimize::kCameraUnknowns;
  const auto& estimate = run.stored().header.robots.front().estimate;
  if (!estimate) return;
  const auto none = plumbline::optimize::change_between(camera, camera);
  const Points start = predicted(run, camera, camera);
  std::vector<Points> by_number;
  for (Eigen::Index u = 0; u < static_cast<Eigen::Index>(kCameraUnknowns); ++u) {
    plumbline::optimize::CameraChange change = none;
    change[u] += std::sqrt(estimate->covariance(u, u));
    by_number.push_back(
        shifts(start, predicted(run, camera, plumbline::optimize::changed_camera(camera, change))));
    fmt::print("{:.3f} ", 1e3 * rms(by_number.back()));
  }

  double sum = 0.0;
  for (std::size_t u = 0; u < by_number.size(); ++u) {
    for (std::size_t v = 0; v < by_number.size(); ++v) {
      const auto i = static_cast<Eigen::Index>(u), j = static_cast<Eigen::Index>(v);
      const double both =
          estimate->covariance(i, j) / std::sqrt(estimate->covariance(i, i) * estimate->covariance(j, j));
      for (std::size_t k = 0; k < start.size(); ++k) sum += both * by_number[u][k].dot(by_number[v][k]);
    }
  }
  fmt::print("all {:.3f}\n", 1e3 * std::sqrt(std::max(0.0, sum) / static_cast<double>(start.size())));
}

}  // namespace

int main(int argc, char** argv) {
  const fs::path base = argv[1];
  const auto run = maps::StoredRun::open_main(base / "map.db");
  const auto camera = sensor::read_camera(base / "camera.yaml");
  if (!run || !camera) return 3;
  if (argc == 2) tell_of_posterior(*run, *camera);
  const Points start = predicted(*run, *camera, *camera);

  for (int i = 2; i < argc; ++i) {
    const auto other = sensor::read_camera(fs::path(argv[i]) / "camera.yaml");
    const auto path = plumbline::dataset::read_trajectory(fs::path(argv[i]) / "trajectory.txt");
    const auto own = plumbline::dataset::read_trajectory(base / "trajectory.txt");
    if (!other || !path || !own) continue;
    std::map<long, Eigen::Vector3d> again, first;
    for (const auto& pose : *path) again[std::lround(1e4 * pose.stamp)] = pose.world_from_camera.translation;
    for (const auto& pose : *own) first[std::lround(1e4 * pose.stamp)] = pose.world_from_camera.translation;

    const Points after = predicted(*run, *camera, *other);
    Points old_places, new_places, from, to;
    std::size_t k = 0;
    for (const auto id : run->stored().map.keyframe_ids()) {
      const long stamp = std::lround(1e4 * run->stored().map.keyframe(id).stamp);
      if (again.count(stamp) > 0 && first.count(stamp) > 0) {
        old_places.push_back(first[stamp]);
        new_places.push_back(again[stamp]);
        from.push_back(start[k]);
        to.push_back(after[k]);
      }
      ++k;
    }
    if (from.size() < 4) continue;

    // The prediction is in the map's own frame: laid on the result's.
    const auto result_from_map = plumbline::geometry::align_points(from, old_places);
    const Points truth = shifts(old_places, new_places);
    Points guess = shifts(from, to), off;
    for (std::size_t j = 0; j < guess.size(); ++j) {
      guess[j] = result_from_map.rotation * guess[j];
      off.push_back(truth[j] - guess[j]);
    }
    fmt::print("{} {} {:.3f} {:.3f} {:.3f}\n", argv[i], from.size(), 1e3 * rms(truth), 1e3 * rms(guess),
               1e3 * rms(off));
  }
}
