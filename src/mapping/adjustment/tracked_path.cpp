// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/adjustment/tracked_path.hpp"

#include <fmt/format.h>

#include <map>

#include "plumbline/maps/frame_pose.hpp"

namespace plumbline::mapping {

using core::KeyframeId;
using geometry::Rigid3;

std::string Contradiction::text() const {
  return fmt::format(
      "keyframes {} and {} would lie {:.1f} cm and {:.1f} degrees from where the tracker saw them", a.index,
      b.index, 100.0 * off_m, off_rad * 180.0 / 3.14159265358979323846);
}

std::optional<Contradiction> contradiction(const maps::Map& map, const KeyframePoses& poses) {
  const std::map<KeyframeId, Rigid3> moved(poses.begin(), poses.end());
  const auto pose_of = [&](KeyframeId id) {
    const auto found = moved.find(id);
    return found == moved.end() ? map.camera_from_world(id) : found->second;
  };

  std::optional<Contradiction> worst;
  for (const KeyframeId id : map.keyframe_ids()) {
    const maps::Keyframe& keyframe = map.keyframe(id);
    const KeyframeId reference = keyframe.reference;
    if (!reference.valid() || !map.has_keyframe(reference)) continue;
    if (moved.count(id) == 0 && moved.count(reference) == 0) continue;

    // The new relative pose is compared with the tracker's measurement; a difference within
    // its noise contradicts nothing.
    const Rigid3 expected = keyframe.camera_from_reference.inverse();
    const Rigid3 off = pose_of(id) * pose_of(reference).inverse() * expected;
    const Contradiction seen{reference, id, off.translation.norm(), geometry::rotation_angle(off.rotation)};
    if (!maps::beyond_noise(seen.off_m, seen.off_rad, keyframe.reference_sigma_m)) continue;

    // A difference that the map has already, and that the new poses do not enlarge, does not refute them.
    const Rigid3 now = map.camera_from_world(id) * map.camera_from_world(reference).inverse() * expected;
    if (seen.off_m <= now.translation.norm() && seen.off_rad <= geometry::rotation_angle(now.rotation))
      continue;
    if (!worst || seen.off_m > worst->off_m) worst = seen;
  }

  return worst;
}

}  // namespace plumbline::mapping
