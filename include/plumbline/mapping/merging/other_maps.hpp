// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Maps of other robots, for a robot's own relocalisation and loops (docs/method/network.md). They are looked
// at only: nothing of them enters the robot's own map.
#include <atomic>
#include <memory>
#include <utility>

#include "plumbline/mapping/adjustment/global_adjustment.hpp"
#include "plumbline/maps/map.hpp"

namespace plumbline::mapping {

struct OtherMaps {
  maps::Map map;    ///< carried into the world of the robot that looks; robots are none of its own map's
  Cameras cameras;  ///< by robot
};

/// Receives the other robots' maps from another thread. Neither side waits; thread-safe.
class OtherMapsInbox {
 public:
  void put(std::shared_ptr<const OtherMaps> maps) { std::atomic_store(&newest_, std::move(maps)); }
  /// The newest; null: none came yet.
  [[nodiscard]] std::shared_ptr<const OtherMaps> get() const { return std::atomic_load(&newest_); }

 private:
  std::shared_ptr<const OtherMaps> newest_;
};

}  // namespace plumbline::mapping
