// SPDX-License-Identifier: BSD-3-Clause
#include "camera_part.hpp"

#include <algorithm>
#include <cmath>

#include "samples.hpp"
#include "view.hpp"

namespace plumbline::check {
namespace {

using geometry::Vector6d;

/// Motions of a keyframe in the world about its origin.
struct WorldShift {
  std::size_t way = 0;
  double stamp = 0.0;
  std::vector<Vector6d> motions;
};

std::vector<WorldShift> in_world(const CheckInput& input) {
  std::vector<WorldShift> all;
  for (const CameraShift& shift : input.camera) {
    const auto pose =
        PathPoses(input.ways[shift.way].path, input.max_dt_s).of({0, shift.way, shift.stamp, shift.stamp});
    if (!pose) continue;
    const geometry::Rigid3& at = pose->world_from_depth;
    WorldShift one{shift.way, shift.stamp, {}};
    for (const Vector6d& local : shift.motions) {
      Vector6d motion;
      motion.tail<3>() = at.rotation * local.tail<3>();
      motion.head<3>() = at.rotation * local.head<3>() - motion.tail<3>().cross(at.translation);
      one.motions.push_back(motion);
    }
    all.push_back(std::move(one));
  }
  return all;
}

/// Motions of one number at the anchors: between keyframes they are interpolated.
std::vector<Vector6d> at_anchors(const std::vector<WorldShift>& shifts, std::size_t number,
                                 const std::vector<GraphAnchor>& anchors) {
  std::vector<Vector6d> motions;
  for (const GraphAnchor& anchor : anchors) {
    // The keyframes of the same path around the anchor; at its ends there is only one.
    const WorldShift *before = nullptr, *after = nullptr;
    for (const WorldShift& shift : shifts) {
      if (shift.way != anchor.way) continue;
      if (shift.stamp <= anchor.stamp) before = &shift;
      if (shift.stamp >= anchor.stamp && after == nullptr) after = &shift;
    }

    if (before == nullptr) before = after;
    if (after == nullptr) after = before;
    if (before == nullptr) {
      motions.emplace_back(Vector6d::Zero());
      continue;
    }

    const double gap_s = after->stamp - before->stamp;
    const double at = gap_s > 0.0 ? (anchor.stamp - before->stamp) / gap_s : 0.0;
    motions.emplace_back((1.0 - at) * before->motions[number] + at * after->motions[number]);
  }
  return motions;
}

}  // namespace

CameraPart camera_part(const CheckInput& input, const std::vector<GraphAnchor>& anchors) {
  const std::vector<WorldShift> shifts = in_world(input);
  if (shifts.empty() || anchors.size() < 3) return {};

  CameraPart part;
  part.draws.resize(anchors.size());
  for (auto& draws : part.draws) draws.fill(Vector6d::Zero());

  // One number of the camera after another: what it moves all anchors by together is no error of the path.
  double squares = 0.0;
  for (std::size_t number = 0; number < shifts.front().motions.size(); ++number) {
    const auto motions = without_whole(anchors, at_anchors(shifts, number, anchors));
    const auto factors = factors_of(number + 1);

    for (std::size_t a = 0; a < anchors.size(); ++a) {
      const Vector6d& motion = motions[a];
      squares +=
          (motion.head<3>() + motion.tail<3>().cross(anchors[a].world_from_camera.translation)).squaredNorm();
      for (std::size_t s = 0; s < factors.size(); ++s) part.draws[a][s] += factors[s] * motion;
    }
  }
  part.rms_m = std::sqrt(squares / static_cast<double>(anchors.size()));
  return part;
}

}  // namespace plumbline::check
