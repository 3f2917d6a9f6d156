// SPDX-License-Identifier: BSD-3-Clause
#include "robots/picked_merge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "plumbline/adjust/place_views.hpp"
#include "plumbline/geometry/adjoint.hpp"
#include "plumbline/maps/components.hpp"
#include "plumbline/maps/stored_maps.hpp"

namespace plumbline::pipeline {
namespace {

using geometry::Rigid3;

/// Places in both maps, by part.
using Places = std::array<std::vector<Eigen::Vector3d>, 2>;

/// first_from_second of their results' frames: least squares, the turn also by walls that are square.
core::Result<Rigid3> laid_by_picks(const Places& places) {
  constexpr double kPick_m = 0.01;      // standard deviation of a pick
  constexpr double kSquare_rad = 0.01;  // and of walls that are square
  constexpr double kGate_m = 0.1;

  // Both maps are upright, so they differ by a shift and a turn about z; the centroids determine the shift.
  const auto count = static_cast<double>(places[0].size());
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();

  for (std::size_t i = 0; i < places[0].size(); ++i) {
    a += places[0][i] / count;
    b += places[1][i] / count;
  }

  // With positions as complex numbers, seen from above, the angle of this sum is the least-squares turn.
  std::complex<double> sum(0.0, 0.0);
  double spread = 0.0;
  for (std::size_t i = 0; i < places[0].size(); ++i) {
    const Eigen::Vector3d p = places[0][i] - a, q = places[1][i] - b;
    sum += std::conj(std::complex<double>(q.x(), q.y())) * std::complex<double>(p.x(), p.y());
    spread += q.head<2>().squaredNorm();
  }

  // Two picks 20 cm apart have a spread of 2 * 0.1^2 m^2; nearer ones leave the turn open.
  if (spread < 0.02) {
    return core::usage_error(
        "--pick: two picks must lie at least 20 cm from each other, as seen from above; pick both jambs of a "
        "door");
  }

  // Both frames are along walls, so the turn is probably a multiple of 90 degrees: within three standard
  // deviations of one, picks and walls are averaged, weighted by their variances.
  double turn = std::arg(sum);
  const double off = std::remainder(turn, M_PI / 2);
  const double variance = 2.0 * kPick_m * kPick_m / spread;
  const double square = kSquare_rad * kSquare_rad;
  if (off * off < 9.0 * (variance + square)) turn -= off * variance / (variance + square);
  const Eigen::Matrix3d axes = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Rigid3 first_from_second(axes, a - axes * b);

  for (std::size_t i = 0; i < places[0].size(); ++i) {
    const double apart = (first_from_second * places[1][i] - places[0][i]).norm();
    if (apart < kGate_m) continue;
    return core::usage_error(
        fmt::format("--pick: pick {} fits the others to {:.0f} cm only; they are x,y,z in the first map = "
                    "x,y,z in the second",
                    i + 1, 100.0 * apart));
  }

  return first_from_second;
}

/// The component that holds most of a stored map.
std::size_t main_part(const maps::StoredMap& stored, const std::vector<RobotMap>& parts) {
  const core::KeyframeId root = maps::main_root(stored.map, stored.frames);
  const auto part =
      std::find_if(parts.begin(), parts.end(), [&](const RobotMap& p) { return p.map->has_keyframe(root); });
  return static_cast<std::size_t>(part - parts.begin());
}

}  // namespace

core::Result<mapping::MergeEvidence> picked_merge(const maps::StoredMaps& maps,
                                                  const std::vector<RobotMap>& parts,
                                                  const core::Executor& executor) {
  Places places;
  for (const maps::Pick& pick : maps.picks()) {
    places[pick.first_part].push_back(pick.first);
    places[1 - pick.first_part].push_back(pick.second);
  }

  const auto laid = laid_by_picks(places);
  if (!laid) return tl::unexpected(laid.error());

  // The maps are tied together by keyframes that saw the picked places, so each needs a surface there.
  std::array<std::vector<adjust::PlaceViews>, 2> seen;
  std::array<const maps::StoredMap*, 2> stored{};
  for (std::size_t p = 0; p < 2; ++p) {
    stored[p] = &maps.parts()[p].run.stored();
    if (!stored[p]->result.upright)
      return core::usage_error("--pick: " + maps.parts()[p].name +
                               " is not upright; map again without fuse.up=none");
    seen[p] = adjust::find_place_views(maps, p, places[p], executor);

    for (std::size_t i = 0; i < seen[p].size(); ++i) {
      if (!seen[p][i].empty()) continue;
      return core::usage_error(fmt::format(
          "--pick: in {} no keyframe saw a surface within 6 cm of {:.3f},{:.3f},{:.3f}; pick on a surface",
          maps.parts()[p].name, places[p][i].x(), places[p][i].y(), places[p][i].z()));
    }
  }

  mapping::MergeEvidence merge;
  merge.accepted = true;
  merge.a = main_part(*stored[0], parts);
  merge.b = main_part(*stored[1], parts);

  // Evidence has the earlier component as a, whichever map the picks name first.
  const bool swapped = merge.b < merge.a;
  const std::size_t first = swapped ? 1 : 0;
  if (swapped) std::swap(merge.a, merge.b);
  const Rigid3 first_from_second =
      stored[0]->result.output_from_map.inverse() * *laid * stored[1]->result.output_from_map;
  merge.alignment.a_from_b = swapped ? first_from_second.inverse() : first_from_second;

  // Each pick is a constraint between keyframes of both maps, good to 1 cm and 0.01 rad.
  merge.alignment.covariance = geometry::information_of(0.01, 0.01).inverse();
  for (std::size_t i = 0; i < places[0].size(); ++i) {
    mapping::VerifiedPair& pair = merge.pairs.emplace_back();
    pair.match = seen[first][i].front().first;
    pair.query = seen[1 - first][i].front().first;
    pair.evidence.accepted = true;
    pair.evidence.query_from_match = stored[1 - first]->map.camera_from_world(pair.query) *
                                     merge.alignment.a_from_b.inverse() *
                                     stored[first]->map.camera_from_world(pair.match).inverse();
    pair.evidence.information = geometry::information_of(0.01, 0.01);
  }

  return merge;
}

}  // namespace plumbline::pipeline
