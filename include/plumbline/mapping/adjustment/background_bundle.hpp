// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Local bundle adjustment beside the tracker, by logical time: a bundle is taken from the map at frame k,
// adjusted on another thread, and put back before frame k + lag is tracked, whatever the clock says. So the
// map does not depend on how fast or on how many threads the work is done.
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/mapping/adjustment/local_bundle.hpp"

namespace plumbline::mapping {

/// Report of one adjustment; the times are informative only, no decision depends on them.
struct BundleReport {
  core::KeyframeId keyframe;  ///< keyframe at its centre; invalid: nothing was put back
  optimize::BundleSummary summary;
  std::optional<Contradiction> refused;  ///< reason for not putting it back
  double wait_ms = 0.0;                  ///< waiting time of the tracker
  double solve_ms = 0.0;                 ///< wall time of the adjustment
};

/// Runs one bundle at a time in the background. If keyframes request one meanwhile, the newest gets the next
/// one, which is taken as soon as the present one is put back: its surroundings include the others.
class BackgroundBundle {
 public:
  /// `lag`: frames between taking and putting back; 0: adjusted on the spot. Executor and log must outlive
  /// this.
  BackgroundBundle(const LocalBundleOptions& window, const optimize::BundleOptions& solver, int lag,
                   const sensor::Pinhole& camera, const core::Executor& executor, core::Log& log)
      : window_(window), solver_(solver), lag_(lag), camera_(camera), executor_(&executor), log_(&log) {}

  /// Asks for the surroundings of a keyframe that was made at `frame`.
  void request(const maps::Map& map, core::KeyframeId keyframe, std::int64_t frame);
  /// True if the bundle is to be put back at this frame.
  [[nodiscard]] bool due(std::int64_t frame) const { return running_ != nullptr && frame >= running_->due; }
  /// Waits for the running bundle, puts it back, and starts the next one if requested. Returns what moved;
  /// nothing if the bundle was not used.
  std::optional<MapCorrection> commit(maps::Map& map, std::int64_t frame, BundleReport& report);
  /// True if no bundle is running or requested.
  [[nodiscard]] bool idle() const { return running_ == nullptr && waiting_.empty(); }
  /// Bundles that would have torn the map, and were not put into it.
  [[nodiscard]] int refused() const { return refused_; }

 private:
  struct Running {
    core::KeyframeId keyframe;
    std::int64_t due = 0;
    LocalBundle bundle;
    optimize::BundleSummary summary;
    double solve_ms = 0.0;
    core::Executor::Job job;  ///< last: its destructor waits before the rest is destroyed
  };
  void begin(const maps::Map& map, std::int64_t frame);

  LocalBundleOptions window_;
  optimize::BundleOptions solver_;
  int lag_;
  sensor::Pinhole camera_;
  const core::Executor* executor_;
  core::Log* log_;
  std::unique_ptr<Running> running_;
  std::vector<core::KeyframeId> waiting_;  ///< the newest first
  int refused_ = 0;
};

}  // namespace plumbline::mapping
