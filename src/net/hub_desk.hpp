// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The hub while it collects: who may come in, what they bring, what they are told. One thread does it all.
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "bus.hpp"
#include "hub_feedback.hpp"
#include "hub_meetings.hpp"
#include "hub_robot.hpp"
#include "hub_speaker.hpp"
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
  /// Until all robots that are waited for are done, or `stop` is asked for.
  void serve(const core::StopToken& stop, const Status& status);
  struct Collected {
    std::vector<RobotTraffic> traffic;  ///< by name
    std::vector<Word> last_words;       ///< for robots that everything came of
  };
  /// After that: closes the copies.
  Collected close();
  [[nodiscard]] const HubMeetings& meetings() const { return meetings_; }
  [[nodiscard]] const HubSpeaker& speaker() const { return speaker_; }

 private:
  HubDesk(std::filesystem::path folder, const HubRequest& request, std::unique_ptr<HubBus> bus,
          const core::Executor& executor, core::Log& log)
      : folder_(std::move(folder)),
        request_(request),
        bus_(std::move(bus)),
        log_(log),
        speaker_(*bus_),
        meetings_(folder_, executor, log) {}
  [[nodiscard]] maps::Ledger ledger() const { return maps::Ledger(folder_ / "network.db"); }
  core::Result<void> read_ledger();
  void listen();
  void hear(const HeardHello& heard);
  /// Why a robot may not come in; empty: it may.
  std::string refusal(const HeardHello& heard) const;
  void let_in(const Hello& hello);
  core::Result<HubRobot*> add(const Hello& known);
  core::Result<void> remember(const HubRobot& robot) const;
  void take_pieces(HubRobot& robot);
  void finish(HubRobot& robot);
  [[nodiscard]] Word word_for(const HubRobot& robot) const;
  void say_all();
  void report_once(const std::string& message);
  [[nodiscard]] std::string line(double kbytes_per_s) const;
  [[nodiscard]] std::uint64_t received() const;
  [[nodiscard]] std::size_t done() const;

  std::filesystem::path folder_;
  const HubRequest& request_;
  std::unique_ptr<HubBus> bus_;
  core::Log& log_;
  HubSpeaker speaker_;
  std::map<std::string, HubRobot> robots_;
  std::set<std::string> reported_;
  HubMeetings meetings_;
  HubFeedback feedback_;
};

}  // namespace plumbline::net
