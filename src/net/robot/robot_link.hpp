// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Sends the data of a robot's store that the hub lacks, beside the run: the run never waits for it, and it
// never changes the map.
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "bus.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/side_thread.hpp"
#include "robot/chunk_sender.hpp"
#include "robot/hub_session.hpp"
#include "robot/other_robots.hpp"
#include "robot/store_watch.hpp"

namespace plumbline::net {

class RobotLink {
 public:
  /// `fresh`: an id for the run if it has none yet. `feedback`: receives maps of other robots; null: they are
  /// not requested.
  RobotLink(std::unique_ptr<RobotBus> bus, std::string name, std::string fresh,
            std::shared_ptr<mapping::OtherMapsInbox> feedback, core::Log& log);

  /// From now on sends everything in `store`, present and future; identities are kept in network.db beside
  /// it. Errors (kOutput): that file cannot be written.
  core::Result<void> follow(const std::filesystem::path& store);
  /// The run has ended: the store is in its final folder, and nothing will be added.
  void finish(const std::filesystem::path& store);
  [[nodiscard]] LinkStatus status() const { return *std::atomic_load(&status_); }

 private:
  void run(const core::StopToken& stop);
  void exchange(const std::vector<HubStatus>& statuses);
  void receive_feedback(const std::vector<HubStatus>& statuses);
  void poll_store();
  void publish_robot();
  void publish_link();
  [[nodiscard]] bool following() const { return robot_.incarnation > 0; }

  std::unique_ptr<RobotBus> bus_;
  std::shared_ptr<const LinkStatus> status_ = std::make_shared<LinkStatus>();  ///< exchanged as a whole
  std::mutex mutex_;  ///< guards the members below, which follow() and finish() share with the thread
  RobotStatus robot_;
  StoreWatch store_;
  ChunkSender sender_;
  HubSession hub_;
  Clock::time_point published_at_;
  std::optional<OtherRobots> others_;  ///< used by the thread only
  core::SideThread thread_;
};

}  // namespace plumbline::net
