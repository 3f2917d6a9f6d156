// SPDX-License-Identifier: BSD-3-Clause
#include "hub/hub_show.hpp"

#include <algorithm>
#include <utility>

#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;

constexpr auto kShowEvery = 2s;

}  // namespace

void HubShow::step(const std::map<std::string, RobotSession>& robots, const HubMeetings& meetings) {
  // One job at a time, at a bounded rate
  if (observer_ == nullptr || Clock::now() < next_) return;
  if (job_.valid()) {
    if (!job_.ready()) return;
    job_.wait();
  }
  next_ = Clock::now() + kShowEvery;

  // Only robots with new data
  std::vector<std::string> names;
  std::vector<Task> tasks;
  for (const auto& [name, session] : robots) {
    const auto number = static_cast<std::int32_t>(names.size());
    names.push_back(name);
    const std::int64_t head = session.copy().heads().last();
    if (session.copy().keyframes() == 0 || std::exchange(shown_heads_[name], head) == head) continue;
    tasks.push_back({number, name, session.file(), session.copy().map(), meetings.frame(name)});
  }

  // The display does not delay the hub
  if (tasks.empty()) return;
  job_ = executor_.submit(
      [this, names = std::move(names), tasks = std::make_shared<decltype(tasks)>(std::move(tasks))] {
        show(names, *tasks);
      });
}

void HubShow::show(const std::vector<std::string>& names, const std::vector<Task>& tasks) {
  observer_->begins(names);
  for (const Task& task : tasks) {
    // Related rows may not all have arrived yet; a later step shows them.
    if (const auto shown = show_robot(task); !shown) {
      log_.debug(task.name + ": " + shown.error().message);
      shown_heads_.erase(task.name);
    }
  }
}

core::Result<void> HubShow::show_robot(const Task& task) {
  // The path in the robot's own frame
  const auto stored = task.copy.map();
  if (!stored) return tl::unexpected(stored.error());
  const geometry::Trajectory path = maps::keyframe_trajectory(stored->map);
  if (path.empty()) return {};

  // The common frame comes before the path
  if (!task.frame.frame_of.empty()) observer_->placed(task.number, path.back().stamp, pose_of(task.frame));
  observer_->tracked(task.number, path.back().stamp, path.back().world_from_camera,
                     path.back().world_from_camera);
  observer_->keyframes(task.number, path);

  // Clouds are read from the hub's copy
  const auto store = maps::StoreReader::open(task.file);
  if (!store) return tl::unexpected(store.error());
  const auto clouds = store->cloud_ids();
  if (!clouds) return tl::unexpected(clouds.error());

  // Clouds that were not shown yet
  for (const maps::KeyframePose& keyframe : maps::keyframe_poses(stored->map)) {
    const bool there = std::find(clouds->begin(), clouds->end(), keyframe.id) != clouds->end();
    if (!there || shown_clouds_[task.name].count(keyframe.id) > 0) continue;
    const auto cloud = store->cloud(keyframe.id);
    if (!cloud) return tl::unexpected(cloud.error());
    observer_->added(task.number, keyframe.stamp, keyframe.world_from_camera * cloud::sensor_pose(**cloud),
                     **cloud);
    shown_clouds_[task.name].insert(keyframe.id);
  }

  return {};
}

}  // namespace plumbline::net
