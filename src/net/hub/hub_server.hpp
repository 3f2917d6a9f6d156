// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The hub while it collects maps: admits robots, stores their rows, answers them. All in one thread.
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "bus.hpp"
#include "hub/hub_feedback.hpp"
#include "hub/hub_meetings.hpp"
#include "hub/hub_show.hpp"
#include "hub/robot_session.hpp"
#include "hub/status_publisher.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/net/hub.hpp"

namespace plumbline::net {

class HubServer {
 public:
  /// `folder`: holds robots/ and network.db, or will hold them; existing ones are continued. Errors (kInput,
  /// kOutput): it cannot be read or written.
  static core::Result<std::unique_ptr<HubServer>> open(const std::filesystem::path& folder,
                                                       const HubRequest& request, std::unique_ptr<HubBus> bus,
                                                       const core::Executor& executor, core::Log& log);

  /// Makes sure that no other hub serves this domain. Errors (kUsage): there is one.
  core::Result<void> look_for_others(const core::StopToken& stop);
  /// Serves until all expected robots are done, or `stop` is requested.
  void serve(const core::StopToken& stop, const Status& status);
  struct Collected {
    std::vector<RobotTraffic> traffic;      ///< by name
    std::vector<HubStatus> final_statuses;  ///< for robots that delivered everything
  };
  /// Closes the copies after serve().
  Collected close();
  [[nodiscard]] const HubMeetings& meetings() const { return meetings_; }
  [[nodiscard]] const StatusPublisher& publisher() const { return publisher_; }

 private:
  HubServer(std::filesystem::path folder, const HubRequest& request, std::unique_ptr<HubBus> bus,
            const core::Executor& executor, core::Log& log)
      : folder_(std::move(folder)),
        request_(request),
        bus_(std::move(bus)),
        log_(log),
        publisher_(*bus_),
        meetings_(folder_, executor, log),
        show_(request.fuse.observer, executor, log) {}
  [[nodiscard]] maps::Ledger ledger() const { return maps::Ledger(folder_ / "network.db"); }
  core::Result<void> load_ledger();
  core::Result<void> save(const RobotSession& session) const;
  core::Result<RobotSession*> open_session(const RobotStatus& known);
  void poll();
  void receive_status(const ReceivedStatus& received);
  /// Why a robot is not admitted; empty: it is.
  [[nodiscard]] std::string refusal(const RobotStatus& robot) const;
  void admit(const RobotStatus& robot);
  void receive_chunks(RobotSession& session);
  void apply_failure(RobotSession& session, const core::Error& error);
  void confirm_if_complete(RobotSession& session);
  [[nodiscard]] HubStatus status_of(const RobotSession& session) const;
  void publish_all();
  void report_once(const std::string& message);
  [[nodiscard]] std::string progress_line(double kbytes_per_s) const;
  [[nodiscard]] std::uint64_t received_bytes() const;
  [[nodiscard]] std::size_t done() const;

  std::filesystem::path folder_;
  const HubRequest& request_;
  std::unique_ptr<HubBus> bus_;
  core::Log& log_;
  StatusPublisher publisher_;
  std::map<std::string, RobotSession> robots_;
  std::set<std::string> reported_;
  HubMeetings meetings_;
  HubFeedback feedback_;
  HubShow show_;
};

}  // namespace plumbline::net
