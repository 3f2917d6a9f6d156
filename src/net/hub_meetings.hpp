// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Robots that meet while they map, as the hub sees it in the copies of their stores. Beside the hub's thread:
// a commit never waits for it. What is taken is numbered in the log: from that alone the previews follow.
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bus.hpp"
#include "plumbline/mapping/merge_server.hpp"
#include "plumbline/pipeline/meeting_log.hpp"

namespace plumbline::net {

class HubMeetings {
 public:
  /// Previews of an earlier process are made again, below the folder.
  HubMeetings(std::filesystem::path folder, const core::Executor& executor, core::Log& log);

  /// The copy of a robot's store, below the folder, holds rows of its map up to this transaction.
  void committed(const std::string& robot, std::int64_t transaction);
  /// A copy was emptied: everything is looked at again.
  void restart();
  /// Tells what was found and begins with what came since; to be called often. True: places have changed.
  bool step();
  /// When nothing more will come: tells all that is left, and draws.
  void finish();
  /// What a robot is told of where it is.
  [[nodiscard]] Place place(const std::string& robot) const;
  [[nodiscard]] const std::vector<pipeline::RunSummary::Meeting>& meetings() const {
    return reported_.meetings();
  }

 private:
  /// A robot whose copy was read once at least.
  struct Known {
    std::size_t number = 0;
    std::int32_t keyframes = 0;  ///< that were taken
  };
  void take(const std::string& robot, std::int64_t transaction);
  void tell();

  std::filesystem::path folder_;
  const core::Executor* executor_;
  core::Log* log_;
  pipeline::MeetingLog reported_;
  std::unique_ptr<mapping::MergeServer> server_;
  std::map<std::string, std::int64_t> changed_;  ///< copies with something new, up to which transaction
  std::map<std::string, Known> known_;
  std::vector<std::string> names_;  ///< by number
  std::map<std::string, Place> places_;
  struct Done {
    std::int64_t entry = 0;  ///< of the log, the last one
    std::vector<std::string> lines;
    std::vector<mapping::MeetingEvent> events;
  } done_;
  core::Executor::Job job_;  ///< last: done before the rest goes
};

}  // namespace plumbline::net
