// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Sends the hub the transactions of a robot's store that it lacks, chunk by chunk.
#include <cstdint>
#include <optional>

#include "bus.hpp"
#include "chunked_transaction.hpp"
#include "robot/store_watch.hpp"

namespace plumbline::net {

class ChunkSender {
 public:
  explicit ChunkSender(RobotBus& bus) : bus_(&bus) {}
  /// Sends a few chunks of what the hub lacks according to its status, which was received at `received_at`.
  void send(const RobotStatus& robot, const StoreWatch& own, const HubStatus& hub,
            Clock::time_point received_at);
  /// Drops the transaction being sent; the next send() selects one again.
  void reset() { sending_.reset(); }
  [[nodiscard]] std::uint64_t sent_bytes() const { return sent_bytes_; }
  [[nodiscard]] std::uint64_t resent_bytes() const { return resent_bytes_; }  ///< included in sent_bytes()

 private:
  struct Sending {
    ChunkedTransaction transaction;
    std::uint32_t index = 0;                   ///< next chunk
    std::uint32_t most = 0;                    ///< number of chunks that were sent at least once
    std::optional<Clock::time_point> settled;  ///< since when every subscriber has received every chunk
  };
  void select(const StoreWatch& own, const HubStatus& hub);
  void resend_lost(const HubStatus& hub, Clock::time_point received_at);

  RobotBus* bus_;
  bool had_reader_ = false;
  std::optional<Sending> sending_;
  std::uint64_t sent_bytes_ = 0;
  std::uint64_t resent_bytes_ = 0;
};

}  // namespace plumbline::net
