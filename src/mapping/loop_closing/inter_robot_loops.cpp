// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closing/inter_robot_loops.hpp"

#include <algorithm>
#include <cmath>

#include "plumbline/geometry/adjoint.hpp"

namespace plumbline::mapping {

using core::KeyframeId;
using geometry::Matrix6d;
using geometry::Rigid3;

namespace {

constexpr int kIndexedAtATime = 8;          // keyframes: the frame waits
constexpr std::size_t kVerifiedOthers = 3;  // look-alikes to verify
constexpr int kSharedAtMost = 5;            // landmarks: more are the same surroundings, no loop

Matrix6d seen_from(const Matrix6d& covariance, const Rigid3& by) {
  const Matrix6d carry = geometry::adjoint(by);
  return carry * covariance * carry.transpose();
}

}  // namespace

void InterRobotLoops::update(places::Database& database) {
  others_ = inbox_->get();
  if (others_ == nullptr) return;
  int added = 0;
  for (const KeyframeId id : others_->map.keyframe_ids()) {
    const auto& features = others_->map.keyframe(id).features;
    if (features == nullptr || database.contains(id)) continue;
    database.add(id, features);
    if (++added == kIndexedAtATime) return;
  }
}

std::optional<Loop> InterRobotLoops::recognise(const places::Database& database, const maps::Map& map,
                                               KeyframeId keyframe) const {
  const auto& features = map.keyframe(keyframe).features;
  if (features == nullptr) return std::nullopt;
  const auto hits = database.query(*features).best(
      kVerifiedOthers, [&](KeyframeId id) { return others_->map.has_keyframe(id); });
  for (const places::Hit& hit : hits) {
    if (hit.score < options_.places.min_absolute) break;
    const sensor::Pinhole& theirs = others_->cameras.at(hit.keyframe.robot);
    Loop loop{keyframe, hit.keyframe,
              verify_place({&map, keyframe, camera_}, {&others_->map, hit.keyframe, theirs}, options_.verify,
                           options_.seed + static_cast<std::uint64_t>(keyframe.index))};
    if (loop.evidence.accepted) return loop;
  }
  return std::nullopt;
}

std::optional<Rigid3> InterRobotLoops::locate(places::Database& database, const maps::Map& image) {
  update(database);
  if (others_ == nullptr) return std::nullopt;
  const auto seen = recognise(database, image, image.keyframe_ids().front());
  if (!seen) return std::nullopt;
  return seen->evidence.query_from_match * others_->map.camera_from_world(seen->match);
}

/// The late query relative to the early one; none if that is not new information.
std::optional<Loop> InterRobotLoops::by_way_of(const maps::Map& map, const Loop& early, const Loop& late,
                                               double& chi2) const {
  const maps::Map& theirs = others_->map;

  // Keyframes that are close in time or share landmarks are related better by
  // the own map than by this detour.
  if (early.match.robot != late.match.robot || !map.has_keyframe(early.query) ||
      !theirs.has_keyframe(early.match) || !map.has_keyframe(late.query) ||
      map.keyframe(late.query).stamp - map.keyframe(early.query).stamp < options_.min_gap_s ||
      map.shared(early.query, late.query) >= kSharedAtMost) {
    return std::nullopt;
  }

  const Rigid3& late_from_match = late.evidence.query_from_match;
  const Rigid3 late_from_their_early = late_from_match * theirs.camera_from_world(late.match) *
                                       theirs.camera_from_world(early.match).inverse();
  Loop loop{late.query, early.query, late.evidence};
  Rigid3& late_from_early = loop.evidence.query_from_match;
  late_from_early = late_from_their_early * early.evidence.query_from_match.inverse();

  // The errors of both recognitions and of the other robot's path between them add up.
  const Matrix6d covariance = late.evidence.information.inverse() +
                              seen_from(path_covariance(theirs, early.match, late.match), late_from_match) +
                              seen_from(early.evidence.information.inverse(), late_from_early);
  loop.evidence.information = covariance.inverse();

  // Squared distance of the present relative pose from the measured one, in standard
  // deviations of the measurement.
  const Rigid3 now = map.camera_from_world(late.query) * map.camera_from_world(early.query).inverse();
  const geometry::Vector6d error = geometry::log_se3(now * late_from_early.inverse());
  chi2 = error.dot(loop.evidence.information * error);
  return loop;
}

std::vector<Loop> InterRobotLoops::detect(places::Database& database, const maps::Map& map,
                                          KeyframeId keyframe) {
  update(database);
  if (others_ == nullptr) return {};

  std::vector<Loop> verified;
  if (auto seen = recognise(database, map, keyframe)) verified.push_back(std::move(*seen));
  const std::vector<Loop> sure = pending_.confirm(others_->map, map, keyframe, verified, options_);
  std::vector<Loop> loops;

  // A confirmed sighting closes a loop only if an earlier one contradicts the present path beyond noise; of
  // several the worst contradiction is used.
  for (const Loop& late : sure) {
    std::optional<Loop> worst;
    double most = optimize::chi_square_gate(6);

    for (const Loop& early : sightings_) {
      double chi2 = 0.0;
      auto loop = by_way_of(map, early, late, chi2);
      if (!loop || chi2 <= most) continue;
      most = chi2;
      worst = std::move(loop);
    }

    if (worst) loops.push_back(std::move(*worst));
  }

  sightings_.insert(sightings_.end(), sure.begin(), sure.end());
  return loops;
}

}  // namespace plumbline::mapping
