// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/adjust/place_views.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "plumbline/maps/components.hpp"

namespace plumbline::adjust {
namespace {

using geometry::Rigid3;

constexpr std::size_t kMostViews = 8;

/// One keyframe on whose surface a place lies.
struct Seen {
  double off_m = 0.0;  ///< from the nearest sample
  double range_m = 0.0;
  Eigen::Vector3d in_camera = Eigen::Vector3d::Zero();
};

/// The places that lie on a keyframe's surface.
std::vector<std::optional<Seen>> seen_in(const std::vector<maps::SurfaceSample>& surface,
                                         const Rigid3& camera_from_output,
                                         const std::vector<Eigen::Vector3d>& places) {
  constexpr double kReach_m = 0.06;  // twice the spacing of stored surfaces
  std::vector<std::optional<Seen>> seen(places.size());

  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3d p = camera_from_output * places[i];
    if (p.z() <= 0.0) continue;
    double nearest = kReach_m * kReach_m;
    for (const maps::SurfaceSample& sample : surface)
      nearest = std::min(nearest, (sample.point.cast<double>() - p).squaredNorm());
    if (nearest < kReach_m * kReach_m) seen[i] = Seen{std::sqrt(nearest), p.norm(), p};
  }

  return seen;
}

}  // namespace

std::vector<PlaceViews> find_place_views(const maps::StoredMaps& maps, std::size_t index,
                                         const std::vector<Eigen::Vector3d>& places,
                                         const core::Executor& executor) {
  const maps::StoredPart& part = maps.parts()[index];
  const maps::StoredMap& stored = part.run.stored();
  const core::KeyframeId root = maps::main_root(stored.map, stored.frames);
  std::vector<std::vector<std::optional<Seen>>> seen(part.views.size());

  // Keyframes of the main part only: the others lie in a frame of their own.
  executor.parallel_for(part.views.size(), [&](std::size_t view) {
    const core::KeyframeId id = part.views.keyframes[view];
    if (!id.valid() || !stored.map.has_keyframe(id) || maps::root_of(stored.map, id) != root) return;
    const auto surface = part.views.surface(view);
    const bool kept = surface && surface->has_value();
    seen[view] = seen_in(kept ? (*surface)->samples : stored.map.keyframe(id).surface,
                         stored.map.camera_from_world(id) * stored.result.output_from_map.inverse(), places);
  });

  // The views nearest to the surface, then the closest ones, whose depth is the best.
  std::vector<PlaceViews> place_views(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::vector<std::tuple<long, double, std::size_t>> best;  // centimetres off, range
    for (std::size_t view = 0; view < seen.size(); ++view) {
      if (seen[view].empty() || !seen[view][i]) continue;
      best.emplace_back(std::lround(100.0 * seen[view][i]->off_m), seen[view][i]->range_m, view);
    }

    std::sort(best.begin(), best.end());
    best.resize(std::min(best.size(), kMostViews));
    for (const auto& [off, range, view] : best)
      place_views[i].emplace_back(part.views.keyframes[view], seen[view][i]->in_camera);
  }

  return place_views;
}

}  // namespace plumbline::adjust
