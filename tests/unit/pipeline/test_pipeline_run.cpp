// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "plumbline/pipeline/run.hpp"
#include "test_pipeline_toys.hpp"

namespace plumbline::pipeline {
namespace {

const char* const kGraph = R"(stages:
  count: {type: count}
  a: {type: scale, inputs: {number: count}, by: 1}
  b: {type: scale, inputs: {number: a}}
  sum: {type: sum, inputs: {number: b, other: a}}
  collect: {type: collect, inputs: {total: sum}}
taps:
  - {port: b, file: numbers.txt}
  - {port: sum, file: totals.txt}
)";

struct Outcome {
  core::Result<RunReport> report;
  std::string collected;
  bool collected_called = false;
  int most_under_way = 0;
  int tapped = 0;
};

Outcome run(const std::vector<std::string>& overrides, int threads, const Progress& progress = {},
            const core::StopToken& stop = {}) {
  toys::Bench bench;
  StageRegistry registry;
  toys::register_toys(registry, bench);
  auto graph = parse_graph(kGraph, "g.yaml", registry, "/nowhere", overrides);
  if (!graph) return {tl::unexpected<core::Error>(graph.error()), "", false, 0, 0};
  const core::Executor executor(threads);
  const auto log = core::null_log();
  RunContext context;
  context.executor = &executor;
  context.log = log.get();
  context.stop = stop;
  auto report = run_graph(*graph, context, progress);
  return {std::move(report), bench.collected, bench.collected_called, bench.most_under_way, bench.tapped};
}

class RunThreads : public testing::TestWithParam<int> {};

TEST_P(RunThreads, SerialStagesSeeFramesInOrder) {
  std::string expected;
  for (int i = 0; i < 200; ++i) expected += fmt::format("{} +{} ", 2 * i, i);
  const Outcome outcome = run({"count.n=200", "a.late=on"}, GetParam());
  ASSERT_TRUE(outcome.report) << outcome.report.error().message;
  EXPECT_EQ(outcome.collected, expected);
  EXPECT_EQ(outcome.report->frames, 200U);
  EXPECT_FALSE(outcome.report->stopped);
  EXPECT_LE(outcome.most_under_way, 2 * GetParam() + 2);
}

TEST_P(RunThreads, NothingForAFrameSkipsWhatNeedsIt) {
  const Outcome outcome = run({"count.n=6", "b.drop_odd=on"}, GetParam());
  ASSERT_TRUE(outcome.report) << outcome.report.error().message;
  EXPECT_EQ(outcome.collected, "0 +0 4 +2 8 +4 ");
  EXPECT_EQ(outcome.tapped, 0 + 4 + 8);
  const StageTiming& sum = outcome.report->stages[3];
  ASSERT_EQ(sum.frame_ms.size(), 6U);
  EXPECT_TRUE(std::isnan(sum.frame_ms[1]));
  EXPECT_FALSE(std::isnan(sum.frame_ms[2]));
}

TEST_P(RunThreads, TheEarliestFailureIsTold) {
  for (int repeat = 0; repeat < 20; ++repeat) {
    const Outcome outcome = run({"count.n=300", "a.late=on", "b.fail_at=17", "a.fail_at=19"}, GetParam());
    ASSERT_FALSE(outcome.report);
    EXPECT_EQ(outcome.report.error().message, "number 17 is broken");
    EXPECT_EQ(outcome.report.error().kind, core::ErrorKind::kInput);
    EXPECT_FALSE(outcome.collected_called);
  }
}

TEST_P(RunThreads, AnExceptionIsABugOfItsStage) {
  const Outcome outcome = run({"count.n=50", "b.throw_at=5"}, GetParam());
  ASSERT_FALSE(outcome.report);
  EXPECT_EQ(outcome.report.error().message, "stage b: thrown");
  EXPECT_EQ(outcome.report.error().kind, core::ErrorKind::kInternal);
}

TEST_P(RunThreads, StoppingEndsInOrderAndFinishes) {
  const core::StopToken stop;
  std::size_t last = 0;
  const Progress progress = [&](std::size_t done, std::size_t total) {
    EXPECT_EQ(done, last + 1);
    EXPECT_EQ(total, 5000U);
    last = done;
    if (done == 10) stop.request_stop();
  };
  const Outcome outcome = run({"count.n=5000"}, GetParam(), progress, stop);
  ASSERT_TRUE(outcome.report) << outcome.report.error().message;
  EXPECT_TRUE(outcome.report->stopped);
  EXPECT_GE(outcome.report->frames, 10U);
  EXPECT_LE(outcome.report->frames, 10U + static_cast<std::size_t>(2 * GetParam() + 2));
  EXPECT_TRUE(outcome.collected_called);
  EXPECT_EQ(outcome.collected.substr(0, 12), "0 +0 2 +1 4 ");
}

TEST_P(RunThreads, NoFramesIsARunToo) {
  const Outcome outcome = run({"count.n=0"}, GetParam());
  ASSERT_TRUE(outcome.report) << outcome.report.error().message;
  EXPECT_EQ(outcome.report->frames, 0U);
  EXPECT_TRUE(outcome.collected_called);
  EXPECT_EQ(outcome.collected, "");
}

INSTANTIATE_TEST_SUITE_P(Threads, RunThreads, testing::Values(1, 2, 7));

TEST(StageTiming, QuantilesPassOverIdleFrames) {
  StageTiming timing;
  EXPECT_EQ(timing.quantile_ms(0.5), 0.0);
  const float nan = std::nanf("");
  timing.frame_ms = {nan, 3.0F, nan, 1.0F, 2.0F};
  EXPECT_EQ(timing.quantile_ms(0.5), 2.0);
  EXPECT_EQ(timing.quantile_ms(0.0), 1.0);
  EXPECT_EQ(timing.quantile_ms(1.0), 3.0);
}

}  // namespace
}  // namespace plumbline::pipeline
