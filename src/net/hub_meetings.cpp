// SPDX-License-Identifier: BSD-3-Clause
#include "hub_meetings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "plumbline/maps/store.hpp"

namespace plumbline::net {
namespace {

void put_pose(const geometry::Rigid3& pose, std::array<double, 7>& to) {
  const Eigen::Quaterniond q = pose.quaternion();
  const Eigen::Vector3d& t = pose.translation;
  to = {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

Place told_place(const mapping::RobotPlace& from, const std::string& frame_of) {
  Place place;
  place.frame_of = frame_of;
  put_pose(from.anchor_from_robot, place.frame_from_robot);
  put_pose(from.anchor_from_camera, place.frame_from_camera);
  std::size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) place.covariance[next++] = from.covariance(row, column);
  }
  return place;
}

}  // namespace

HubMeetings::HubMeetings(std::filesystem::path folder, const core::Executor& executor, core::Log& log)
    : folder_(std::move(folder)), executor_(&executor), log_(&log), reported_(folder_, log) {
  std::error_code ignored;
  std::filesystem::remove_all(folder_ / "meetings", ignored);
  restart();
}

void HubMeetings::committed(const std::string& robot, std::int64_t transaction) {
  changed_[robot] = transaction;
}

void HubMeetings::restart() {
  job_.wait();
  server_ = std::make_unique<mapping::MergeServer>(mapping::MapFusionOptions{}, 0, *executor_);
  for (const auto& [robot, known] : known_) changed_.emplace(robot, 0);
  known_.clear();
  names_.clear();
  places_.clear();
  done_ = {};
}

/// In the work: what is new in one robot's copy.
void HubMeetings::take(const std::string& robot, std::int64_t transaction) {
  auto stored = maps::load_map(folder_ / "robots" / robot / "map.db");
  if (!stored) {  // rows that belong together came in part; the next ones will tell
    done_.lines.push_back(fmt::format("{}: is looked at when more of its rows are here", robot));
    return;
  }
  const std::vector<core::KeyframeId> ids = stored->map.keyframe_ids();
  const auto of_others = [](core::KeyframeId id) { return id.robot != 0; };
  if (ids.empty() || std::any_of(ids.begin(), ids.end(), of_others)) return;  // of several robots already
  auto known = known_.find(robot);
  if (known == known_.end()) {
    const auto number = static_cast<std::int32_t>(names_.size());
    known = known_
                .emplace(robot,
                         Known{server_->join({{number, maps::camera_of(stored->header.robots, 0).color}}), 0})
                .first;
    names_.push_back(robot);
  }
  const auto number = static_cast<std::int32_t>(known->second.number);
  const auto map = std::make_shared<maps::Map>(maps::renumbered(stored->map, {{0, number}}));
  ++done_.entry;
  int added = 0;
  for (const core::KeyframeId id : ids) {
    if (id.index < known->second.keyframes) continue;
    server_->add(map, {number, id.index}, done_.entry);
    known->second.keyframes = id.index + 1;
    ++added;
  }
  done_.lines.push_back(fmt::format("log {}: {} up to transaction {}, {} new keyframes", done_.entry, robot,
                                    transaction, added));
  for (mapping::MeetingEvent& event : server_->finish()) done_.events.push_back(std::move(event));
}

bool HubMeetings::step() {
  if (job_.valid()) {
    if (!job_.ready()) return false;
    tell();
    return true;
  }
  if (changed_.empty()) return false;
  job_ = executor_->submit([this, changed = std::exchange(changed_, {})] {
    for (const auto& [robot, transaction] : changed) take(robot, transaction);
  });
  return false;
}

void HubMeetings::tell() {
  job_.wait();
  for (const std::string& line : std::exchange(done_.lines, {})) log_->debug(line);
  for (const mapping::MeetingEvent& event : std::exchange(done_.events, {})) {
    const auto noted = reported_.note(event, names_, fmt::format("(log {})", event.frame), -1.0);
    if (!noted) log_->warning(noted.error().message);
  }
  places_.clear();
  for (const auto& [robot, known] : known_) {
    if (const auto place = server_->place(known.number))
      places_[robot] = told_place(*place, names_[place->anchor]);
  }
}

void HubMeetings::finish() {
  do {
    step();
    if (job_.valid()) tell();
  } while (!changed_.empty());
  if (const auto drawn = reported_.draw(); !drawn) log_->warning(drawn.error().message);
}

Place HubMeetings::place(const std::string& robot) const {
  const auto found = places_.find(robot);
  return found == places_.end() ? Place{} : found->second;
}

}  // namespace plumbline::net
