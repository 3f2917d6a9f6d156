// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One robot at the hub: its last status, the answer to it, and the copy of its store.
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "bus.hpp"
#include "plumbline/core/hash.hpp"
#include "plumbline/maps/store_replica.hpp"
#include "plumbline/net/hub.hpp"

namespace plumbline::net {

/// Time of the last message from a robot.
class Presence {
 public:
  void note();
  [[nodiscard]] bool silent() const;  ///< true if no message has come for a few seconds
  [[nodiscard]] double silent_s() const;
  [[nodiscard]] double longest_break_s() const { return longest_break_s_; }
  /// True if this differs from what was last reported; the initial state is silent.
  bool report(bool silent) { return std::exchange(reported_silent_, silent) != silent; }

 private:
  std::optional<Clock::time_point> received_at_;
  double longest_break_s_ = 0.0;
  bool reported_silent_ = true;
};

class RobotSession {
 public:
  /// `known`: its name, and its state in an earlier process. `file`: file of the copy. Errors (kOutput): the
  /// copy cannot be made.
  static core::Result<RobotSession> open(RobotStatus known, const std::filesystem::path& file,
                                         std::uint64_t quota_bytes);

  RobotStatus robot;  ///< last status: name, run and incarnation are this robot's
  bool done = false;  ///< the copy is complete, and nothing will follow
  struct Reply {
    Answer answer = Answer::kAccepted;
    std::string problem;
    Clock::time_point until;  ///< time at which chunks are read again after kTrouble
  } reply;
  bool changed = true;  ///< a status must be published
  Presence presence;

  [[nodiscard]] const maps::StoreReplica& copy() const { return *copy_; }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }  ///< file of the copy
  /// Applies a status of this run and incarnation, or of a later one, which takes over. True: the copy held
  /// transactions that the robot has lost, so it was emptied and everything is requested again.
  core::Result<bool> apply(const RobotStatus& next);
  /// Appends a chunk to the copy. Errors: (kInput) the robot's rows, (kOutput) this machine.
  core::Result<void> receive(const Chunk& chunk);
  /// True if the robot has finished and the copy holds everything it has.
  [[nodiscard]] bool has_all() const;
  [[nodiscard]] HubStatus status() const;
  [[nodiscard]] RobotTraffic traffic() const;

 private:
  /// The transaction being received.
  struct Incoming {
    std::int64_t number = 0;
    std::uint64_t checksum = 0;
    std::uint32_t chunks = 0;
    core::Hash hash;  ///< hash of all bytes so far
  };
  RobotSession() = default;
  core::Result<void> begin(const Chunk& chunk);
  core::Result<void> append(const Chunk& chunk, bool last);
  void end_transaction();
  [[nodiscard]] std::int64_t certain_head(const RobotStatus& next) const;

  std::filesystem::path file_;
  std::uint64_t quota_bytes_ = 0;
  std::optional<maps::StoreReplica> copy_;
  Incoming incoming_;
  RobotTraffic traffic_;  ///< counts of received bytes only
};

}  // namespace plumbline::net
