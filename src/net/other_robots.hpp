// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Maps of other robots as a robot hears of them: rows from the hub become maps, and those that lie in one
// frame with its own are carried into its world.
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bus.hpp"
#include "outbox.hpp"
#include "plumbline/mapping/other_maps.hpp"
#include "plumbline/maps/store_replica.hpp"

namespace plumbline::net {

class OtherRobots {
 public:
  /// `name`: of this robot.
  OtherRobots(std::string name, std::shared_ptr<mapping::OtherMapsInbox> inbox)
      : name_(std::move(name)), inbox_(std::move(inbox)) {}

  /// The hub's words to all robots tell how their worlds lie to each other.
  void take(const Word& word);
  void take(const Piece& piece);
  /// Puts the maps into the inbox when they have changed, every few seconds at most, and so seldom that it
  /// takes a tenth of the time.
  void publish();

 private:
  struct Other {
    std::int32_t number = 0;  ///< in the ids of its map
    maps::MapFollower follower;
    maps::StoreTransaction coming;
    std::uint64_t edition = 0;                      ///< of that
    std::uint32_t pieces = 0;                       ///< that came of it
    bool changed = false;                           ///< since `map` was made
    std::shared_ptr<const mapping::OtherMaps> map;  ///< in its own world, the last one that was whole
  };
  static void update(Other& other);

  std::string name_;
  std::shared_ptr<mapping::OtherMapsInbox> inbox_;
  std::map<std::string, Place> places_;
  std::map<std::string, Other> others_;
  std::int32_t numbers_ = 0;  ///< given so far: a map that was begun anew is another one
  bool changed_ = false;
  Clock::time_point next_;  ///< time to publish
  /// Maybe in use: taking maps apart takes a while, which is not the tracker's.
  std::vector<std::shared_ptr<const mapping::OtherMaps>> published_;
};

}  // namespace plumbline::net
