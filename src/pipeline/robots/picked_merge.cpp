// SPDX-License-Identifier: BSD-3-Clause
#include "robots/picked_merge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <string>

#include "plumbline/adjust/place_views.hpp"
#include "plumbline/geometry/adjoint.hpp"
#include "plumbline/maps/components.hpp"
#include "plumbline/maps/stored_maps.hpp"

namespace plumbline::pipeline {
namespace {

using geometry::Rigid3;

/// Places in both maps, by part, and the maps' names.
struct Places {
  std::array<std::vector<Eigen::Vector3d>, 2> in;
  std::array<std::string, 2> names;
};

constexpr double kGate_m = 0.1;        // places of a pick that are further from each other are different ones
constexpr double kLeastSpread = 0.02;  // m^2, of two picks 20 cm apart; nearer ones leave the turn open

/// first_from_second of their results' frames, by all picks but one.
struct Laid {
  Rigid3 first_from_second;
  double spread = 0.0;    ///< m^2, sum of squared distances from the middle, as seen from above
  double largest = 0.0;   ///< m, between the two places of a pick
  std::size_t worst = 0;  ///< that pick
};

/// Least squares, the turn also by walls that are square. `without`: the pick that does not count.
Laid lay(const Places& places, std::size_t without) {
  constexpr double kPick_m = 0.01;      // standard deviation of a pick
  constexpr double kSquare_rad = 0.01;  // and of walls that are square

  // Both maps are upright, so they differ by a shift and a turn about z; the centroids determine the shift.
  const std::size_t all = places.in[0].size();
  const auto count = static_cast<double>(without < all ? all - 1 : all);
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();

  for (std::size_t i = 0; i < all; ++i) {
    if (i == without) continue;
    a += places.in[0][i] / count;
    b += places.in[1][i] / count;
  }

  // With positions as complex numbers, seen from above, the angle of this sum is the least-squares turn.
  Laid laid;
  std::complex<double> sum(0.0, 0.0);
  for (std::size_t i = 0; i < all; ++i) {
    if (i == without) continue;
    const Eigen::Vector3d p = places.in[0][i] - a, q = places.in[1][i] - b;
    sum += std::conj(std::complex<double>(q.x(), q.y())) * std::complex<double>(p.x(), p.y());
    laid.spread += q.head<2>().squaredNorm();
  }

  // Both frames are along walls, so the turn is probably a multiple of 90 degrees: within three standard
  // deviations of one, picks and walls are averaged, weighted by their variances.
  double turn = std::arg(sum);
  const double off = std::remainder(turn, M_PI / 2);
  const double variance = 2.0 * kPick_m * kPick_m / std::max(1e-6, laid.spread);
  const double square = kSquare_rad * kSquare_rad;
  if (off * off < 9.0 * (variance + square)) turn -= off * variance / (variance + square);
  const Eigen::Matrix3d axes = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  laid.first_from_second = Rigid3(axes, a - axes * b);

  for (std::size_t i = 0; i < all; ++i) {
    const double apart = (laid.first_from_second * places.in[1][i] - places.in[0][i]).norm();
    if (i == without || apart <= laid.largest) continue;
    laid.largest = apart;
    laid.worst = i;
  }

  return laid;
}

/// Which picks do not fit together, and by how much.
tl::unexpected<core::Error> contradiction(const Places& places, const Laid& laid) {
  constexpr const char* kForm = "a pick is x,y,z in the first map = x,y,z of the same place in the second";
  const std::size_t all = places.in[0].size();
  if (all == 2) {
    return core::usage_error(fmt::format(
        "--pick: picks 1 and 2 contradict each other: {:.2f} m from one to the other in {}, {:.2f} m "
        "in {}; {}",
        (places.in[0][0] - places.in[0][1]).norm(), places.names[0],
        (places.in[1][0] - places.in[1][1]).norm(), places.names[1], kForm));
  }

  // If all others fit together once a single one is left out, that one is wrong.
  std::vector<std::size_t> suspects;
  for (std::size_t i = 0; i < all; ++i) {
    const Laid others = lay(places, i);
    if (others.spread >= kLeastSpread && others.largest < kGate_m) suspects.push_back(i);
  }

  if (suspects.size() == 1) {
    const Rigid3 fit = lay(places, suspects[0]).first_from_second;
    const double off = (fit * places.in[1][suspects[0]] - places.in[0][suspects[0]]).norm();
    return core::usage_error(
        fmt::format("--pick: pick {} is {:.0f} cm from where the others put it, which fit together; {}",
                    suspects[0] + 1, 100.0 * off, kForm));
  }
  return core::usage_error(
      fmt::format("--pick: the picks contradict each other, pick {} most: it fits the others to {:.0f} "
                  "cm only; {}",
                  laid.worst + 1, 100.0 * laid.largest, kForm));
}

/// Errors (kUsage): too few picks, too near each other, or of different places.
core::Result<Rigid3> laid_by_picks(const Places& places) {
  const std::size_t all = places.in[0].size();
  if (all < 2) {
    return core::usage_error(
        "--pick: a single pick leaves the turn between the maps open; pick a second place at least 20 cm "
        "away, as seen from above: both jambs of a door");
  }

  const Laid laid = lay(places, all);
  if (laid.spread < kLeastSpread) {
    return core::usage_error(
        "--pick: two picks must lie at least 20 cm from each other, as seen from above; pick both jambs of a "
        "door");
  }

  if (laid.largest >= kGate_m) return contradiction(places, laid);
  return laid.first_from_second;
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
  for (std::size_t p = 0; p < 2; ++p) places.names[p] = maps.parts()[p].name;
  for (const maps::Pick& pick : maps.picks()) {
    places.in[pick.first_part].push_back(pick.first);
    places.in[1 - pick.first_part].push_back(pick.second);
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
    seen[p] = adjust::find_place_views(maps, p, places.in[p], executor);

    for (std::size_t i = 0; i < seen[p].size(); ++i) {
      if (!seen[p][i].empty()) continue;
      return core::usage_error(fmt::format(
          "--pick: pick {}: in {} no keyframe saw a surface within 6 cm of {:.3f},{:.3f},{:.3f}; pick on a "
          "surface",
          i + 1, maps.parts()[p].name, places.in[p][i].x(), places.in[p][i].y(), places.in[p][i].z()));
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
  for (std::size_t i = 0; i < places.in[0].size(); ++i) {
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
