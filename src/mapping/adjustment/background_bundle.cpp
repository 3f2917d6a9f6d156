// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/adjustment/background_bundle.hpp"

#include <chrono>
#include <utility>

namespace plumbline::mapping {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace

void BackgroundBundle::request(const maps::Map& map, core::KeyframeId keyframe, std::int64_t frame) {
  waiting_.insert(waiting_.begin(), keyframe);
  if (running_ == nullptr) begin(map, frame);
}

void BackgroundBundle::begin(const maps::Map& map, std::int64_t frame) {
  std::vector<core::KeyframeId> wanted;
  for (core::KeyframeId id : std::exchange(waiting_, {})) {
    if (map.has_keyframe(id)) wanted.push_back(id);
  }
  if (wanted.empty()) return;
  running_ = std::make_unique<Running>();
  running_->keyframe = wanted.front();
  running_->due = frame + lag_;
  running_->bundle = take_local_bundle(map, wanted.front(), camera_, window_, wanted);
  running_->job = executor_->submit([running = running_.get(), solver = solver_] {
    const auto start = Clock::now();
    running->summary = optimize::adjust_bundle(running->bundle.problem, solver);
    running->solve_ms = ms_since(start);
  });
}

std::optional<MapCorrection> BackgroundBundle::commit(maps::Map& map, std::int64_t frame,
                                                      BundleReport& report) {
  const auto start = Clock::now();
  if (!running_->job.ready()) running_->job.wait();
  report.wait_ms = ms_since(start);
  running_->job.wait();  // does not wait any more, but rethrows errors of the job
  const std::unique_ptr<Running> done = std::move(running_);
  report.keyframe = done->keyframe;
  report.summary = done->summary;
  report.solve_ms = done->solve_ms;
  std::optional<MapCorrection> correction;
  if (done->summary.usable) correction = put_back(done->bundle, map, &report.refused);
  if (report.refused) {
    ++refused_;
    log_->warning("a local bundle was not put into the map: " + report.refused->text());
  }
  begin(map, frame);
  return correction;
}

}  // namespace plumbline::mapping
