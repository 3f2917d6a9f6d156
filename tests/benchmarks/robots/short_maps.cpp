// SPDX-License-Identifier: BSD-3-Clause
// Are two maps merged, and rightly? For many small maps: short_maps.sh makes them.
//   short_maps FOLDER_A TRUTH_A FOLDER_B TRUTH_B ...
// TRUTH: groundtruth.txt of the recording, both in one world. A line for each two maps: merged or apart,
// keyframes, error of the merge at b's keyframes (metres; NaN: apart), the reason.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>

#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/mapping/map_fusion.hpp"
#include "plumbline/maps/store.hpp"

namespace {

using namespace plumbline;

/// Where the truth has the camera at a moment; the nearest pose counts.
geometry::Rigid3 at(const geometry::Trajectory& truth, double stamp) {
  const geometry::StampedPose* best = &truth.front();
  for (const geometry::StampedPose& pose : truth) {
    if (std::abs(pose.stamp - stamp) < std::abs(best->stamp - stamp)) best = &pose;
  }
  return best->world_from_camera;
}

geometry::Rigid3 truth_from_map(const maps::Map& map, const geometry::Trajectory& truth,
                                core::KeyframeId id) {
  return at(truth, map.keyframe(id).stamp) * map.camera_from_world(id);
}

/// How far from the truth the merge puts b's cameras beside the keyframe of a that agrees with them.
double error_of(const maps::Map& a, const geometry::Trajectory& truth_a, const maps::Map& b,
                const geometry::Trajectory& truth_b, const mapping::MergeEvidence& merge) {
  double worst = 0.0;
  for (const mapping::VerifiedPair& pair : merge.pairs) {
    const core::KeyframeId of_a = a.has_keyframe(pair.query) ? pair.query : pair.match;
    const core::KeyframeId of_b = of_a == pair.query ? pair.match : pair.query;
    const Eigen::Vector3d camera = b.camera_from_world(of_b).inverse().translation;
    const geometry::Rigid3 said = truth_from_map(a, truth_a, of_a) * merge.alignment.a_from_b;
    worst = std::max(worst, (said * camera - at(truth_b, b.keyframe(of_b).stamp).translation).norm());
  }
  return worst;
}

}  // namespace

int main(int argc, char** argv) {
  const core::Executor executor(1);
  for (int i = 1; i + 3 < argc; i += 4) {
    const auto a = maps::load_map(std::string(argv[i]) + "/map.db");
    const auto b = maps::load_map(std::string(argv[i + 2]) + "/map.db");
    const auto truth_a = dataset::read_trajectory(argv[i + 1]);
    const auto truth_b = dataset::read_trajectory(argv[i + 3]);
    if (!a || !b || !truth_a || !truth_b) {
      fmt::print("{} {}: cannot be read\n", argv[i], argv[i + 2]);
      continue;
    }
    const maps::Map second = maps::renumbered(b->map, {{0, 1}});
    const std::vector<mapping::MapPart> parts{{&a->map, {{0, maps::camera_of(a->header.robots, 0).color}}},
                                              {&second, {{1, maps::camera_of(b->header.robots, 0).color}}}};
    const auto merges = mapping::find_overlaps(parts, {}, executor);
    const mapping::MergeEvidence& merge = merges.front();
    const double error = merge.accepted ? error_of(a->map, *truth_a, second, *truth_b, merge)
                                        : std::numeric_limits<double>::quiet_NaN();
    fmt::print("{} {} {} verified {} keyframes {} {} agree {} error {:.3f} {}\n",
               merge.accepted ? "merged" : "apart", argv[i], argv[i + 2], merge.consistency.verified,
               a->map.keyframe_count(), second.keyframe_count(), merge.consistency.agreeing, error,
               merge.refused);
  }
  return 0;
}
