// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/changes/changes.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "clusters.hpp"
#include "plumbline/cloud/fusion/cell_map.hpp"
#include "point_search.hpp"

namespace plumbline::changes {
namespace {

/// The point nearest to the centre of each cell, one for each way that points face.
std::vector<std::uint32_t> core_points(const Surface& surface, double spacing_m) {
  struct Candidate {
    std::uint64_t cell;
    int facing;
    float off;
    std::uint32_t index;
    bool operator<(const Candidate& o) const {
      return std::tie(cell, facing, off, index) < std::tie(o.cell, o.facing, o.off, o.index);
    }
  };

  // Every point with its cell and the direction it faces
  std::vector<Candidate> all;
  all.reserve(surface.points.size());
  for (std::uint32_t i = 0; i < surface.points.size(); ++i) {
    // Among the points of a cell the one nearest to its centre comes first
    const Eigen::Vector3d at = surface.points[i].cast<double>() / spacing_m;
    const Eigen::Vector3i cell = cloud::cell_of(at);
    const double off = (at - cell.cast<double>()).array().operator-(0.5).matrix().squaredNorm();
    const int facing = surface.oriented ? cloud::facing(surface.normals[i]) : 0;
    all.push_back({cloud::pack_cell(cell), facing, static_cast<float>(off), i});
  }
  std::sort(all.begin(), all.end());

  // One point per cell and direction
  std::vector<Eigen::Vector3f> points;
  std::vector<std::uint32_t> candidates;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i > 0 && all[i].cell == all[i - 1].cell && all[i].facing == all[i - 1].facing) continue;
    candidates.push_back(all[i].index);
    points.push_back(surface.points[all[i].index]);
  }

  // A surface along the border of two cells has one point in each: the first of two near ones stays.
  const PointSearch search(points);
  PointSearch::Found found;
  std::vector<std::uint8_t> kept(candidates.size(), 0);
  std::vector<std::uint32_t> chosen;

  for (std::uint32_t k = 0; k < candidates.size(); ++k) {
    search.within(points[k], 0.5 * spacing_m, found);
    const bool near = std::any_of(found.begin(), found.end(), [&](const auto& f) {
      return kept[f.first] != 0 &&
             surface.normals[candidates[f.first]].dot(surface.normals[candidates[k]]) > 0.7F;
    });
    if (near) continue;
    kept[k] = 1;
    chosen.push_back(candidates[k]);
  }

  return chosen;
}

struct Cores {
  std::vector<Eigen::Vector3f> points, normals;
  std::vector<Distance> distances;
};

/// Core points of the earlier or the later surface, with distances that leave out the registration's error.
Cores measured_cores(const Surface& of, const SurfacePair& surfaces, const ChangeOptions& options,
                     const core::Executor& executor) {
  Cores cores;
  for (const std::uint32_t i : core_points(of, options.spacing_m)) {
    cores.points.push_back(of.points[i]);
    cores.normals.push_back(of.normals[i]);
  }
  cores.distances = distances(cores.points, cores.normals, surfaces, 0.0, options.distance, executor);
  return cores;
}

/// Classifies places of one surface that the other lacks: changed if the other's cameras saw through them.
void judge_lone(std::vector<Place>& places, std::size_t first, PlaceKind changed, PlaceKind unseen,
                const LookedThrough& through) {
  std::vector<Eigen::Vector3f> asked;
  std::vector<std::size_t> which;
  for (std::size_t i = first; i < places.size(); ++i) {
    if (places[i].distance.known()) continue;
    places[i].kind = unseen;

    // Points of both near by, though too few for a distance
    const Distance& d = places[i].distance;
    if (d.before.count > 0 && d.after.count > 0) continue;  // the edge of a surface
    asked.push_back(places[i].at);
    which.push_back(i);
  }
  if (!through) return;

  // Cameras that saw free space there make it a change
  const std::vector<std::uint8_t> seen = through(asked);
  for (std::size_t k = 0; k < which.size(); ++k) {
    if (seen[k] != 0) places[which[k]].kind = changed;
  }
}

double median_of(std::vector<float> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

/// Box and area of pieces of one kind.
void add_piece(const std::vector<Place>& places, const Piece& piece, const ChangeOptions& options,
               Eigen::AlignedBox3d& box, Change& change) {
  for (const std::uint32_t i : piece) box.extend(places[i].at.cast<double>());
  change.places += piece.size();
  change.area_m2 += static_cast<double>(piece.size()) * options.spacing_m * options.spacing_m;
}

/// A surface that has moved along its normal by more than the limit of detection.
Change shifted_change(const std::vector<Place>& places, const Piece& piece, const ChangeOptions& options) {
  Change change;
  change.kind = ChangeKind::kShifted;
  add_piece(places, piece, options, change.before, change);
  std::vector<float> ways, limits;

  // The median shift withstands single outliers
  Eigen::Vector3f normal(0, 0, 0);
  for (const std::uint32_t i : piece) {
    ways.push_back(places[i].distance.shift_m);
    limits.push_back(places[i].distance.limit_m);
    normal += places[i].normal;
  }

  // The limit of detection is the 95 % bound of a normal error
  change.shift_m = median_of(std::move(ways));
  change.limit_m = median_of(std::move(limits));
  change.sigma_m = change.limit_m / 1.96;
  change.normal = normal.normalized().cast<double>();

  // The surface keeps its shape and moves along its mean normal
  change.after_from_before.translation = change.shift_m * change.normal;
  change.after = change.before;
  change.after.translate(change.after_from_before.translation);
  change.volume_m3 = change.area_m2 * std::abs(change.shift_m);
  return change;
}

/// All changes, and in `places` which of them each is part of.
class Listing {
 public:
  Listing(std::vector<Place>& places, const ChangeOptions& options, double registration_m)
      : places_(places), options_(options), registration_m_(registration_m) {}

  void add(Change change, const std::vector<const Piece*>& pieces) {
    if (change.kind != ChangeKind::kShifted) {
      change.volume_m3 = change.box().volume();
      change.sigma_m = std::hypot(change.sigma_m, registration_m_);
    }
    changes_.emplace_back(std::move(change), pieces);
  }
  void add_lone(ChangeKind kind, const Piece& piece) {
    Change change;
    change.kind = kind;
    add_piece(places_, piece, options_, kind == ChangeKind::kVanished ? change.before : change.after, change);
    add(std::move(change), {&piece});
  }
  /// One change for all pieces of an object, in both maps.
  void add_move(const Move& move, const std::vector<Piece>& vanished, const std::vector<Piece>& appeared) {
    Change change;
    change.kind = ChangeKind::kMoved;
    std::vector<const Piece*> pieces;
    for (const std::size_t k : move.vanished) {
      add_piece(places_, vanished[k], options_, change.before, change);
      pieces.push_back(&vanished[k]);
    }
    for (const std::size_t k : move.appeared) {
      add_piece(places_, appeared[k], options_, change.after, change);
      pieces.push_back(&appeared[k]);
    }
    change.after_from_before = move.after_from_before;
    change.turn_rad = move.turn_rad;
    change.sigma_m = move.rms_m;
    add(std::move(change), pieces);
  }

  /// Sorted by area, the largest first; each place gets the number of its change.
  std::vector<Change> finish() {
    std::stable_sort(changes_.begin(), changes_.end(),
                     [](const auto& a, const auto& b) { return a.first.area_m2 > b.first.area_m2; });
    std::vector<Change> result;
    for (auto& [change, pieces] : changes_) {
      for (const Piece* piece : pieces) {
        for (const std::uint32_t i : *piece) places_[i].change = static_cast<int>(result.size());
      }
      result.push_back(std::move(change));
    }
    return result;
  }

 private:
  std::vector<Place>& places_;
  const ChangeOptions& options_;
  double registration_m_;
  std::vector<std::pair<Change, std::vector<const Piece*>>> changes_;
};

/// All changes of the two maps: moved objects first, for their pieces must not be listed as lone ones too.
std::vector<Change> list_changes(std::vector<Place>& places, const SurfacePair& surfaces,
                                 const Eigen::Vector3d& up, double registration_m,
                                 const ChangeOptions& options, const core::Executor& executor) {
  const std::vector<Piece> vanished = pieces_of(places, PlaceKind::kVanished, options);
  const std::vector<Piece> appeared = pieces_of(places, PlaceKind::kAppeared, options);
  const std::vector<Piece> shifted = pieces_of(places, PlaceKind::kShifted, options);
  const std::vector<Move> moves = find_moves(places, vanished, appeared, surfaces, up, executor);

  // Pieces that a motion explains
  Listing listing(places, options, registration_m);
  std::vector<std::uint8_t> moved_v(vanished.size(), 0), moved_a(appeared.size(), 0);
  for (const Move& move : moves) {
    listing.add_move(move, vanished, appeared);
    for (const std::size_t k : move.vanished) moved_v[k] = 1;
    for (const std::size_t k : move.appeared) moved_a[k] = 1;
  }

  // All other pieces have only vanished or appeared
  for (std::size_t k = 0; k < vanished.size(); ++k) {
    if (moved_v[k] == 0) listing.add_lone(ChangeKind::kVanished, vanished[k]);
  }
  for (std::size_t k = 0; k < appeared.size(); ++k) {
    if (moved_a[k] == 0) listing.add_lone(ChangeKind::kAppeared, appeared[k]);
  }
  for (const Piece& piece : shifted) listing.add(shifted_change(places, piece, options), {&piece});
  return listing.finish();
}

}  // namespace

void ChangeOptions::declare(core::OptionTable& table) {
  table.number("diameter", distance.diameter_m, {0.02, 2.0}, "m",
               "Diameter of the cylinder whose points are averaged");
  table.number("depth", distance.depth_m, {0.01, 2.0}, "m",
               "Largest shift of a surface; beyond it, it has moved");
  table.integer("min_points", distance.min_points, {2, 1000}, "",
                "Points of each cloud that a distance needs");
  table.number("spacing", spacing_m, {0.01, 1.0}, "m", "Spacing of the places that are compared");
  table.number("min_size", min_size_m, {0.02, 10.0}, "m", "Smallest extent of a change that is listed");
  table.number("min_shift", min_shift_m, {0.0, 1.0}, "m", "Smallest shift of a surface that is listed");
}

const char* name_of(PlaceKind kind) {
  constexpr std::array<const char*, 6> kNames = {"same",     "shifted",         "appeared",
                                                 "vanished", "not seen before", "not seen after"};
  return kNames[static_cast<std::size_t>(kind)];
}

const char* name_of(ChangeKind kind) {
  constexpr std::array<const char*, 4> kNames = {"appeared", "vanished", "moved", "shifted"};
  return kNames[static_cast<std::size_t>(kind)];
}

Comparison find_changes(const SurfacePair& surfaces, const LookedThrough& through_before,
                        const LookedThrough& through_after, const Eigen::Vector3d& up,
                        const ChangeOptions& options, const core::Executor& executor) {
  Comparison result;
  const Cores of_before = measured_cores(surfaces.before, surfaces, options, executor);
  const Cores of_after = measured_cores(surfaces.after, surfaces, options, executor);
  result.registration_m = registration_sigma(of_before.points, of_before.normals, of_before.distances);

  // The limit of detection of a place needs the registration's error, which is known only now.
  std::vector<float> limits;
  for (std::size_t i = 0; i < of_before.points.size(); ++i) {
    Place place{of_before.points[i], of_before.normals[i], PlaceKind::kSame, false, of_before.distances[i]};

    // A shift within the limit may be noise
    Distance& d = place.distance;
    if (d.known()) {
      d.limit_m = static_cast<float>(detection_limit(d.before, d.after, result.registration_m));
      limits.push_back(d.limit_m);
      if (std::abs(d.shift_m) > d.limit_m) place.kind = PlaceKind::kShifted;
    }
    result.places.push_back(place);
  }

  result.median_limit_m = median_of(std::move(limits));
  judge_lone(result.places, 0, PlaceKind::kVanished, PlaceKind::kNotSeenAfter, through_after);

  // Later surface: only places that the earlier one lacks
  const std::size_t first = result.places.size();
  for (std::size_t i = 0; i < of_after.points.size(); ++i) {
    if (of_after.distances[i].known()) continue;
    result.places.push_back(
        {of_after.points[i], of_after.normals[i], PlaceKind::kNotSeenBefore, true, of_after.distances[i]});
  }
  judge_lone(result.places, first, PlaceKind::kAppeared, PlaceKind::kNotSeenBefore, through_before);

  // Share of the surface seen by both maps that agrees
  constexpr float kNear_m = 0.03F;
  double near = 0.0;
  for (const Place& place : result.places) {
    ++result.counts[static_cast<std::size_t>(place.kind)];
    if (place.distance.known() && std::abs(place.distance.shift_m) < kNear_m) near += 1.0;
  }

  const auto count = [&](PlaceKind kind) {
    return static_cast<double>(result.counts[static_cast<std::size_t>(kind)]);
  };
  const double both = count(PlaceKind::kSame) + count(PlaceKind::kShifted) + count(PlaceKind::kVanished) +
                      count(PlaceKind::kAppeared);
  result.agreement = near / std::max(1.0, both);
  result.changes = list_changes(result.places, surfaces, up, result.registration_m, options, executor);
  return result;
}

}  // namespace plumbline::changes
