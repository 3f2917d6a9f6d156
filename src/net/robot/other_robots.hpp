// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Maps of other robots at a robot that subscribes to them: rows from the hub become maps, and those that
// share a frame with its own are transformed into its world.
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bus.hpp"
#include "plumbline/mapping/merging/other_maps.hpp"
#include "plumbline/maps/store_replica.hpp"

namespace plumbline::net {

class OtherRobots {
 public:
  /// `name`: of this robot.
  OtherRobots(std::string name, std::shared_ptr<mapping::OtherMapsInbox> inbox)
      : name_(std::move(name)), inbox_(std::move(inbox)) {}

  /// Reads from any status of the hub the pose of its addressee in the shared frame.
  void apply(const HubStatus& hub);
  void receive(const Chunk& chunk);
  /// Puts the maps into the inbox if they have changed, every few seconds at most, and so seldom that it
  /// takes no more than a tenth of the time.
  void publish();

 private:
  struct Other {
    std::int32_t number = 0;  ///< in the ids of its map
    maps::MapFollower follower;
    maps::StoreTransaction incoming;
    std::uint64_t checksum = 0;                     ///< of the incoming transaction
    std::uint32_t chunks = 0;                       ///< received of it
    bool changed = false;                           ///< since `map` was made
    std::shared_ptr<const mapping::OtherMaps> map;  ///< the last complete one, in the other robot's world
  };
  static void update(Other& other);

  std::string name_;
  std::shared_ptr<mapping::OtherMapsInbox> inbox_;
  std::map<std::string, SharedFrame> frames_;
  std::map<std::string, Other> others_;
  std::int32_t numbers_ = 0;  ///< given so far: a map that starts again gets a new one
  bool changed_ = false;
  Clock::time_point next_;  ///< earliest time to publish
  /// Kept while the tracker may use them, so that the tracker does not spend time on destroying them.
  std::vector<std::shared_ptr<const mapping::OtherMaps>> published_;
};

}  // namespace plumbline::net
