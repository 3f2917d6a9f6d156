// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What the hub knows of one robot, and its copy of the robot's store.
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "bus.hpp"
#include "plumbline/core/hash.hpp"
#include "plumbline/maps/store_replica.hpp"
#include "plumbline/net/hub.hpp"

namespace plumbline::net {

using Clock = std::chrono::steady_clock;

class HubRobot {
 public:
  /// `file`: of the copy. Errors (kOutput): it cannot be made.
  static core::Result<HubRobot> open(std::string name, const std::filesystem::path& file,
                                     std::uint64_t quota_bytes);

  std::string name;
  std::string run;
  std::uint64_t incarnation = 0;
  bool done = false;  ///< everything is here, and nothing will come
  Hello hello;        ///< the last one
  Answer answer = Answer::kAccepted;
  std::string problem;
  bool changed = true;  ///< there is something to say

  [[nodiscard]] const maps::StoreReplica& copy() const { return *copy_; }
  /// A hello of this run and incarnation, or of a later one of it, which takes over. True: what the robot
  /// lost in between was here, so everything is asked for again.
  core::Result<bool> hear(const Hello& next);
  /// A part of what it lacks. An error is of the robot's rows (kInput) or of this machine (kOutput).
  core::Result<void> take(const Piece& piece);
  /// Whether all is here that it has.
  [[nodiscard]] bool has_all() const;
  [[nodiscard]] Word word() const;
  [[nodiscard]] RobotTraffic traffic() const;
  [[nodiscard]] bool silent() const;  ///< for some seconds
  bool silence_reported = true;       ///< as long as it was not heard

 private:
  HubRobot() = default;
  core::Result<void> begin(const Piece& piece);
  void forget();
  [[nodiscard]] std::int64_t lost_below(const Hello& next) const;

  std::filesystem::path file_;
  std::uint64_t quota_bytes_ = 0;
  std::optional<maps::StoreReplica> copy_;
  // The transaction that is coming:
  std::int64_t number_ = 0;
  std::uint64_t edition_ = 0;
  std::uint32_t pieces_ = 0;
  core::Hash all_;
  std::uint64_t again_ = 0;  ///< bytes that had come before
  std::uint64_t received_ = 0;
  std::optional<Clock::time_point> heard_at_;
  double longest_break_s_ = 0.0;
};

}  // namespace plumbline::net
