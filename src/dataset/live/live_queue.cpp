// SPDX-License-Identifier: BSD-3-Clause
#include "live/live_queue.hpp"

#include <cmath>
#include <utility>

namespace plumbline::dataset {
namespace {

constexpr std::chrono::milliseconds kAskForStop(20);

bool is_later(double stamp, double last) { return std::nearbyint(stamp * 1e6) > std::nearbyint(last * 1e6); }

std::size_t bytes_of(const LiveEntry& entry) { return entry.color->size() + entry.depth->size(); }

}  // namespace

LiveQueue::Answer LiveQueue::push(LiveEntry entry) {
  const std::lock_guard lock(mutex_);
  if (ended_) return Answer::kEnded;
  if (!infos_.empty() && !is_later(entry.stamp, infos_.back().stamp)) return Answer::kBackwards;
  if (full()) return Answer::kFull;

  // Colour and depth share the frame's number
  const std::size_t index = infos_.size();
  infos_.push_back({entry.stamp, entry.depth_stamp, {ImageList::kColor, index}, {ImageList::kDepth, index}});
  waiting_bytes_ += bytes_of(entry);
  frames_[index].entry = std::move(entry);
  changed_.notify_all();
  return Answer::kTaken;
}

void LiveQueue::end() {
  const std::lock_guard lock(mutex_);
  ended_ = true;
  changed_.notify_all();
}

void LiveQueue::abandon() {
  const std::lock_guard lock(mutex_);
  ended_ = abandoned_ = true;
  changed_.notify_all();
}

std::size_t LiveQueue::size() const {
  const std::lock_guard lock(mutex_);
  return infos_.size();
}

std::size_t LiveQueue::waiting() const {
  const std::lock_guard lock(mutex_);
  return infos_.size() - handed_out_;
}

bool LiveQueue::wait_for_room(std::size_t most, double seconds) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, std::chrono::duration<double>(seconds),
                           [&] { return infos_.size() - handed_out_ < most && !full(); });
}

PairInfo LiveQueue::info(std::size_t index) const {
  const std::lock_guard lock(mutex_);
  return infos_.at(index);
}

SharedBytes LiveQueue::image(ImageId id) const {
  const std::lock_guard lock(mutex_);
  const auto found = frames_.find(id.number);
  if (found == frames_.end()) return nullptr;
  const Frame& frame = found->second;
  const bool color = id.list == ImageList::kColor;
  if (const SharedBytes& bytes = color ? frame.entry.color : frame.entry.depth) return bytes;

  // Kept frames stay readable after their release
  auto kept = kept_.get(*frame.kept + (color ? 0 : 1));
  return kept ? std::make_shared<const core::Bytes>(std::move(*kept)) : nullptr;
}

std::optional<geometry::Rigid3> LiveQueue::odometry(std::size_t index) const {
  const std::lock_guard lock(mutex_);
  const auto found = frames_.find(index);
  return found == frames_.end() ? std::nullopt : found->second.entry.odometry;
}

bool LiveQueue::decided(std::size_t index) const {
  const std::lock_guard lock(mutex_);
  return settled(index);
}

void LiveQueue::wait_for(std::size_t index, std::chrono::milliseconds most) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, most, [&] { return settled(index); });
}

bool LiveQueue::is_last(std::size_t index, const core::StopToken& stop) const {
  std::unique_lock lock(mutex_);
  while (!settled(index + 1) && !stop.stop_requested()) changed_.wait_for(lock, kAskForStop);
  return ended_ && index + 1 == infos_.size();
}

bool LiveQueue::given_up() const {
  const std::lock_guard lock(mutex_);
  return abandoned_;
}

LiveReport LiveQueue::report() const {
  const std::lock_guard lock(mutex_);
  LiveReport report;
  report.taken = infos_.size();

  // Each kept frame has two images
  report.kept = kept_.count() / 2;
  report.kept_bytes = kept_.bytes();
  return report;
}

void LiveQueue::hand_out(std::size_t index) {
  const std::lock_guard lock(mutex_);
  stop_waiting(index);
}

void LiveQueue::stop_waiting(std::size_t index) {
  for (; handed_out_ <= index && handed_out_ < infos_.size(); ++handed_out_)
    waiting_bytes_ -= bytes_of(frames_.at(handed_out_).entry);
  changed_.notify_all();
}

void LiveQueue::keep(std::size_t index) {
  const std::lock_guard lock(mutex_);
  const auto found = frames_.find(index);
  if (found == frames_.end() || found->second.kept) return;
  Frame& frame = found->second;

  // Depth's number follows that of colour
  frame.kept = kept_.add(*frame.entry.color);
  kept_.add(*frame.entry.depth);
}

void LiveQueue::release(std::size_t index) {
  const std::lock_guard lock(mutex_);
  stop_waiting(index);
  const auto found = frames_.find(index);
  if (found == frames_.end()) return;

  // Kept frames lose only the raw images
  if (!found->second.kept) {
    frames_.erase(found);
    return;
  }
  found->second.entry.color = nullptr;
  found->second.entry.depth = nullptr;
}

void LiveQueue::keep_in(const std::filesystem::path& folder) {
  const std::lock_guard lock(mutex_);
  kept_.open(folder);
}

}  // namespace plumbline::dataset
