// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Recordings played as a live camera would deliver them.
#include <chrono>
#include <cstddef>
#include <optional>

#include "plumbline/core/stop.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"

namespace plumbline::pipeline {

/// Limits the rate at which frames enter the pipeline: frame n of a recording no earlier than n / hz seconds
/// after the first frame of all. Results do not depend on it. Several recordings are played together in the
/// order of their stamps: the one with most frames per second has `hz`, the others are slower accordingly.
class Pace {
 public:
  /// hz 0: no limit. `first`: the first frame of the run.
  Pace(double hz, std::size_t first, const RobotRecordings* recordings)
      : hz_(hz), recordings_(recordings), first_s_(due_s(first)) {}

  /// Waits until the frame is due, or until `stop` is requested.
  void wait_for(std::size_t frame, const core::StopToken& stop);
  /// True if the frame is due. The clock starts with the first query.
  bool is_due(std::size_t frame);
  /// Reports a frame as completely processed.
  void done(std::size_t frame);
  /// Delay of the latest frame behind its due time when it was done, seconds; 0 without a pace.
  [[nodiscard]] double behind_s() const { return behind_s_; }

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] double due_s(std::size_t frame) const;
  [[nodiscard]] Clock::time_point time_of(std::size_t frame);

  double hz_;
  const RobotRecordings* recordings_;
  double first_s_;
  std::optional<Clock::time_point> start_;
  double behind_s_ = 0.0;
};

}  // namespace plumbline::pipeline
