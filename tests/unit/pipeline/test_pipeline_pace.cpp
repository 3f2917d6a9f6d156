// SPDX-License-Identifier: BSD-3-Clause
// Frames handed out as a live camera would.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "../../../src/pipeline/run/pace.hpp"
#include "plumbline/pipeline/run.hpp"
#include "test_pipeline_toys.hpp"

namespace plumbline::pipeline {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct PaceOutcome {
  RunReport report;
  std::string collected;
  double seconds = 0.0;
};

PaceOutcome run(double hz, int frames, const Progress& progress = {}, const core::StopToken& stop = {}) {
  toys::Bench bench;
  StageRegistry registry;
  toys::register_toys(registry, bench);
  const char* const text =
      "stages:\n"
      "  count: {type: count}\n"
      "  a: {type: scale, inputs: {number: count}, late: on}\n"
      "  sum: {type: sum, inputs: {number: a, other: count}}\n"
      "  collect: {type: collect, inputs: {total: sum}}\n";
  auto graph = parse_graph(text, "g.yaml", registry, "/nowhere", {"count.n=" + std::to_string(frames)});
  EXPECT_TRUE(graph) << graph.error().message;
  const core::Executor executor(2);
  const auto log = core::null_log();
  RunContext context;
  context.executor = &executor;
  context.log = log.get();
  context.stop = stop;
  const Clock::time_point start = Clock::now();
  const auto report = run_graph(*graph, context, progress, hz);
  EXPECT_TRUE(report) << report.error().message;
  return {*report, bench.collected, seconds_since(start)};
}

TEST(Pace, FramesComeNoEarlierAndNothingElseChanges) {
  const PaceOutcome at_once = run(0.0, 30);
  const Clock::time_point start = Clock::now();
  std::vector<double> done;
  const PaceOutcome paced =
      run(60.0, 30, [&](std::size_t, std::size_t) { done.push_back(seconds_since(start)); });
  EXPECT_EQ(paced.collected, at_once.collected);
  EXPECT_EQ(paced.report.frames, 30U);
  EXPECT_FALSE(paced.report.stopped);
  EXPECT_GE(paced.seconds, 29.0 / 60.0);
  ASSERT_EQ(done.size(), 30U);
  for (std::size_t i = 0; i < done.size(); ++i) EXPECT_GE(done[i], static_cast<double>(i) / 60.0) << i;
  EXPECT_GT(paced.report.behind_s, 0.0);  // what it takes to go through the stages
  EXPECT_EQ(at_once.report.behind_s, 0.0);
}

TEST(Pace, ThatCannotBeHeldIsToldByHowMuch) {
  const PaceOutcome outcome = run(1000.0, 40, [](std::size_t, std::size_t) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  });
  EXPECT_EQ(outcome.report.frames, 40U);
  EXPECT_GE(outcome.report.behind_s,
            0.1);  // 40 frames of 5 ms and more, the last of which is due after 39 ms
}

TEST(Pace, StopIsHeardWhileTheNextFrameIsWaitedFor) {
  const core::StopToken stop;
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    stop.request_stop();
  });
  const PaceOutcome outcome = run(0.01, 3, {}, stop);
  later.join();
  EXPECT_LT(outcome.seconds, 50.0);  // not the 100 s until the second frame
  EXPECT_EQ(outcome.report.frames, 1U);
  EXPECT_TRUE(outcome.report.stopped);
}

/// So many frames, so far apart.
class Stamps : public dataset::FrameSource {
 public:
  Stamps(std::string name, std::size_t count, double apart_s)
      : name_(std::move(name)), count_(count), apart_s_(apart_s) {}
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] const std::string& format() const override { return name_; }
  [[nodiscard]] const sensor::Camera& camera() const override { return camera_; }
  [[nodiscard]] std::size_t size() const override { return count_; }
  [[nodiscard]] dataset::PairInfo info(std::size_t index) const override {
    dataset::PairInfo info;
    info.stamp = info.depth_stamp = apart_s_ * static_cast<double>(index);
    return info;
  }
  [[nodiscard]] core::Result<sensor::RgbdFrame> read(std::size_t /*index*/) const override {
    return core::input_error("no pictures");
  }
  [[nodiscard]] std::optional<geometry::Trajectory> truth() const override { return std::nullopt; }

 private:
  std::string name_;
  std::size_t count_;
  double apart_s_;
  sensor::Camera camera_;
};

TEST(Pace, RobotsArePlayedTogether) {
  std::vector<std::unique_ptr<dataset::FrameSource>> recordings;
  recordings.push_back(std::make_unique<Stamps>("quick", 5, 0.03));
  recordings.push_back(std::make_unique<Stamps>("slow", 3, 0.06));
  const RobotRecordings robots(std::move(recordings));  // quick 0, slow 0, quick 1, quick 2, slow 1, ...
  Pace pace(20.0, 0, &robots);
  const Clock::time_point start = Clock::now();
  EXPECT_TRUE(pace.is_due(0));
  EXPECT_TRUE(pace.is_due(1));
  const std::vector<double> earliest{0.0, 0.0, 0.05, 0.1, 0.1, 0.15, 0.2, 0.2};
  ASSERT_EQ(robots.size(), earliest.size());
  for (std::size_t i = 0; i < robots.size(); ++i) {
    pace.wait_for(i, {});
    EXPECT_TRUE(pace.is_due(i));
    EXPECT_GE(seconds_since(start), earliest[i] - 1e-6) << i;
  }
}

}  // namespace
}  // namespace plumbline::pipeline
