// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Robots that meet while they map, as the hub sees it in the copies of their stores. Beside the hub's thread:
// a commit never waits for it. What is taken is numbered in the log, which is kept with its rows beside the
// copies: from that alone the previews follow, also when the hub was ended and goes on.
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bus.hpp"
#include "plumbline/mapping/merge_server.hpp"
#include "plumbline/maps/store_replica.hpp"
#include "plumbline/pipeline/meeting_log.hpp"

namespace plumbline::net {

class HubMeetings {
 public:
  /// What an earlier process took, as its log in the folder has it, is taken again in the same order.
  HubMeetings(std::filesystem::path folder, const core::Executor& executor, core::Log& log);

  /// The copy of a robot's store, below the folder, has new rows of its map.
  void committed(const std::string& robot) { changed_.insert(robot); }
  /// A copy was emptied: everything is looked at again.
  void restart();
  /// Tells what was found and begins with what came since; to be called often. True: places have changed.
  bool step();
  /// When nothing more will come: tells all that is left, draws, and removes the log.
  void finish();
  /// What a robot is told of where it is.
  [[nodiscard]] Place place(const std::string& robot) const;
  [[nodiscard]] const std::vector<pipeline::RunSummary::Meeting>& meetings() const {
    return reported_.meetings();
  }

 private:
  /// A robot of which something was taken.
  struct Known {
    maps::MapFollower follower;
    std::optional<std::size_t> number;  ///< when it has keyframes
    std::int32_t keyframes = 0;         ///< that were taken
  };
  struct Entry {
    std::string robot;
    std::vector<maps::StoreTransaction> rows;
    template <typename Io>
    friend void fields(Io& io, Entry& entry) {
      io(entry.robot, entry.rows);
    }
  };
  [[nodiscard]] std::filesystem::path log_file() const { return folder_ / "meetings.log"; }
  void begin();
  void take_again();
  void look_at(const std::string& robot);
  core::Result<void> keep(const Entry& entry) const;
  void take(const Entry& entry);
  int add(const std::string& robot, const maps::StoredMap& stored);
  void tell();

  std::filesystem::path folder_;
  const core::Executor* executor_;
  core::Log* log_;
  pipeline::MeetingLog reported_;
  std::unique_ptr<mapping::MergeServer> server_;
  std::set<std::string> changed_;  ///< whose copies have something new
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
