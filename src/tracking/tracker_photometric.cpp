// SPDX-License-Identifier: BSD-3-Clause
// Direct alignment in the tracker: which keyframe it is done with, and which guess it speaks for.
#include <algorithm>

#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {

using geometry::Rigid3;

/// Before a bare wall thumbnails fit anywhere, and the motion model lags behind: grain tells which guess is
/// the best, or how far to the side of it the camera looks.
void Tracker::rank(const maps::Map& map, const PhotometricView& view, Hypotheses& hypotheses) const {
  constexpr std::size_t kCoarse = 1;
  constexpr double kSure = 0.3;  // correlation of what is looked for
  std::vector<Rigid3>& poses = hypotheses.poses;
  std::vector<std::optional<double>> agreement;
  std::vector<std::optional<optimize::PhotometricFamily>> families;
  for (const Rigid3& pose : poses) {
    const auto& family = families.emplace_back(photometric_family(map, view, kCoarse, pose));
    agreement.push_back(family
                            ? std::optional(optimize::photometric_correlation(*family, pose, kMinPhotometric))
                            : std::nullopt);
  }
  const std::size_t best = best_hypothesis(agreement);
  const Rigid3 likeliest = poses[best];
  if (best > 0) {
    poses.erase(poses.begin() + static_cast<std::ptrdiff_t>(best));
    poses.insert(poses.begin(), likeliest);
  }
  if (!families[best] || *agreement[best] >= kGoodAgreement) return;
  const ShiftedPose shifted = search_shift(*families[best], likeliest);
  if (shifted.correlation < std::max(kSure, *agreement[best] + kBetterAgreement)) return;
  poses.insert(poses.begin(), shifted.camera_from_world);
  hypotheses.sought = true;
}

/// The surroundings' samples that the picture shows from a pose: of the reference keyframe, or of the first
/// that has enough in view.
std::optional<optimize::PhotometricFamily> Tracker::photometric_family(
    const maps::Map& map, const PhotometricView& view, std::size_t level,
    const Rigid3& camera_from_world) const {
  if (view.image == nullptr) return std::nullopt;
  for (const core::KeyframeId id : local_map_.keyframes) {
    const auto samples = photometric_.find(id);
    if (samples == nullptr) continue;
    auto family = associate_photometric(*samples, level, view, map.camera_from_world(id), camera_from_world);
    if (family) return family;
  }
  return std::nullopt;
}

}  // namespace plumbline::tracking
