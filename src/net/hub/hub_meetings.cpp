// SPDX-License-Identifier: BSD-3-Clause
#include "hub/hub_meetings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <system_error>
#include <utility>

#include "plumbline/core/packing.hpp"

namespace plumbline::net {
namespace {

constexpr std::size_t kEntryHead = sizeof(std::uint32_t);  // bytes of the length in front of an entry

void put_pose(const geometry::Rigid3& pose, std::array<double, 7>& to) {
  const Eigen::Quaterniond q = pose.quaternion();
  const Eigen::Vector3d& t = pose.translation;
  to = {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

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

HubMeetings::HubMeetings(std::filesystem::path folder, const core::Executor& executor, core::Log& log)
    : folder_(std::move(folder)), executor_(&executor), log_(&log), reported_(folder_, log) {
  std::error_code ignored;
  std::filesystem::remove_all(folder_ / "meetings", ignored);
  begin();
  job_ = executor_->submit([this] { replay(); });
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
  std::error_code ignored;
  std::filesystem::remove(log_file(), ignored);
}

/// In the job. An entry that is incomplete in the log was not applied.
void HubMeetings::replay() {
  std::uintmax_t whole = 0;
  {
    std::ifstream file(log_file(), std::ios::binary);
    core::Bytes bytes(kEntryHead);

    while (file.read(reinterpret_cast<char*>(bytes.data()), kEntryHead)) {
      core::Bytes packed(core::decode<std::uint32_t>(bytes));
      if (!file.read(reinterpret_cast<char*>(packed.data()), static_cast<std::streamsize>(packed.size())))
        break;
      try {
        apply(core::decode<Entry>(core::unpack(packed.data(), packed.size())));
      } catch (const core::BadBytes&) {
        break;
      }
      whole += kEntryHead + packed.size();
    }
  }

  std::error_code ignored;
  if (std::filesystem::exists(log_file(), ignored)) std::filesystem::resize_file(log_file(), whole, ignored);
}

/// In the job: makes an entry of the new rows in one robot's copy.
void HubMeetings::read_new_rows(const std::string& robot) {
  const std::filesystem::path copy = folder_ / "robots" / robot / "map.db";
  Entry entry{robot, {}};
  std::int64_t head = robots_[robot].follower.head();
  while (true) {
    auto next = maps::next_transaction(copy, maps::StoreStream::kMap, head);
    if (!next || !*next) break;
    head = (*next)->number;
    entry.rows.push_back(std::move(**next));
  }
  if (entry.rows.empty()) return;
  if (const auto appended = append_to_log(entry); !appended) work_.lines.push_back(appended.error().message);
  apply(entry);
}

/// Called before the entry is applied, so that reports follow from the log.
core::Result<void> HubMeetings::append_to_log(const Entry& entry) const {
  const core::Bytes packed = core::pack(core::encoded(entry));
  const core::Bytes head = core::encoded(static_cast<std::uint32_t>(packed.size()));
  std::ofstream file(log_file(), std::ios::binary | std::ios::app);
  for (const core::Bytes* part : {&head, &packed}) {
    file.write(reinterpret_cast<const char*>(part->data()), static_cast<std::streamsize>(part->size()));
  }
  file.flush();
  if (file) return {};
  return core::output_error(log_file().string() +
                            ": cannot be written; a hub that is resumed may report other meetings");
}

/// In the job: applies an entry of the log.
void HubMeetings::apply(const Entry& entry) {
  Robot& known = robots_[entry.robot];
  const std::string head = fmt::format("log {}: {}", ++work_.entry, entry.robot);
  for (const maps::StoreTransaction& rows : entry.rows) {
    if (const auto applied = known.follower.apply(rows); !applied)
      work_.lines.push_back(head + ": " + applied.error().message);
  }
  const auto stored = known.follower.map();
  if (!stored) {  // rows that belong together are incomplete; more will come
    work_.lines.push_back(head + " waits for more of its rows");
    return;
  }
  const int added = add(entry.robot, *stored);
  work_.lines.push_back(
      fmt::format("{} up to transaction {}, {} new keyframes", head, known.follower.head(), added));
  for (mapping::MeetingEvent& event : server_->finish()) work_.events.push_back(std::move(event));
}

/// Adds the keyframes of a robot's map that are new. Returns how many.
int HubMeetings::add(const std::string& robot, const maps::StoredMap& stored) {
  Robot& known = robots_[robot];
  const std::vector<core::KeyframeId> ids = stored.map.keyframe_ids();
  const auto of_others = [](core::KeyframeId id) { return id.robot != 0; };
  if (ids.empty() || std::any_of(ids.begin(), ids.end(), of_others)) return 0;  // a map of several robots

  if (!known.number) {
    const auto next = static_cast<std::int32_t>(names_.size());
    known.number = server_->join({{next, maps::camera_of(stored.header.robots, 0).color}});
    names_.push_back(robot);
  }

  const auto number = static_cast<std::int32_t>(*known.number);
  const auto map = std::make_shared<maps::Map>(maps::renumbered(stored.map, {{0, number}}));
  int added = 0;
  for (const core::KeyframeId id : ids) {
    if (id.index < known.keyframes) continue;
    server_->add(map, {number, id.index}, work_.entry);
    known.keyframes = id.index + 1;
    ++added;
  }

  return added;
}

bool HubMeetings::step() {
  if (job_.valid()) {
    if (!job_.ready()) return false;
    report();
    return true;
  }
  if (changed_.empty()) return false;
  job_ = executor_->submit([this, changed = std::exchange(changed_, {})] {
    for (const std::string& robot : changed) read_new_rows(robot);
  });
  return false;
}

void HubMeetings::report() {
  job_.wait();
  for (const std::string& line : std::exchange(work_.lines, {})) log_->debug(line);
  for (const mapping::MeetingEvent& event : std::exchange(work_.events, {})) {
    const auto noted = reported_.note(event, names_, fmt::format("(log {})", event.frame), -1.0);
    if (!noted) log_->warning(noted.error().message);
  }
  frames_.clear();
  for (const auto& [robot, known] : robots_) {
    if (!known.number) continue;
    if (const auto place = server_->place(*known.number))
      frames_[robot] = shared_frame(*place, names_[place->anchor]);
  }
}

void HubMeetings::finish() {
  do {
    step();
    if (job_.valid()) report();
  } while (!changed_.empty());
  if (const auto drawn = reported_.draw(); !drawn) log_->warning(drawn.error().message);
  std::error_code ignored;
  std::filesystem::remove(log_file(), ignored);
}

SharedFrame HubMeetings::frame(const std::string& robot) const {
  const auto found = frames_.find(robot);
  return found == frames_.end() ? SharedFrame{} : found->second;
}

}  // namespace plumbline::net
