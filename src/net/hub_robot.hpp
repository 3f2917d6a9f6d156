// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What the hub knows of one robot, and its copy of the robot's store.
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "bus.hpp"
#include "plumbline/core/hash.hpp"
#include "plumbline/maps/store_replica.hpp"
#include "plumbline/net/hub.hpp"

namespace plumbline::net {

/// Signs of life.
class Presence {
 public:
  void note();
  [[nodiscard]] bool silent() const;  ///< for some seconds
  [[nodiscard]] double silent_s() const;
  [[nodiscard]] double longest_break_s() const { return longest_break_s_; }
  /// Whether that is another answer than was told last; at first it was silent.
  bool tell(bool silent) { return std::exchange(told_silent_, silent) != silent; }

 private:
  std::optional<Clock::time_point> heard_at_;
  double longest_break_s_ = 0.0;
  bool told_silent_ = true;
};

class HubRobot {
 public:
  /// `known`: its name, and what is known of it from before. `file`: of the copy. Errors (kOutput): it cannot
  /// be made.
  static core::Result<HubRobot> open(Hello known, const std::filesystem::path& file,
                                     std::uint64_t quota_bytes);

  Hello hello;        ///< the last one: name, run and incarnation are this robot's
  bool done = false;  ///< everything is here, and nothing will come
  struct Verdict {
    Answer answer = Answer::kAccepted;
    std::string problem;
    Clock::time_point until;  ///< of kTrouble: then its pieces are looked at again
  } verdict;
  bool changed = true;  ///< there is something to say
  Presence presence;

  [[nodiscard]] const maps::StoreReplica& copy() const { return *copy_; }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }  ///< of the copy
  /// A hello of this run and incarnation, or of a later one of it, which takes over. True: what the robot
  /// lost in between was here, so everything is asked for again.
  core::Result<bool> hear(const Hello& next);
  /// A part of what it lacks. An error is of the robot's rows (kInput) or of this machine (kOutput).
  core::Result<void> take(const Piece& piece);
  /// Whether all is here that it has.
  [[nodiscard]] bool has_all() const;
  [[nodiscard]] Word word() const;
  [[nodiscard]] RobotTraffic traffic() const;

 private:
  /// The transaction that is under way to here.
  struct Coming {
    std::int64_t number = 0;
    std::uint64_t edition = 0;
    std::uint32_t pieces = 0;
    core::Hash all;
  };
  HubRobot() = default;
  core::Result<void> begin(const Piece& piece);
  void forget();
  [[nodiscard]] std::int64_t lost_below(const Hello& next) const;

  std::filesystem::path file_;
  std::uint64_t quota_bytes_ = 0;
  std::optional<maps::StoreReplica> copy_;
  Coming coming_;
  RobotTraffic counted_;  ///< bytes that came, and came again
};

}  // namespace plumbline::net
