// SPDX-License-Identifier: BSD-3-Clause
#include "hub/hub_meetings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "plumbline/core/own_files.hpp"

namespace plumbline::net {
namespace {

void put_pose(const geometry::Rigid3& pose, std::array<double, 7>& to) {
  const Eigen::Quaterniond q = pose.quaternion();
  const Eigen::Vector3d& t = pose.translation;
  to = {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

/// The robot's frame in the anchor's, with the upper triangle of the covariance.
SharedFrame shared_frame(const mapping::RobotPlace& from, const std::string& frame_of) {
  SharedFrame frame;
  frame.frame_of = frame_of;
  put_pose(from.anchor_from_robot, frame.frame_from_robot);
  put_pose(from.anchor_from_camera, frame.frame_from_camera);
  std::size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) frame.covariance[next++] = from.covariance(row, column);
  }
  return frame;
}

}  // namespace

geometry::Rigid3 pose_of(const SharedFrame& frame) {
  const std::array<double, 7>& p = frame.frame_from_robot;
  return {Eigen::Quaterniond(p[6], p[3], p[4], p[5]), Eigen::Vector3d(p[0], p[1], p[2])};
}

HubMeetings::HubMeetings(const std::filesystem::path& folder, const core::Executor& executor, core::Log& log)
    : executor_(&executor), log_(&log), reported_(folder, log) {
  const auto removed =
      core::remove_own_files(folder / "meetings", {"*/meeting.json", "*/*.txt", "*/map.png"});
  if (!removed) log.warning(removed.error().message);
  begin();
}

void HubMeetings::begin() {
  server_ = std::make_unique<mapping::MergeServer>(mapping::MapFusionOptions{}, 0, *executor_);
  robots_.clear();
  names_.clear();
  frames_.clear();
  work_ = {};
}

void HubMeetings::restart() {
  job_.wait();
  for (const auto& [robot, known] : robots_) changed_.insert(robot);
  begin();
}

/// In the job: looks up the keyframes that are new in one robot's map.
void HubMeetings::search(const std::string& robot, const maps::MapFollower& copy) {
  const std::string head = fmt::format("search {}: {}", ++work_.searches, robot);
  const Robot& known = robots_[robot];
  const std::size_t number = known.number.value_or(names_.size());
  auto stored = copy.map(static_cast<std::int32_t>(number));
  if (!stored) {  // rows that belong together are incomplete; more will come
    work_.lines.push_back(head + " waits for more of its rows");
    return;
  }

  const int added = add(robot, number, *std::move(stored));
  work_.lines.push_back(fmt::format("{} up to transaction {}, {} new keyframes", head, copy.head(), added));
  for (mapping::MeetingEvent& event : server_->finish()) work_.events.push_back(std::move(event));
}

/// Adds the keyframes of a robot's map that are new. Returns how many.
int HubMeetings::add(const std::string& robot, std::size_t number, maps::StoredMap&& stored) {
  Robot& known = robots_[robot];
  if (stored.map.keyframe_count() == 0) return 0;

  if (!known.number) {
    const sensor::Pinhole camera = maps::camera_of(stored.header.robots, 0).color;
    known.number = server_->join({{static_cast<std::int32_t>(number), camera}});
    names_.push_back(robot);
  }

  // Every new keyframe is searched in the others' maps
  const auto map = std::make_shared<const maps::Map>(std::move(stored.map));
  int added = 0;
  for (const core::KeyframeId id : map->keyframe_ids()) {
    if (id.index < known.keyframes) continue;
    server_->add(map, id, work_.searches);
    known.keyframes = id.index + 1;
    ++added;
  }

  return added;
}

/// Searches in the background; true if one has been reported.
bool HubMeetings::step(const std::map<std::string, RobotSession>& robots) {
  // One search at a time
  if (job_.valid()) {
    if (!job_.ready()) return false;
    report();
    return true;
  }

  // Copies of the maps that changed
  std::vector<std::pair<std::string, maps::MapFollower>> copies;
  for (const std::string& name : std::exchange(changed_, {})) {
    const auto session = robots.find(name);
    if (session != robots.end()) copies.emplace_back(name, session->second.copy().map());
  }
  if (copies.empty()) return false;

  // The search runs while the hub serves
  job_ = executor_->submit([this, copies = std::make_shared<decltype(copies)>(std::move(copies))] {
    for (const auto& [robot, copy] : *copies) search(robot, copy);
  });
  return false;
}

/// Logs what the search found and updates the common frames.
void HubMeetings::report() {
  job_.wait();
  for (const std::string& line : std::exchange(work_.lines, {})) log_->debug(line);
  for (const mapping::MeetingEvent& event : std::exchange(work_.events, {})) {
    const auto noted = reported_.note(event, names_, fmt::format("(search {})", event.frame), -1.0);
    if (!noted) log_->warning(noted.error().message);
  }
  frames_.clear();
  for (const auto& [robot, known] : robots_) {
    if (!known.number) continue;
    if (const auto place = server_->place(*known.number))
      frames_[robot] = shared_frame(*place, names_[place->anchor]);
  }
}

void HubMeetings::finish(const std::map<std::string, RobotSession>& robots) {
  do {
    step(robots);
    if (job_.valid()) report();
  } while (!changed_.empty());
  if (const auto drawn = reported_.draw(); !drawn) log_->warning(drawn.error().message);
}

SharedFrame HubMeetings::frame(const std::string& robot) const {
  const auto found = frames_.find(robot);
  return found == frames_.end() ? SharedFrame{} : found->second;
}

}  // namespace plumbline::net
