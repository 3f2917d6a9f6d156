// SPDX-License-Identifier: BSD-3-Clause
#include "run/pace.hpp"

#include <algorithm>
#include <thread>

namespace plumbline::pipeline {

double Pace::due_s(std::size_t frame) const {
  if (!(hz_ > 0.0)) return 0.0;
  const std::size_t number = recordings_ != nullptr ? recordings_->frame_of(frame) : frame;
  return static_cast<double>(number) / hz_;
}

Pace::Clock::time_point Pace::time_of(std::size_t frame) {
  if (!start_) start_ = Clock::now();
  const std::chrono::duration<double> since_first(due_s(frame) - first_s_);
  return *start_ + std::chrono::duration_cast<Clock::duration>(since_first);
}

bool Pace::is_due(std::size_t frame) {
  if (!(hz_ > 0.0)) return true;
  const Clock::time_point due = time_of(frame);  // first: it may start the clock
  return due <= Clock::now();
}

void Pace::wait_for(std::size_t frame, const core::StopToken& stop) {
  if (!(hz_ > 0.0)) return;
  constexpr std::chrono::milliseconds kLookUp(10);  // whether to stop
  const Clock::time_point due = time_of(frame);
  for (Clock::time_point now = Clock::now(); now < due && !stop.stop_requested(); now = Clock::now()) {
    std::this_thread::sleep_until(std::min(due, now + kLookUp));
  }
}

void Pace::done(std::size_t frame) {
  if (!(hz_ > 0.0)) return;
  const std::chrono::duration<double> late = Clock::now() - time_of(frame);
  behind_s_ = std::max(behind_s_, late.count());
}

}  // namespace plumbline::pipeline
