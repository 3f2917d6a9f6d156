// SPDX-License-Identifier: BSD-3-Clause
// Direct alignment in the tracker: which keyframe it is done with, and which guess it speaks for.
#include <algorithm>

#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {

using geometry::Rigid3;

/// Before a bare wall thumbnails fit anywhere, and the motion model lags behind: grain tells which guess is
/// the best, or how far to the side of it the camera looks.
void Tracker::put_likeliest_first(const maps::Map& map, const PhotometricView& view,
                                  std::vector<Rigid3>& guesses) const {
  constexpr std::size_t kCoarse = 1;
  constexpr double kGood = 0.8;     // correlation
  constexpr double kBetter = 0.05;  // by so much
  constexpr double kSure = 0.3;
  std::size_t best = 0;
  std::vector<double> agreement;
  std::optional<optimize::PhotometricFamily> family_of_best;
  for (std::size_t i = 0; i < guesses.size(); ++i) {
    std::vector<optimize::PhotometricFamily> families = photometric_families(map, view, kCoarse, guesses[i]);
    agreement.push_back(
        families.empty() ? 0.0
                         : optimize::photometric_correlation(families.front(), guesses[i], kMinPhotometric));
    if (i > 0 && agreement[i] < agreement[best] + kBetter) continue;
    best = i;
    family_of_best.reset();
    if (!families.empty()) family_of_best = std::move(families.front());
  }
  const Rigid3 likeliest = guesses[best];
  if (best > 0) {
    guesses.erase(guesses.begin() + static_cast<std::ptrdiff_t>(best));
    guesses.insert(guesses.begin(), likeliest);
  }
  if (!family_of_best || agreement[best] >= kGood) return;
  const ShiftedPose shifted = search_shift(*family_of_best, likeliest);
  if (shifted.correlation < std::max(kSure, agreement[best] + kBetter)) return;
  guesses.insert(guesses.begin(), shifted.camera_from_world);
}

/// The surroundings' samples that the picture shows from a pose: of the reference keyframe, or of the first
/// that has enough in view.
std::vector<optimize::PhotometricFamily> Tracker::photometric_families(
    const maps::Map& map, const PhotometricView& view, std::size_t level,
    const Rigid3& camera_from_world) const {
  std::vector<optimize::PhotometricFamily> families;
  if (view.image == nullptr) return families;
  for (const core::KeyframeId id : local_map_.keyframes) {
    const auto samples = photometric_.find(id);
    if (samples == nullptr) continue;
    auto family = associate_photometric(*samples, level, view, map.camera_from_world(id), camera_from_world);
    if (!family) continue;
    families.push_back(*std::move(family));
    break;
  }
  return families;
}

}  // namespace plumbline::tracking
