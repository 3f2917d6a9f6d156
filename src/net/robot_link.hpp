// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a robot's hub lacks is read from its store and sent, beside the run: nothing here is waited for by
// anybody, and nothing of it enters the map.
#include <atomic>
#include <chrono>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bus.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/maps/store_replica.hpp"

namespace plumbline::net {

using Clock = std::chrono::steady_clock;

struct LinkStatus {
  bool heard = false;       ///< a hub, ever
  bool hub_now = false;     ///< it was heard in the last seconds
  bool done = false;        ///< it has everything, and said so
  std::string refused;      ///< why it never will; empty: it was not refused
  std::string problem;      ///< why it cannot now
  std::string place;        ///< in the frame of which robot it is, for people; empty: it met nobody
  std::int64_t behind = 0;  ///< transactions that are not acknowledged
  std::uint64_t sent_bytes = 0;
  std::uint64_t again_bytes = 0;  ///< of these, sent before
  Clock::time_point progress;     ///< when something was acknowledged last, or the link began
};

class RobotLink {
 public:
  /// `fresh`: an id for the run should it have none yet.
  RobotLink(std::unique_ptr<RobotBus> bus, std::string name, std::string fresh, core::Log& log);
  RobotLink(const RobotLink&) = delete;
  RobotLink& operator=(const RobotLink&) = delete;
  ~RobotLink();

  /// From now on sends what is or comes to be in `store`; who is who lies in network.db beside it. Errors
  /// (kOutput): that cannot be written.
  core::Result<void> follow(const std::filesystem::path& store);
  /// The store's folder has another name now, and nothing will be added.
  void over(const std::filesystem::path& store);
  [[nodiscard]] LinkStatus status() const;

 private:
  /// A transaction under way.
  struct Sending {
    maps::StoreShare share = maps::StoreShare::kMap;
    std::int64_t after = 0;
    maps::StoreTransaction transaction;
    std::uint64_t edition = 0;
    std::uint32_t count = 0;
    std::uint32_t index = 0;                   ///< the next piece
    std::uint32_t most = 0;                    ///< pieces that were sent at least once
    std::optional<Clock::time_point> settled;  ///< since when DDS owes nobody a piece
  };

  void run();
  void take(const Word& word);
  void take_answer(const Word& word);
  void look_at_store();
  void choose();
  void send();
  void send_again();
  [[nodiscard]] Piece piece(std::uint32_t index) const;
  void say();
  void report_silence();
  void note_lags();
  void note_place(const Place& place);

  std::unique_ptr<RobotBus> bus_;
  const std::string name_;
  const std::string fresh_;
  core::Log& log_;
  mutable std::mutex published_mutex_;  ///< held for a moment only
  LinkStatus published_;
  std::mutex mutex_;  ///< of what follow() and over() share with the thread
  std::filesystem::path store_;
  Hello hello_;
  bool following_ = false;
  LinkStatus status_;
  // The thread's own:
  std::string hub_;
  Clock::time_point began_ = Clock::now();
  Clock::time_point heard_at_;  ///< that hub
  Clock::time_point said_at_;
  bool hello_changed_ = true;
  Word word_;  ///< the last answer to this incarnation
  bool listened_ = false;
  std::optional<Sending> sending_;
  std::filesystem::file_time_type store_time_;
  std::uintmax_t store_size_ = 0;
  std::deque<std::pair<maps::StoreHeads, Clock::time_point>> noticed_;  ///< not acknowledged yet
  std::vector<double> lags_s_;
  bool silence_reported_ = false;
  bool foreign_reported_ = false;
  std::string problem_reported_;
  std::string frame_of_;  ///< that was told last
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace plumbline::net
