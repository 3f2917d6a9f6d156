// SPDX-License-Identifier: BSD-3-Clause
#include "robot/other_robots.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "plumbline/maps/map_join.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;
using geometry::Rigid3;

constexpr auto kPublishMapsEvery = 2s;
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

/// A robot's place in the common frame.
void OtherRobots::apply(const HubStatus& hub) {
  if (hub.robot.empty() || (frames_.count(hub.robot) == 0 && frames_.size() >= kMostNames)) return;
  SharedFrame& frame = frames_[hub.robot];
  if (frame.frame_of == hub.frame.frame_of && frame.frame_from_robot == hub.frame.frame_from_robot) return;
  frame = hub.frame;
  if (!is_pose(frame.frame_from_robot)) frame.frame_of.clear();
  changed_ = true;
}

void OtherRobots::receive(const Chunk& chunk) {
  // The first chunk of the first transaction starts a map.
  if (chunk.index == 0 && chunk.after == 0 && others_.size() < kMostNames) {
    Other& added = others_[chunk.name] = {};
    added.number = ++numbers_;
  }

  // Chunks of unknown maps are dropped
  const auto found = others_.find(chunk.name);
  if (found == others_.end()) return;

  // The first chunk begins a transaction
  Other& other = found->second;
  if (chunk.index == 0) {
    other.incoming = {chunk.number, {}};
    other.checksum = chunk.checksum;
    other.chunks = 0;
  }

  // Chunks out of order are dropped
  std::vector<std::uint8_t>& rows = other.incoming.rows;
  if (chunk.checksum != other.checksum || chunk.index != other.chunks || rows.size() > kMostRows) return;
  rows.insert(rows.end(), chunk.bytes.begin(), chunk.bytes.end());
  if (++other.chunks == chunk.count && other.follower.apply(other.incoming)) changed_ = other.changed = true;
}

/// Leaves the previous map in place while rows that belong together are incomplete.
void OtherRobots::update(Other& other) {
  if (!other.changed) return;
  auto stored = other.follower.map(other.number);
  if (!stored) return;
  other.changed = false;
  if (stored->map.keyframe_count() == 0) return;
  auto map = std::make_shared<mapping::OtherMaps>();
  map->map = std::move(stored->map);
  map->cameras = {{other.number, maps::camera_of(stored->header.robots, 0).color}};
  other.map = std::move(map);
}

void OtherRobots::publish() {
  // Maps that nobody uses any more are freed here
  const auto first_transactions = Clock::now();
  if (!changed_ || first_transactions < next_) return;
  changed_ = false;
  published_.erase(std::remove_if(published_.begin(), published_.end(),
                                  [](const auto& maps) { return maps.use_count() == 1; }),
                   published_.end());

  // All maps that share the frame
  const SharedFrame own = frames_[name_];
  auto all = std::make_shared<mapping::OtherMaps>();
  std::vector<const maps::Map*> maps;
  std::vector<Rigid3> own_from_other;

  // Maps are moved to this robot's frame
  for (auto& [name, other] : others_) {
    const SharedFrame frame = frames_[name];
    if (own.frame_of.empty() || frame.frame_of != own.frame_of) continue;
    update(other);
    if (other.map == nullptr) continue;
    maps.push_back(&other.map->map);
    all->cameras.insert(other.map->cameras.begin(), other.map->cameras.end());
    own_from_other.push_back(pose_of(own.frame_from_robot).inverse() * pose_of(frame.frame_from_robot));
  }

  // Larger maps are published less often
  all->map = maps::joined(maps, own_from_other);
  inbox_->put(published_.emplace_back(std::move(all)));
  const auto now = Clock::now();
  next_ = now + std::max<Clock::duration>(kPublishMapsEvery, 9 * (now - first_transactions));
}

}  // namespace plumbline::net
