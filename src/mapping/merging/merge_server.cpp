// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/merging/merge_server.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>

#include "plumbline/maps/components.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Matrix6d;
using geometry::Rigid3;

/// A pair is looked up once, by its newer keyframe, so more candidates are tried than if both keyframes were
/// looked up.
constexpr int kPlaces = 8;
constexpr int kPlacesWhenMet = 1;  // of a robot that has been met

MapFusionOptions live(MapFusionOptions options) {
  options.places.groups = kPlaces;
  options.merge_duplicates = false;
  return options;
}

std::pair<std::size_t, std::size_t> robots_of(const OverlapFinder::Candidate& candidate) {
  return {std::min(candidate.query_part, candidate.match_part),
          std::max(candidate.query_part, candidate.match_part)};
}

/// Covariance of a position and rotation in a world, moved by `arm` from its point of reference.
Matrix6d carried(const Matrix6d& covariance, const Eigen::Vector3d& arm) {
  Matrix6d carry = Matrix6d::Identity();
  carry.topRightCorner<3, 3>() = -geometry::skew(arm);
  return carry * covariance * carry.transpose();
}

Matrix6d turned(const Matrix6d& covariance, const Eigen::Matrix3d& rotation) {
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = rotation;
  turn.bottomRightCorner<3, 3>() = rotation;
  return turn * covariance * turn.transpose();
}

/// Middle of b's cameras that agree, in a's world.
Eigen::Vector3d middle(const MergeEvidence& merge, const maps::Map& b) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const VerifiedPair& pair : merge.pairs) {
    const KeyframeId of_b = b.has_keyframe(pair.query) ? pair.query : pair.match;
    sum += b.camera_from_world(of_b).inverse().translation;
  }
  return merge.alignment.a_from_b * (sum / std::max(1.0, static_cast<double>(merge.pairs.size())));
}

}  // namespace

MergeServer::MergeServer(const MapFusionOptions& options, int lag, const core::Executor& executor)
    : options_(live(options)), lag_(lag), executor_(&executor), work_{{}, {}, OverlapFinder(options_),
                                                                      {}, {}, {}} {}

std::size_t MergeServer::join(const Cameras& cameras) {
  job_.wait();
  work_.maps.push_back(std::make_shared<maps::Map>());
  work_.parts.push_back({work_.maps.back().get(), cameras});
  work_.places.emplace_back();
  places_.emplace_back();
  return places_.size() - 1;
}

void MergeServer::add(std::shared_ptr<const maps::Map> map, KeyframeId id, std::int64_t frame) {
  if (!id.valid() || static_cast<std::size_t>(id.robot) >= places_.size() || !map->has_keyframe(id)) {
    throw std::invalid_argument("a keyframe that no robot has");
  }
  // A robot that got lost takes part with its first component only, until others are joined to it.
  const std::vector<KeyframeId> roots = maps::roots(*map);
  if (roots.size() > 1) {
    if (maps::root_of(*map, id) != roots.front()) return;
    map = std::make_shared<maps::Map>(maps::component(*map, roots.front()));
  }
  waiting_.push_back({std::move(map), id, frame});
}

std::vector<MeetingEvent> MergeServer::commit(std::int64_t frame) {
  std::vector<MeetingEvent> events;
  if (busy_ && frame < due_) return events;
  if (busy_) events = put_back();
  if (!waiting_.empty()) begin(frame);
  return events;
}

std::vector<MeetingEvent> MergeServer::finish() {
  std::vector<MeetingEvent> events;
  if (busy_) events = put_back();
  for (const NewKeyframe& keyframe : std::exchange(waiting_, {})) look_up(keyframe);
  const std::vector<MeetingEvent> rest = put_back();
  events.insert(events.end(), rest.begin(), rest.end());
  return events;
}

void MergeServer::begin(std::int64_t frame) {
  due_ = frame + lag_;
  busy_ = true;
  job_ = executor_->submit([this, keyframes = std::exchange(waiting_, {})] {
    for (const NewKeyframe& keyframe : keyframes) look_up(keyframe);
  });
}

std::vector<MeetingEvent> MergeServer::put_back() {
  job_.wait();
  busy_ = false;
  update_places();
  places_ = work_.places;
  return std::exchange(work_.events, {});
}

std::optional<RobotPlace> MergeServer::place(std::size_t robot) const { return places_.at(robot); }

void MergeServer::look_up(const NewKeyframe& keyframe) {
  const auto robot = static_cast<std::size_t>(keyframe.id.robot);
  work_.maps[robot] = keyframe.map;
  work_.parts[robot].map = keyframe.map.get();
  verify(work_.finder.recognise(work_.parts, robot, keyframe.id, {}), keyframe);
  work_.finder.add(*keyframe.map, keyframe.id);
  for (const auto& [robots, pair] : work_.pairs) {
    if ((robots.first == robot || robots.second == robot) && worth_deciding(robots)) {
      decide(robots, keyframe);
    }
  }
}

void MergeServer::verify(const std::vector<OverlapFinder::Candidate>& candidates,
                         const NewKeyframe& keyframe) {
  std::vector<OverlapFinder::Candidate> chosen;
  std::map<Robots, int> counts;
  for (const OverlapFinder::Candidate& candidate : candidates) {
    const Robots robots = robots_of(candidate);
    reach(robots, MeetingStep::kSimilar, keyframe);
    if (counts[robots]++ < (work_.pairs[robots].met ? kPlacesWhenMet : kPlaces)) chosen.push_back(candidate);
  }
  std::vector<VerifiedPair> tried(chosen.size());
  executor_->parallel_for(
      chosen.size(), [&](std::size_t i) { tried[i] = verify_candidate(work_.parts, chosen[i], options_); });
  for (std::size_t i = 0; i < tried.size(); ++i) {
    if (!tried[i].evidence.accepted) continue;
    work_.pairs[robots_of(chosen[i])].verified.push_back(tried[i]);
    reach(robots_of(chosen[i]), MeetingStep::kVerified, keyframe);
  }
}

void MergeServer::reach(const Robots& robots, MeetingStep step, const NewKeyframe& keyframe) {
  RobotPair& pair = work_.pairs[robots];
  if (pair.step >= step) return;
  pair.step = step;
  work_.events.push_back({step, robots.first, robots.second, keyframe.frame, keyframe.id, {}, nullptr});
}

/// Pairs or maps have grown by a share since last time: so the cost of all decisions stays a multiple of the
/// last one's.
bool MergeServer::worth_deciding(const Robots& robots) const {
  const RobotPair& pair = work_.pairs.at(robots);
  if (pair.verified.empty()) return false;
  const std::size_t share = pair.met ? 2 : 8;
  const auto grown = [&](std::size_t now, std::size_t before) {
    return now >= before + std::max<std::size_t>(1, before / share);
  };
  return grown(pair.verified.size(), pair.decided_pairs) ||
         grown(work_.maps[robots.first]->keyframe_count() + work_.maps[robots.second]->keyframe_count(),
               pair.decided_keyframes);
}

void MergeServer::decide(const Robots& robots, const NewKeyframe& keyframe) {
  RobotPair& pair = work_.pairs[robots];
  reach(robots, MeetingStep::kLocalMapAsked, keyframe);
  const maps::Map& a = *work_.maps[robots.first];
  const maps::Map& b = *work_.maps[robots.second];
  MergeEvidence merge =
      decide_overlap(work_.parts, robots.first, robots.second, pair.verified, options_, *executor_);

  // The decision may have verified further pairs, which are kept as evidence for the next one.
  std::set<std::pair<KeyframeId, KeyframeId>> known;
  for (const VerifiedPair& old : pair.verified) known.emplace(old.query, old.match);

  for (const VerifiedPair& fresh : merge.pairs) {
    if (known.count({fresh.query, fresh.match}) + known.count({fresh.match, fresh.query}) == 0)
      pair.verified.push_back(fresh);
  }

  pair.decided_pairs = pair.verified.size();
  pair.decided_keyframes = a.keyframe_count() + b.keyframe_count();
  if (!merge.accepted) {
    if (pair.met) take_back(robots, merge, keyframe);
    return;
  }

  // The alignment is stored relative to two keyframes, so that it stays valid while both maps still change.
  const VerifiedPair& one = merge.pairs[merge.pairs.size() / 2];
  pair.a = a.has_keyframe(one.query) ? one.query : one.match;
  pair.b = pair.a == one.query ? one.match : one.query;
  pair.a_from_b =
      a.camera_from_world(pair.a) * merge.alignment.a_from_b * b.camera_from_world(pair.b).inverse();
  pair.evidence = std::move(merge);
  if (!std::exchange(pair.met, true)) meet(robots, keyframe);
}

/// Joins all maps connected with the two by a pose graph, which may find that other merges were wrong, or
/// this one.
void MergeServer::meet(const Robots& robots, const NewKeyframe& keyframe) {
  std::vector<MergeEvidence> all = merges();
  const std::size_t anchor = connected_parts(work_.parts.size(), all)[robots.first];
  auto preview = std::make_shared<FusedMap>(fuse_maps(work_.parts, all, anchor, options_));
  bool stands = true;
  for (const MergeEvidence& merge : all) {
    if (merge.accepted) continue;
    const Robots wrong{merge.a, merge.b};
    if (wrong == robots) stands = false;
    take_back(wrong, merge, keyframe);
  }
  if (!stands) return;
  work_.pairs[robots].step = MeetingStep::kMet;
  work_.events.push_back({MeetingStep::kMet, robots.first, robots.second, keyframe.frame, keyframe.id,
                          work_.pairs[robots].evidence, std::move(preview)});
}

void MergeServer::take_back(const Robots& robots, const MergeEvidence& evidence,
                            const NewKeyframe& keyframe) {
  RobotPair& pair = work_.pairs[robots];
  pair.met = false;
  if (pair.step != MeetingStep::kMet) return;  // it was not reported to any robot
  pair.step = MeetingStep::kLocalMapAsked;
  work_.events.push_back(
      {MeetingStep::kTakenBack, robots.first, robots.second, keyframe.frame, keyframe.id, evidence, nullptr});
}

/// Merges of the maps in their present state.
std::vector<MergeEvidence> MergeServer::merges() const {
  std::vector<MergeEvidence> merges;
  for (const auto& [robots, pair] : work_.pairs) {
    if (!pair.met) continue;
    merges.push_back(pair.evidence);
    merges.back().alignment.a_from_b = work_.maps[robots.first]->camera_from_world(pair.a).inverse() *
                                       pair.a_from_b * work_.maps[robots.second]->camera_from_world(pair.b);
  }
  std::stable_sort(merges.begin(), merges.end(), [](const MergeEvidence& x, const MergeEvidence& y) {
    return x.pairs.size() > y.pairs.size();
  });
  return merges;
}

/// Along the merges with most pairs first, as fuse_maps() begins.
void MergeServer::update_places() {
  const std::vector<MergeEvidence> all = merges();
  const std::vector<std::size_t> group = connected_parts(work_.parts.size(), all);
  std::vector<std::optional<RobotPlace>> places(group.size());
  for (const std::size_t anchor : group) places[anchor] = RobotPlace{anchor, {}, {}, Matrix6d::Zero()};

  std::vector<bool> met(group.size(), false);
  for (bool grown = true; grown;) {
    grown = false;
    for (const MergeEvidence& merge : all) {
      met[merge.a] = met[merge.b] = true;
      if (places[merge.a].has_value() == places[merge.b].has_value()) continue;

      const std::size_t next = places[merge.a] ? merge.b : merge.a;
      const RobotPlace& from = *places[places[merge.a] ? merge.a : merge.b];
      const Rigid3 from_next =
          next == merge.b ? merge.alignment.a_from_b : merge.alignment.a_from_b.inverse();
      RobotPlace place{from.anchor, from.anchor_from_robot * from_next, {}, {}};
      const Rigid3 anchor_from_a = next == merge.b ? from.anchor_from_robot : place.anchor_from_robot;

      // Kept about the anchor's origin until all are there.
      place.covariance = from.covariance + carried(turned(merge.alignment.covariance, anchor_from_a.rotation),
                                                   -(anchor_from_a * middle(merge, *work_.maps[merge.b])));
      places[next] = place;
      grown = true;
      break;
    }
  }

  for (std::size_t r = 0; r < places.size(); ++r) {
    if (!met[r]) {
      places[r].reset();
      continue;
    }
    const maps::Map& map = *work_.maps[r];
    const Rigid3 robot_from_camera = map.camera_from_world(map.keyframe_ids().back()).inverse();
    places[r]->anchor_from_camera = places[r]->anchor_from_robot * robot_from_camera;
    places[r]->covariance = carried(places[r]->covariance, places[r]->anchor_from_camera.translation);
  }

  work_.places = std::move(places);
}

}  // namespace plumbline::mapping
