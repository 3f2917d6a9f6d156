// SPDX-License-Identifier: BSD-3-Clause
// A run that the user stops before there is anything to write.
#include <gtest/gtest.h>

#include "plumbline/dataset/live_frames.hpp"
#include "plumbline/pipeline/map_recording.hpp"

namespace plumbline::pipeline {
namespace {

MapRequest request_for(const char* name) {
  MapRequest request;
  request.input = "synth:room?frames=4&width=160&height=120";
  request.output = std::filesystem::temp_directory_path() / name;  // the test program's own
  request.pipelines_folder = std::filesystem::path(PLUMBLINE_SOURCE_DIR) / "pipelines";
  request.overrides = {"output.views="};
  return request;
}

TEST(StoppedRun, BeforeTheFirstFrameIsNoFaultOfTheInput) {
  const MapRequest request = request_for("stopped_before");
  const core::StopToken stop;
  stop.request_stop();
  const auto run = map_recording(request, core::Executor(1), *core::null_log(), stop, {});
  ASSERT_FALSE(run);
  EXPECT_EQ(run.error().kind, core::ErrorKind::kStopped);
  EXPECT_EQ(run.error().message, "stopped before the first frame was mapped; nothing is written");
  EXPECT_FALSE(std::filesystem::exists(request.output));
}

TEST(StoppedRun, ASourceThatEndsWithoutAFrameIsOne) {
  MapRequest request = request_for("ended_before");
  sensor::Camera camera;
  camera.color = {160, 120, 130.0, 130.0, 80.0, 60.0};
  request.live = std::make_shared<dataset::LiveFrames>(camera, dataset::LiveFramesOptions{"fed"});
  request.live->close();
  const auto run = map_recording(request, core::Executor(1), *core::null_log(), {}, {});
  ASSERT_FALSE(run);
  EXPECT_EQ(run.error().kind, core::ErrorKind::kInput);
  EXPECT_EQ(run.error().message, "fed: ended before its first frame; nothing is written");
}

}  // namespace
}  // namespace plumbline::pipeline
