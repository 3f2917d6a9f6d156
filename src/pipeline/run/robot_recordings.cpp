// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/robot_recordings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "plumbline/core/text.hpp"

namespace plumbline::pipeline {

RobotRecordings::RobotRecordings(std::vector<std::unique_ptr<dataset::FrameSource>> recordings)
    : recordings_(std::move(recordings)) {
  if (recordings_.empty()) throw std::invalid_argument("RobotRecordings: no recordings");
  for (const auto& recording : recordings_) {
    if (auto* live = dynamic_cast<dataset::LiveFrameSource*>(recording.get())) live_ = live;
  }
  if (recordings_.size() > 1 && live_ != nullptr)
    throw std::invalid_argument("RobotRecordings: one of several is live");

  // Robots' names become folders of the result, so equal names get a number.
  std::set<std::string> taken;
  double latest_start = std::numeric_limits<double>::lowest();
  double earliest_start = std::numeric_limits<double>::max();

  double earliest_end = std::numeric_limits<double>::max();
  for (const auto& recording : recordings_) {
    RobotInfo robot;
    robot.number = static_cast<std::int32_t>(robots_.size());
    const std::string name = core::folder_name(recording->name());
    robot.name = name;

    for (int i = 2; !taken.insert(robot.name).second; ++i) robot.name = fmt::format("{}-{}", name, i);
    robot.camera = recording->camera();
    name_ += (name_.empty() ? "" : " ") + robot.name;
    robots_.push_back(std::move(robot));
    if (recording->size() == 0) continue;

    const double start = recording->info(0).stamp;
    latest_start = std::max(latest_start, start);
    earliest_start = std::min(earliest_start, start);
    earliest_end = std::min(earliest_end, recording->info(recording->size() - 1).stamp);
  }
  if (live_ != nullptr) return;

  // Recordings that overlap in time were made together and keep their offsets; all others are treated as if
  // they had begun at the same moment.
  const bool together = latest_start <= earliest_end;
  for (const RobotInfo& robot : robots_) {
    const dataset::FrameSource& recording = *recordings_[static_cast<std::size_t>(robot.number)];
    for (std::size_t i = 0; i < recording.size(); ++i) {
      const double begin = together ? earliest_start : recording.info(0).stamp;
      order_.push_back({recording.info(i).stamp - begin, robot.number, i});
    }
  }

  // Equal times are ordered by robot and index, so that every run sees the same order of frames.
  std::sort(order_.begin(), order_.end(), [](const Place& a, const Place& b) {
    return std::tie(a.time, a.robot, a.index) < std::tie(b.time, b.robot, b.index);
  });
}

RobotRecordings::Place RobotRecordings::place(std::size_t index) const {
  if (live_ == nullptr) return order_.at(index);
  return {live_->info(index).stamp - live_->info(0).stamp, 0, index};
}

bool RobotRecordings::is_last(std::size_t index, const core::StopToken& stop) const {
  if (live_ != nullptr) return live_->is_last(index, stop);
  const Place at = place(index);
  return at.index + 1 == of(at).size();
}

dataset::PairInfo RobotRecordings::info(std::size_t index) const {
  const Place at = place(index);
  return of(at).info(at.index);
}

std::optional<std::size_t> RobotRecordings::frame_at(std::int32_t robot, double stamp) const {
  const dataset::FrameSource& recording = *recordings_[static_cast<std::size_t>(robot)];
  std::size_t first = 0;
  std::size_t last = recording.size();
  while (first < last) {
    const std::size_t middle = first + (last - first) / 2;
    if (recording.info(middle).stamp < stamp)
      first = middle + 1;
    else
      last = middle;
  }
  if (first == recording.size() || recording.info(first).stamp != stamp) return std::nullopt;
  return first;
}

dataset::RecordingNotes RobotRecordings::notes() const {
  dataset::RecordingNotes all;
  for (const auto& recording : recordings_) {
    const dataset::RecordingNotes notes = recording->notes();
    all.missing += notes.missing;
    if (all.doubt.empty()) all.doubt = notes.doubt;
  }
  return all;
}

void RobotRecordings::correct(std::size_t from, const std::vector<sensor::Camera>& cameras) {
  const std::lock_guard lock(mutex_);
  corrected_from_ = from;
  corrected_.clear();
  for (std::size_t r = 0; r < recordings_.size(); ++r)
    corrected_.push_back(recordings_[r]->taken_by(cameras.at(r)));
}

std::shared_ptr<const dataset::FrameSource> RobotRecordings::corrected(std::size_t index) const {
  const std::lock_guard lock(mutex_);
  if (corrected_.empty() || index < corrected_from_) return nullptr;
  return corrected_[static_cast<std::size_t>(robot_of(index))];
}

core::Result<sensor::RgbdFrame> RobotRecordings::read(std::size_t index) const {
  const Place at = place(index);
  const auto better = corrected(index);
  return (better ? *better : of(at)).read(at.index);
}

}  // namespace plumbline::pipeline
