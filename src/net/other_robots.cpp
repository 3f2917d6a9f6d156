// SPDX-License-Identifier: BSD-3-Clause
#include "other_robots.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "plumbline/maps/map_join.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;
using geometry::Rigid3;

constexpr auto kPublishEvery = 2s;
constexpr std::size_t kMostNames = 64;
constexpr std::size_t kMostRows = 64U << 20U;  // bytes: more than a transaction has without clouds

Rigid3 pose_of(const std::array<double, 7>& from) {
  const Eigen::Quaterniond q(from[6], from[3], from[4], from[5]);
  return {q.normalized().toRotationMatrix(), Eigen::Vector3d(from[0], from[1], from[2])};
}

bool is_pose(const std::array<double, 7>& from) {
  const Rigid3 pose = pose_of(from);
  return pose.rotation.allFinite() && pose.translation.allFinite();
}

}  // namespace

void OtherRobots::take(const Word& word) {
  if (word.robot.empty() || (places_.count(word.robot) == 0 && places_.size() >= kMostNames)) return;
  Place& place = places_[word.robot];
  if (place.frame_of == word.place.frame_of && place.frame_from_robot == word.place.frame_from_robot) return;
  place = word.place;
  if (!is_pose(place.frame_from_robot)) place.frame_of.clear();
  changed_ = true;
}

void OtherRobots::take(const Piece& piece) {
  if (piece.index == 0 && piece.after == 0 && others_.size() < kMostNames) {
    Other& anew = others_[piece.name] = {};
    anew.number = ++numbers_;
  }
  const auto found = others_.find(piece.name);
  if (found == others_.end()) return;
  Other& other = found->second;
  if (piece.index == 0) {
    other.coming = {piece.number, {}};
    other.edition = piece.edition;
    other.pieces = 0;
  }
  std::vector<std::uint8_t>& rows = other.coming.rows;
  if (piece.edition != other.edition || piece.index != other.pieces || rows.size() > kMostRows) return;
  rows.insert(rows.end(), piece.bytes.begin(), piece.bytes.end());
  if (++other.pieces == piece.count && other.follower.take(other.coming)) changed_ = other.changed = true;
}

/// Rows that belong together may have come in part: then the map before stays.
void OtherRobots::update(Other& other) {
  if (!other.changed) return;
  const auto stored = other.follower.map();
  if (!stored) return;
  other.changed = false;
  const std::vector<core::KeyframeId> ids = stored->map.keyframe_ids();
  if (ids.empty() || std::any_of(ids.begin(), ids.end(), [](auto id) { return id.robot != 0; })) return;
  auto map = std::make_shared<mapping::OtherMaps>();
  map->map = maps::renumbered(stored->map, {{0, other.number}});
  map->cameras = {{other.number, maps::camera_of(stored->header.robots, 0).color}};
  other.map = std::move(map);
}

void OtherRobots::publish() {
  const auto began = Clock::now();
  if (!changed_ || began < next_) return;
  changed_ = false;
  published_.erase(std::remove_if(published_.begin(), published_.end(),
                                  [](const auto& maps) { return maps.use_count() == 1; }),
                   published_.end());
  const Place own = places_[name_];
  auto all = std::make_shared<mapping::OtherMaps>();
  std::vector<const maps::Map*> maps;
  std::vector<Rigid3> own_from_other;
  for (auto& [name, other] : others_) {
    const Place place = places_[name];
    if (own.frame_of.empty() || place.frame_of != own.frame_of) continue;
    update(other);
    if (other.map == nullptr) continue;
    maps.push_back(&other.map->map);
    all->cameras.insert(other.map->cameras.begin(), other.map->cameras.end());
    own_from_other.push_back(pose_of(own.frame_from_robot).inverse() * pose_of(place.frame_from_robot));
  }
  all->map = maps::joined(maps, own_from_other);
  inbox_->put(published_.emplace_back(std::move(all)));
  const auto now = Clock::now();
  next_ = now + std::max<Clock::duration>(kPublishEvery, 9 * (now - began));
}

}  // namespace plumbline::net
