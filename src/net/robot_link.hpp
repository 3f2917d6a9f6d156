// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a robot's hub lacks is read from its store and sent, beside the run: nothing here is waited for by
// anybody, and nothing of it enters the map.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "bus.hpp"
#include "other_robots.hpp"
#include "outbox.hpp"
#include "plumbline/core/log.hpp"
#include "side_thread.hpp"

namespace plumbline::net {

struct LinkStatus {
  bool heard = false;       ///< a hub, ever
  bool hub_now = false;     ///< it was heard in the last seconds
  bool done = false;        ///< it has everything, and said so
  std::string refused;      ///< why it never will; empty: it was not refused
  std::string problem;      ///< why it cannot now
  std::string place;        ///< in the frame of which robot it is, for people; empty: it met nobody
  std::int64_t behind = 0;  ///< transactions that are not acknowledged
  std::uint64_t sent_bytes = 0;
  std::uint64_t again_bytes = 0;              ///< of these, sent before
  Clock::time_point progress = Clock::now();  ///< when something was acknowledged last, or the link began
};

/// What a robot hears of its hub.
class HeardHub {
 public:
  explicit HeardHub(core::Log& log) : log_(log) {}

  /// True: it is another hub than before, which knows nothing of what was sent.
  bool take(const Word& word, const Hello& hello);
  /// At the latest now somebody should know that nobody answers. `others`: participants that are there.
  void report_silence(RobotBus& bus);
  /// The robot is another incarnation now.
  void forget() { word_ = {}; }
  [[nodiscard]] const Word& word() const { return word_; }  ///< the last answer to this incarnation
  [[nodiscard]] Clock::time_point heard_at() const { return heard_at_; }
  /// It listens and goes on.
  [[nodiscard]] bool accepts() const;
  /// Without what was sent.
  [[nodiscard]] LinkStatus status() const;

 private:
  void take_answer(const Word& word, bool over);
  void note_place(const Place& place, const std::string& name);

  core::Log& log_;
  Clock::time_point began_ = Clock::now();
  std::string hub_;
  Clock::time_point heard_at_;  ///< that hub
  Word word_;
  LinkStatus status_;
  bool silence_reported_ = false;
  bool foreign_reported_ = false;
};

class RobotLink {
 public:
  /// `fresh`: an id for the run should it have none yet. `feedback`: where maps of other robots go; null:
  /// they are not asked for.
  RobotLink(std::unique_ptr<RobotBus> bus, std::string name, std::string fresh,
            std::shared_ptr<mapping::OtherMapsInbox> feedback, core::Log& log);

  /// From now on sends what is or comes to be in `store`; who is who lies in network.db beside it. Errors
  /// (kOutput): that cannot be written.
  core::Result<void> follow(const std::filesystem::path& store);
  /// The store's folder has another name now, and nothing will be added.
  void over(const std::filesystem::path& store);
  [[nodiscard]] LinkStatus status() const { return *std::atomic_load(&status_); }

 private:
  void run(const core::StopToken& stop);
  void talk(const std::vector<Word>& words);
  void hear_of_others(const std::vector<Word>& words);
  void look();
  void say();
  void publish();
  [[nodiscard]] bool following() const { return hello_.incarnation > 0; }

  std::unique_ptr<RobotBus> bus_;
  std::shared_ptr<const LinkStatus> status_ = std::make_shared<LinkStatus>();  ///< exchanged as a whole
  std::mutex mutex_;  ///< of the rest, which follow() and over() share with the thread
  Hello hello_;
  StoreWatch store_;
  Outbox outbox_;
  HeardHub hub_;
  Clock::time_point said_at_;
  std::optional<OtherRobots> others_;  ///< the thread's own
  SideThread thread_;
};

}  // namespace plumbline::net
