// SPDX-License-Identifier: BSD-3-Clause
// Direct alignment in the tracker: which keyframe it is done with, and which guess it speaks for.
#include <algorithm>

#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {

using geometry::Rigid3;

/// Before a bare wall thumbnails fit anywhere, and the motion model lags behind: grain tells which guess is
/// the best, or how far to the side of it the camera looks.
void Tracker::put_likeliest_first(const maps::Map& map, const PhotometricView& view, Guesses& guesses) const {
  constexpr std::size_t kCoarse = 1;
  constexpr double kGood = 0.8;     // correlation
  constexpr double kBetter = 0.05;  // by so much
  constexpr double kSure = 0.3;
  std::vector<Rigid3>& poses = guesses.poses;
  std::size_t best = 0;
  std::vector<double> agreement;
  std::optional<optimize::PhotometricFamily> family_of_best;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    std::optional<optimize::PhotometricFamily> family = photometric_family(map, view, kCoarse, poses[i]);
    agreement.push_back(family ? optimize::photometric_correlation(*family, poses[i], kMinPhotometric) : 0.0);
    if (i > 0 && agreement[i] < agreement[best] + kBetter) continue;
    best = i;
    family_of_best = std::move(family);
  }
  const Rigid3 likeliest = poses[best];
  if (best > 0) {
    poses.erase(poses.begin() + static_cast<std::ptrdiff_t>(best));
    poses.insert(poses.begin(), likeliest);
  }
  if (!family_of_best || agreement[best] >= kGood) return;
  const ShiftedPose shifted = search_shift(*family_of_best, likeliest);
  if (shifted.correlation < std::max(kSure, agreement[best] + kBetter)) return;
  poses.insert(poses.begin(), shifted.camera_from_world);
  guesses.sought = true;
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
