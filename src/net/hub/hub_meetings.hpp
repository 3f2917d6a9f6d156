// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Finds robots that meet while they map, from the copies of their maps. The work is a job in parallel
// to the hub's thread: a commit never waits for it. A hub that is resumed searches the copies again.
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bus.hpp"
#include "hub/robot_session.hpp"
#include "plumbline/mapping/merging/merge_server.hpp"
#include "plumbline/pipeline/meeting_log.hpp"

namespace plumbline::net {

/// The pose frame_from_robot of a shared frame.
geometry::Rigid3 pose_of(const SharedFrame& frame);

class HubMeetings {
 public:
  /// `folder`: of the result; meetings that an earlier process left there are removed.
  HubMeetings(const std::filesystem::path& folder, const core::Executor& executor, core::Log& log);

  /// Notes that the copy of a robot's store has new rows of its map.
  void mark_changed(const std::string& robot) { changed_.insert(robot); }
  /// Starts again with all copies, because one was emptied.
  void restart();
  /// Reports what a job found and submits the next one; to be called often. True if a shared frame changed.
  bool step(const std::map<std::string, RobotSession>& robots);
  /// Called at the end: reports all remaining meetings, and draws.
  void finish(const std::map<std::string, RobotSession>& robots);
  /// Pose of a robot in the frame that it shares with others; empty: it has met no other robot.
  [[nodiscard]] SharedFrame frame(const std::string& robot) const;
  [[nodiscard]] const std::vector<pipeline::Meeting>& meetings() const { return reported_.meetings(); }

 private:
  /// A robot that was searched.
  struct Robot {
    std::optional<std::size_t> number;  ///< in the merge server; none: it has no keyframes yet
    std::int32_t keyframes = 0;         ///< number of those added
  };
  void begin();
  void search(const std::string& robot, const maps::MapFollower& copy);
  int add(const std::string& robot, std::size_t number, maps::StoredMap&& stored);
  void report();

  const core::Executor* executor_;
  core::Log* log_;
  pipeline::MeetingLog reported_;
  std::unique_ptr<mapping::MergeServer> server_;
  std::set<std::string> changed_;  ///< robots with new rows
  std::map<std::string, Robot> robots_;
  std::vector<std::string> names_;  ///< by number
  std::map<std::string, SharedFrame> frames_;
  /// Results of a job, for report().
  struct Work {
    std::int64_t searches = 0;  ///< number of the last one
    std::vector<std::string> lines;
    std::vector<mapping::MeetingEvent> events;
  } work_;
  core::Executor::Job job_;  ///< last member: it ends before the others are destroyed
};

}  // namespace plumbline::net
