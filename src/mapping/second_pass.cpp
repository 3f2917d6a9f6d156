// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/second_pass.hpp"

#include <algorithm>
#include <deque>

#include "plumbline/maps/components.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;

/// A picture that is read beside the tracker.
struct Ahead {
  std::size_t frame = 0;
  std::optional<std::pair<sensor::RgbdFrame, Slam::Features>> read;
  core::Executor::Job job;  // last: its destructor waits for it
};

class SecondPassRun {
 public:
  SecondPassRun(const Slam& first, const SecondPass& how, const core::Executor& executor)
      : first_(first), how_(how), executor_(executor), frames_(first.frame_poses()) {}

  std::unique_ptr<Slam> run() {
    if (maps::roots(first_.map()).size() != 1) return nullptr;
    predict();
    choose();
    again_ = how_.begin();
    if (!track()) return nullptr;
    again_->finish();
    place_frames_between();
    again_->set_frames(std::move(frames_));
    return std::move(again_);
  }

 private:
  /// Steps and poses as the better camera would have measured them.
  void predict() {
    maps::Map map = first_.map();
    recalibrate_map({first_.image(), first_.camera(), how_.camera}, map, frames_);
    for (const maps::FramePose& frame : frames_) {
      const bool known = frame.tracked && map.has_keyframe(frame.reference);
      predicted_.push_back(
          known ? std::optional(frame.camera_from_reference * map.camera_from_world(frame.reference))
                : std::nullopt);
    }
  }

  void choose() {
    SecondPassChoice choice;
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      keyframe_.push_back(maps::became_keyframe(frames_[i], first_.map()));
      if (choice.takes(keyframe_[i]) && predicted_[i]) chosen_.push_back(i);
    }
    placed_.resize(frames_.size());
  }

  [[nodiscard]] bool track() {
    constexpr std::size_t kAhead = 6;
    std::deque<std::unique_ptr<Ahead>> ahead;
    std::size_t next = 0;
    while (next < chosen_.size() || !ahead.empty()) {
      while (next < chosen_.size() && ahead.size() < kAhead) ahead.push_back(begin_reading(chosen_[next++]));
      const std::unique_ptr<Ahead> now = std::move(ahead.front());
      ahead.pop_front();
      now->job.wait();
      if (!now->read || !track(*now)) return false;
    }
    return true;
  }

  [[nodiscard]] std::unique_ptr<Ahead> begin_reading(std::size_t frame) const {
    auto ahead = std::make_unique<Ahead>();
    ahead->frame = frame;
    ahead->job =
        executor_.submit([this, to = ahead.get()] { to->read = how_.read(frames_[to->frame].stamp); });
    return ahead;
  }

  /// True unless the frame had to become a keyframe and did not.
  [[nodiscard]] bool track(Ahead& ahead) {
    auto& [frame, features] = *ahead.read;
    frame.odometry = predicted_[ahead.frame]->inverse();
    const bool keyframe = keyframe_[ahead.frame];
    again_->process(frame, features, keyframe ? Slam::Keyframe::kYes : Slam::Keyframe::kNo);
    if (again_->frame_poses().empty()) return !keyframe;

    const maps::FramePose& found = again_->frame_poses().back();
    if (keyframe && !(found.tracked && found.reference == frames_[ahead.frame].reference)) return false;
    if (found.tracked && found.stamp == frame.stamp) placed_[ahead.frame] = found;
    return true;
  }

  /// Frames that were not tracked again keep the tracker's steps; what these miss between two frames that
  /// were is spread over them.
  void place_frames_between() {
    // A gap between two tracked frames is bridged from both ends; after the last one
    // only that frame's pose is known.
    std::size_t last = frames_.size();  // the last frame with a new pose
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      if (!placed_[i]) continue;
      if (last < i) bridge(last, i);
      last = i;
    }
    if (last < frames_.size()) bridge(last, frames_.size());

    // Frames that the first pass had lost, or that precede the first tracked one, stay without a pose.
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      if (!placed_[i]) {
        frames_[i].tracked = false;
        continue;
      }

      frames_[i].tracked = true;
      frames_[i].reference = placed_[i]->reference;
      frames_[i].camera_from_reference = placed_[i]->camera_from_reference;
      frames_[i].seen = placed_[i]->seen;
    }
  }

  [[nodiscard]] Rigid3 pose(std::size_t frame) const {
    return placed_[frame]->camera_from_reference * again_->map().camera_from_world(placed_[frame]->reference);
  }

  /// Frames between `from` and `to`, which have new poses; `to` may be one after the last.
  void bridge(std::size_t from, std::size_t to) {
    const Rigid3& reference = again_->map().camera_from_world(placed_[from]->reference);
    const Rigid3 begin = pose(from);
    const auto moved = [&](std::size_t i) { return *predicted_[i] * predicted_[from]->inverse() * begin; };

    geometry::Vector6d missed = geometry::Vector6d::Zero();
    if (to < frames_.size()) missed = geometry::log_se3(pose(to) * moved(to).inverse());
    for (std::size_t i = from + 1; i < to; ++i) {
      if (!predicted_[i]) continue;
      const double share = static_cast<double>(i - from) / static_cast<double>(to - from);
      maps::FramePose placed;
      placed.reference = placed_[from]->reference;
      placed.camera_from_reference = geometry::exp_se3(share * missed) * moved(i) * reference.inverse();
      placed_[i] = placed;
    }
  }

  const Slam& first_;
  const SecondPass& how_;
  const core::Executor& executor_;
  std::vector<maps::FramePose> frames_;
  std::vector<std::optional<Rigid3>> predicted_;  ///< camera_from_world of each frame; none: it was lost
  std::vector<bool> keyframe_;
  std::vector<std::size_t> chosen_;
  std::unique_ptr<Slam> again_;
  std::vector<std::optional<maps::FramePose>> placed_;  ///< with a new pose
};

}  // namespace

std::unique_ptr<Slam> map_again(const Slam& first, const SecondPass& how, const core::Executor& executor) {
  return SecondPassRun(first, how, executor).run();
}

}  // namespace plumbline::mapping
