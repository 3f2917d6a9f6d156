// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The hub while it collects: who may come in, what they bring, what they are told. One thread does it all.
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "bus.hpp"
#include "hub_meetings.hpp"
#include "hub_robot.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/net/hub.hpp"

namespace plumbline::net {

class HubDesk {
 public:
  /// `folder`: where robots/ and network.db are or will be; what is there is gone on with. Errors (kInput,
  /// kOutput): it cannot be read or written.
  static core::Result<std::unique_ptr<HubDesk>> open(const std::filesystem::path& folder,
                                                     const HubRequest& request, std::unique_ptr<HubBus> bus,
                                                     const core::Executor& executor, core::Log& log);

  /// Errors (kUsage): another hub is there.
  core::Result<void> look_for_others(const core::StopToken& stop);
  /// Until all robots that are waited for are done, or `stop` is asked for. Closes the copies; what came, by
  /// name.
  std::vector<RobotTraffic> serve(const core::StopToken& stop, const Status& status);
  [[nodiscard]] const HubMeetings& meetings() const { return meetings_; }
  /// After that, until `stop`: robots that everything came of are told so, as often as they may need it.
  void say_goodbye(const core::StopToken& stop);

 private:
  HubDesk(std::filesystem::path folder, const HubRequest& request, std::unique_ptr<HubBus> bus,
          const core::Executor& executor, core::Log& log)
      : folder_(std::move(folder)),
        request_(request),
        ledger_(folder_ / "network.db"),
        bus_(std::move(bus)),
        log_(log),
        meetings_(folder_, executor, log) {}
  core::Result<void> read_ledger();
  void hear(const HeardHello& heard);
  /// Why a robot may not come in; empty: it may.
  std::string refusal(const HeardHello& heard) const;
  void let_in(const Hello& hello);
  core::Result<HubRobot*> add(const Hello& hello);
  core::Result<void> remember(const HubRobot& robot) const;
  void take_pieces(HubRobot& robot);
  void close(HubRobot& robot);
  void say_all();
  void say(Word word);
  void report_once(const std::string& message);
  [[nodiscard]] std::string line(double kbytes_per_s) const;
  [[nodiscard]] std::uint64_t received() const;
  [[nodiscard]] std::size_t done() const;

  std::filesystem::path folder_;
  const HubRequest& request_;
  maps::Ledger ledger_;
  std::unique_ptr<HubBus> bus_;
  core::Log& log_;
  std::string id_;
  Clock::time_point began_ = Clock::now();
  bool serving_ = false;
  Clock::time_point said_at_;
  std::map<std::string, HubRobot> robots_;
  std::vector<Word> last_words_;
  std::map<std::string, Clock::time_point> trouble_;  ///< until when a robot's pieces are not looked at
  std::set<std::string> reported_;
  HubMeetings meetings_;
};

}  // namespace plumbline::net
