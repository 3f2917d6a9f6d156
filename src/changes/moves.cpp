// SPDX-License-Identifier: BSD-3-Clause
// Objects that have vanished at one place and appeared at another.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "clusters.hpp"
#include "point_search.hpp"

namespace plumbline::changes {
namespace {

using geometry::Rigid3;

constexpr double kReach_m = 0.02;      // points this near to a surface are on it
constexpr double kExplained = 0.7;     // least share of its places on a surface
constexpr std::size_t kTargets = 12;   // pieces that it may have become, largest first
constexpr std::size_t kSamples = 150;  // places of a thing that are tried

struct Samples {
  std::vector<Eigen::Vector3f> points, normals;
};

/// At most `most` places of a piece, evenly taken.
Samples samples_of(const std::vector<Place>& places, const Piece& piece, std::size_t most) {
  const std::size_t step = std::max<std::size_t>(1, (piece.size() + most - 1) / most);
  Samples samples;
  for (std::size_t k = 0; k < piece.size(); k += step) {
    samples.points.push_back(places[piece[k]].at);
    samples.normals.push_back(places[piece[k]].normal);
  }
  return samples;
}

Eigen::Vector3d middle_of(const Samples& samples) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& p : samples.points) sum += p.cast<double>();
  return sum / std::max<double>(1.0, static_cast<double>(samples.points.size()));
}

/// A surface that things are laid onto.
struct Ground {
  const Surface& surface;
  PointSearch search;
  PointSearch changed;  ///< places that have no counterpart on the other day

  struct Hit {
    Eigen::Vector3f point{0, 0, 0}, normal{0, 0, 1};
  };
  /// The nearest point that faces like `normal`.
  [[nodiscard]] std::optional<Hit> at(const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
                                      double reach_m, PointSearch::Found& found) const {
    search.nearest(point, 4, found);
    for (const auto& [index, squared] : found) {
      if (static_cast<double>(squared) > reach_m * reach_m) break;
      const float facing = surface.normals[index].dot(normal);
      if ((surface.oriented ? facing : std::abs(facing)) > 0.8F)
        return Hit{surface.points[index], surface.normals[index]};
    }
    return std::nullopt;
  }
};

/// An object placed on the ground, and the quality of its fit.
struct Fit {
  Rigid3 motion;  ///< ground from thing
  double turn = 0.0;
  double share = 0.0;    ///< of its places with a surface there
  double changed = 0.0;  ///< of its places where that surface is new
  double rms_m = 0.0;
};

/// Measures how much of the object has a surface below it at the fitted pose, and how much of that is new.
void judge(const Samples& thing, const Ground& ground, Fit& fit) {
  constexpr double kChanged_m = 0.04;
  PointSearch::Found found;
  const Eigen::Matrix3f turn = fit.motion.rotation.cast<float>();
  double hits = 0.0, changed = 0.0, squares = 0.0;

  // Places with a surface near by that faces the same way
  for (std::size_t i = 0; i < thing.points.size(); ++i) {
    const Eigen::Vector3f p = (fit.motion * thing.points[i].cast<double>()).cast<float>();
    const auto hit = ground.at(p, turn * thing.normals[i], kReach_m, found);
    if (!hit) continue;
    const double off = static_cast<double>((p - hit->point).dot(hit->normal));
    hits += 1.0;
    squares += off * off;

    // The surface is new where a changed place is near
    ground.changed.nearest(p, 1, found);
    if (!found.empty() && static_cast<double>(found.front().second) < kChanged_m * kChanged_m) changed += 1.0;
  }

  // Shares of all places of the object
  const double all = std::max<double>(1.0, static_cast<double>(thing.points.size()));
  fit.share = hits / all;
  fit.changed = changed / all;
  fit.rms_m = std::sqrt(squares / std::max(1.0, hits));
}

/// ICP of four degrees of freedom: a turn about `up` and a shift; point to plane, with a little point to
/// point that holds what planes leave free.
void settle(const Samples& thing, const Ground& ground, const Eigen::Vector3d& up, int rounds, Fit& fit) {
  constexpr double kAlong = 0.1;  // weight of the distance within the plane
  PointSearch::Found found;
  double reach_m = 0.12;

  // Gauss-Newton with a reach that shrinks as the fit gets better
  for (int round = 0; round < rounds; ++round, reach_m = std::max(0.03, 0.75 * reach_m)) {
    const Eigen::Vector3d middle = fit.motion * middle_of(thing);
    Eigen::Matrix4d h = 1e-9 * Eigen::Matrix4d::Identity();
    Eigen::Vector4d g = Eigen::Vector4d::Zero();

    for (std::size_t i = 0; i < thing.points.size(); ++i) {
      const Eigen::Vector3d p = fit.motion * thing.points[i].cast<double>();
      const auto hit =
          ground.at(p.cast<float>(), (fit.motion.rotation * thing.normals[i].cast<double>()).cast<float>(),
                    reach_m, found);
      if (!hit) continue;

      // Point-to-plane with a small point-to-point weight
      const Eigen::Vector3d n = hit->normal.cast<double>();
      const Eigen::Matrix3d weight = n * n.transpose() + kAlong * kAlong * Eigen::Matrix3d::Identity();
      Eigen::Matrix<double, 3, 4> j;
      j.leftCols<3>().setIdentity();
      j.col(3) = up.cross(p - middle);
      h += j.transpose() * weight * j;
      g += j.transpose() * weight * (hit->point.cast<double>() - p);
    }

    // The turn is about the object's middle
    const Eigen::Vector4d step = h.ldlt().solve(g);
    const Eigen::AngleAxisd turn(step[3], up);
    const Rigid3 about{turn.toRotationMatrix(), middle + step.head<3>() - turn.toRotationMatrix() * middle};
    fit.motion = about * fit.motion;
    fit.turn += step[3];
    if (step.norm() < 1e-4) break;
  }

  judge(thing, ground, fit);
}

Fit start(const Samples& thing, const Eigen::Vector3d& to, double turn, const Eigen::Vector3d& up) {
  Fit fit;
  fit.turn = turn;
  fit.motion.rotation = Eigen::AngleAxisd(turn, up).toRotationMatrix();
  fit.motion.translation = to - fit.motion.rotation * middle_of(thing);
  return fit;
}

/// The best place of a thing on the ground: near where it was, or where its middle comes to one of `targets`,
/// turned by steps of 15 degrees. Of places about as good the one with the least turn.
Fit best_place(const Samples& thing, const Ground& ground, const std::vector<Eigen::Vector3d>& targets,
               const Eigen::Vector3d& up) {
  constexpr int kTurns = 12;  // of 15 degrees, each way
  constexpr double kStep_m = 0.1;
  constexpr int kSteps = 6;  // each way
  constexpr std::size_t kSettled = 12;

  // Starts at each target, in all directions
  std::vector<Fit> fits;
  for (const Eigen::Vector3d& target : targets) {
    for (int t = -kTurns + 1; t <= kTurns; ++t) fits.push_back(start(thing, target, M_PI / kTurns * t, up));
  }

  // Starts on a grid about the object's old place, without a turn
  const Eigen::Vector3d x = up.unitOrthogonal(), y = up.cross(x), middle = middle_of(thing);
  for (int a = -kSteps; a <= kSteps; ++a) {
    for (int b = -kSteps; b <= kSteps; ++b) {
      if (a != 0 || b != 0) fits.push_back(start(thing, middle + kStep_m * (a * x + b * y), 0.0, up));
    }
  }

  // A few rounds with few samples, then the best ones to the end.
  Samples few;
  for (std::size_t i = 0; i < thing.points.size(); i += 5) {
    few.points.push_back(thing.points[i]);
    few.normals.push_back(thing.normals[i]);
  }
  const auto value = [&](const Fit& fit) {  // what has not gone anywhere has not moved
    const bool stays = (fit.motion * middle - middle).norm() < 0.04 && std::abs(fit.turn) < 0.1;
    return stays ? -1.0 : fit.share + 0.5 * fit.changed - 0.15 * std::abs(fit.turn);
  };

  for (Fit& fit : fits) settle(few, ground, up, 3, fit);
  std::stable_sort(fits.begin(), fits.end(), [&](const Fit& a, const Fit& b) { return value(a) > value(b); });
  fits.resize(std::min(fits.size(), kSettled));
  for (Fit& fit : fits) settle(thing, ground, up, 20, fit);
  Fit best = *std::max_element(fits.begin(), fits.end(),
                               [&](const Fit& a, const Fit& b) { return value(a) < value(b); });
  if (value(best) < 0.0) best.share = 0.0;
  return best;
}

/// True if the places face at least two ways: a single plane fits any wall.
bool has_shape(const std::vector<Eigen::Vector3f>& normals) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3f& n : normals) sum += n.cast<double>() * n.cast<double>().transpose();
  const Eigen::Vector3d values = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvalues();
  return values[1] > 0.06 * values.sum();
}

/// Share of an object's surroundings, along its faces, where the surface continues: a part of a wall does.
double goes_on(const Samples& thing, const Ground& ground, const Rigid3& motion) {
  const PointSearch search(thing.points);
  PointSearch::Found found;

  // Spacing of the object's own places
  std::vector<float> apart;
  for (const Eigen::Vector3f& p : thing.points) {
    search.nearest(p, 2, found);
    apart.push_back(found.size() < 2 ? 0.03F : std::sqrt(found[1].second));
  }
  std::nth_element(apart.begin(), apart.begin() + static_cast<long>(apart.size() / 2), apart.end());
  const float spacing = apart[apart.size() / 2];

  double outside = 0.0, ground_there = 0.0;

  // Points next to its rim, on all four sides in the plane
  for (std::size_t i = 0; i < thing.points.size(); ++i) {
    const Eigen::Vector3f n = thing.normals[i], u = n.unitOrthogonal(), v = n.cross(u);

    for (const Eigen::Vector3f& beside : {u, v, Eigen::Vector3f(-u), Eigen::Vector3f(-v)}) {
      const Eigen::Vector3f p = thing.points[i] + 4.0F * spacing * beside;
      search.nearest(p, 1, found);
      if (found.front().second < 9.0F * spacing * spacing) continue;
      outside += 1.0;
      const Eigen::Vector3d at = motion * p.cast<double>(), normal = motion.rotation * n.cast<double>();
      if (ground.at(at.cast<float>(), normal.cast<float>(), kReach_m, found)) ground_there += 1.0;
    }
  }

  return ground_there / std::max(1.0, outside);
}

class Moves {
 public:
  Moves(const std::vector<Place>& places, const std::vector<Piece>& vanished,
        const std::vector<Piece>& appeared, const SurfacePair& surfaces, const Eigen::Vector3d& up)
      : up_(up),
        gone_(lone(places, false)),
        come_(lone(places, true)),
        before_{surfaces.before, PointSearch(surfaces.before.points), PointSearch(gone_)},
        after_{surfaces.after, PointSearch(surfaces.after.points), PointSearch(come_)} {
    // Every piece is tried with a limited number of its places
    for (const Piece& piece : vanished) vanished_.push_back(samples_of(places, piece, kSamples));
    for (const Piece& piece : appeared) appeared_.push_back(samples_of(places, piece, kSamples));
  }

  /// For the piece by itself: its best place on the other day.
  [[nodiscard]] Fit of(std::size_t piece, bool vanished) const {
    std::vector<Eigen::Vector3d> targets;
    for (const Samples& other : vanished ? appeared_ : vanished_) {
      if (targets.size() < kTargets) targets.push_back(middle_of(other));
    }
    return best_place((vanished ? vanished_ : appeared_)[piece], vanished ? after_ : before_, targets, up_);
  }

  /// All pieces that a motion explains, if they show that it is one thing.
  [[nodiscard]] std::optional<Move> confirm(const Fit& fit, bool vanished,
                                            const std::vector<std::uint8_t>& used_v,
                                            const std::vector<std::uint8_t>& used_a) const {
    // The motion from the earlier to the later map
    Move move;
    move.after_from_before = vanished ? fit.motion : fit.motion.inverse();
    move.turn_rad = std::remainder(vanished ? fit.turn : -fit.turn, 2.0 * M_PI);
    move.rms_m = fit.rms_m;
    std::vector<Eigen::Vector3f> normals;
    double all = 0.0, changed = 0.0;

    // A piece belongs to the object if most of it fits under the same motion
    const auto take = [&](const std::vector<Samples>& pieces, const std::vector<std::uint8_t>& used,
                          const Ground& ground, const Rigid3& motion, std::vector<std::size_t>& taken) {
      for (std::size_t k = 0; k < pieces.size(); ++k) {
        Fit alike;
        alike.motion = motion;
        if (used[k] != 0) continue;

        judge(pieces[k], ground, alike);
        if (alike.share < kExplained) continue;
        taken.push_back(k);
        normals.insert(normals.end(), pieces[k].normals.begin(), pieces[k].normals.end());
        all += static_cast<double>(pieces[k].points.size());
        changed += alike.changed * static_cast<double>(pieces[k].points.size());
      }
    };

    take(vanished_, used_v, after_, move.after_from_before, move.vanished);
    take(appeared_, used_a, before_, move.after_from_before.inverse(), move.appeared);

    // A single plane fits any wall, so it needs changed surface and an edge
    constexpr double kMostlyChanged = 0.5;
    const bool both = !move.vanished.empty() && !move.appeared.empty();
    const bool certain = all > 0.0 && changed / all >= kMostlyChanged;
    if (both ? has_shape(normals) || certain : certain && (has_shape(normals) || bounded(move))) return move;
    return std::nullopt;
  }

 private:
  /// True if the surface that the one piece of a move comes to lie on ends where the piece does.
  [[nodiscard]] bool bounded(const Move& move) const {
    constexpr double kMost = 0.3;
    if (move.appeared.empty())
      return goes_on(vanished_[move.vanished[0]], after_, move.after_from_before) < kMost;
    return goes_on(appeared_[move.appeared[0]], before_, move.after_from_before.inverse()) < kMost;
  }
  /// Places without a counterpart on the other day.
  static std::vector<Eigen::Vector3f> lone(const std::vector<Place>& places, bool later) {
    std::vector<Eigen::Vector3f> points;
    for (const Place& place : places) {
      if (place.later == later && !place.distance.known()) points.push_back(place.at);
    }
    return points;
  }

  Eigen::Vector3d up_;
  std::vector<Eigen::Vector3f> gone_, come_;
  Ground before_, after_;
  std::vector<Samples> vanished_, appeared_;
};

}  // namespace

std::vector<Move> find_moves(const std::vector<Place>& places, const std::vector<Piece>& vanished,
                             const std::vector<Piece>& appeared, const SurfacePair& surfaces,
                             const Eigen::Vector3d& up, const core::Executor& executor) {
  constexpr std::size_t kMost = 60;  // pieces that are tried, largest first
  const Moves moves(places, vanished, appeared, surfaces, up);

  struct Try {
    std::size_t piece;
    bool vanished;
    Fit fit = {};
  };

  // The best pose of every large piece by itself
  std::vector<Try> tries;
  for (std::size_t k = 0; k < std::min(kMost, vanished.size()); ++k) tries.push_back({k, true});
  for (std::size_t k = 0; k < std::min(kMost, appeared.size()); ++k) tries.push_back({k, false});
  executor.parallel_for(tries.size(),
                        [&](std::size_t k) { tries[k].fit = moves.of(tries[k].piece, tries[k].vanished); });

  // The largest pieces choose first.
  const auto size = [&](const Try& t) { return (t.vanished ? vanished : appeared)[t.piece].size(); };
  std::stable_sort(tries.begin(), tries.end(), [&](const Try& a, const Try& b) { return size(a) > size(b); });
  std::vector<std::uint8_t> used_v(vanished.size(), 0), used_a(appeared.size(), 0);
  std::vector<Move> found;

  for (const Try& t : tries) {
    if ((t.vanished ? used_v : used_a)[t.piece] != 0 || t.fit.share < kExplained) continue;
    auto move = moves.confirm(t.fit, t.vanished, used_v, used_a);
    if (!move) continue;
    for (const std::size_t k : move->vanished) used_v[k] = 1;
    for (const std::size_t k : move->appeared) used_a[k] = 1;
    found.push_back(std::move(*move));
  }
  return found;
}

}  // namespace plumbline::changes
