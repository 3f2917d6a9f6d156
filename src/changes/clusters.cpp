// SPDX-License-Identifier: BSD-3-Clause
#include "clusters.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include "plumbline/cloud/fusion/cell_map.hpp"
#include "point_search.hpp"

namespace plumbline::changes {
namespace {

/// True for a shift that is no noise: maps also bend, by more than their median tells.
bool is_clear(const Place& place, const ChangeOptions& options) {
  constexpr float kClear = 2.5F;  // 4.9 standard deviations
  return std::abs(place.distance.shift_m) >=
         std::max(kClear * place.distance.limit_m, static_cast<float>(options.min_shift_m));
}

/// Which way a place went, for places that may be joined: of shifts, facing and sign.
int direction_of(const Place& place) {
  if (place.kind != PlaceKind::kShifted) return 0;
  return 2 * cloud::facing(place.normal) + (place.distance.shift_m < 0.0F ? 1 : 0);
}

/// Places of the kind that have enough of their like around them.
Piece dense_places(const std::vector<Place>& places, PlaceKind kind, const ChangeOptions& options) {
  constexpr std::size_t kFewest = 5;  // with the place itself; the seam along an edge has fewer
  Piece all;
  std::vector<Eigen::Vector3f> points;
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    if (places[i].kind != kind || (kind == PlaceKind::kShifted && !is_clear(places[i], options))) continue;
    all.push_back(i);
    points.push_back(places[i].at);
  }

  const PointSearch search(points);
  Piece dense;
  PointSearch::Found found;
  for (std::size_t k = 0; k < all.size(); ++k) {
    search.within(points[k], 2.2 * options.spacing_m, found);
    if (found.size() >= kFewest) dense.push_back(all[k]);
  }
  return dense;
}

std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

std::vector<Piece> pieces_of(const std::vector<Place>& places, PlaceKind kind, const ChangeOptions& options) {
  constexpr double kLeastArea = 0.015;      // m^2; noise of unchanged rooms makes specks of 0.01
  constexpr double kLeastShiftArea = 0.05;  // m^2
  const Piece chosen = dense_places(places, kind, options);
  std::vector<Eigen::Vector3f> points;
  for (const std::uint32_t i : chosen) points.push_back(places[i].at);

  // Union of neighbours.
  std::vector<std::uint32_t> parent(chosen.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const PointSearch search(points);
  PointSearch::Found found;

  for (std::uint32_t k = 0; k < chosen.size(); ++k) {
    search.within(points[k], 2.7 * options.spacing_m, found);
    for (const auto& [other, squared] : found) {
      if (direction_of(places[chosen[k]]) != direction_of(places[chosen[other]])) continue;
      const std::uint32_t a = root_of(parent, k), b = root_of(parent, other);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }

  // Large enough ones, largest first.
  std::map<std::uint32_t, Piece> by_root;
  for (std::uint32_t k = 0; k < chosen.size(); ++k) by_root[root_of(parent, k)].push_back(chosen[k]);
  const double least = kind == PlaceKind::kShifted ? kLeastShiftArea : kLeastArea;
  std::vector<Piece> pieces;

  for (auto& [root, piece] : by_root) {
    Eigen::AlignedBox3f box;
    for (const std::uint32_t i : piece) box.extend(places[i].at);
    const double area = static_cast<double>(piece.size()) * options.spacing_m * options.spacing_m;
    const double extent = static_cast<double>(box.sizes().maxCoeff()) + options.spacing_m;
    if (area >= least && extent >= options.min_size_m) pieces.push_back(std::move(piece));
  }

  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Piece& a, const Piece& b) { return a.size() > b.size(); });
  return pieces;
}

}  // namespace plumbline::changes
