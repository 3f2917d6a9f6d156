// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Shows an observer the data that reach a hub: paths, poses and clouds of the robots, from the copies of
// their stores. A job in parallel to the hub's thread.
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "bus.hpp"
#include "hub/hub_meetings.hpp"
#include "hub/robot_session.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/maps/store_replica.hpp"
#include "plumbline/pipeline/observer.hpp"

namespace plumbline::net {

class HubShow {
 public:
  /// `observer` null: there is none.
  HubShow(std::shared_ptr<pipeline::RunObserver> observer, const core::Executor& executor, core::Log& log)
      : observer_(std::move(observer)), executor_(executor), log_(log) {}

  /// To be called often.
  void step(const std::map<std::string, RobotSession>& robots, const HubMeetings& meetings);
  /// Waits for the running job.
  void finish() {
    if (job_.valid()) job_.wait();
  }

 private:
  /// A robot whose map has grown since it was shown.
  struct Task {
    std::int32_t number = 0;
    std::string name;
    std::filesystem::path file;  ///< of the copy
    maps::MapFollower copy;      ///< its map
    SharedFrame frame;
  };
  void show(const std::vector<std::string>& names, const std::vector<Task>& tasks);
  core::Result<void> show_robot(const Task& task);

  std::shared_ptr<pipeline::RunObserver> observer_;
  const core::Executor& executor_;
  core::Log& log_;
  Clock::time_point next_;
  std::map<std::string, std::int64_t> shown_heads_;                 ///< last transaction shown, by robot
  std::map<std::string, std::set<core::KeyframeId>> shown_clouds_;  ///< of the job
  core::Executor::Job job_;  ///< last member: it ends before the others are destroyed
};

}  // namespace plumbline::net
