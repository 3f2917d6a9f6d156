// SPDX-License-Identifier: BSD-3-Clause
// A map that has torn is not called trustworthy.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "plumbline/maps/map.hpp"
#include "plumbline/pipeline/map_recording.hpp"

namespace plumbline::pipeline {
namespace {

core::Result<RunSummary> map_room(const std::filesystem::path& out, double tear_m) {
  MapRequest request;
  request.input = "synth:room?frames=60&fps=15&seed=2";
  request.output = out;
  request.pipelines_folder = std::filesystem::path(PLUMBLINE_SOURCE_DIR) / "pipelines";
  request.overrides = {"output.views=", "output.pcd=off", "refine.adjust=off"};
  request.alter_map = [tear_m](maps::Map& map) {
    const auto ids = map.keyframe_ids();
    for (std::size_t i = ids.size() / 2; i < ids.size(); ++i) {
      geometry::Rigid3 pose = map.camera_from_world(ids[i]);
      pose.translation.y() += tear_m;
      map.set_pose(ids[i], pose);
    }
  };
  const core::Executor executor(2);
  const auto log = core::null_log();
  return map_recording(request, executor, *log, {}, {});
}

TEST(TornMap, IsFoundAtTheEnd) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();  // the test program's own
  const auto whole = map_room(folder / "torn_map_whole", 0.0);
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(whole->reason, "");
  const auto torn = map_room(folder / "torn_map_torn", 0.1);
  ASSERT_TRUE(torn) << torn.error().message;
  EXPECT_NE(torn->reason.find("the map is torn"), std::string::npos) << torn->reason;
  const auto path = nlohmann::json::parse(torn->json).at("path");
  ASSERT_FALSE(path.at("tears").empty());
  EXPECT_NEAR(path.at("largest_step_m").get<double>(), 0.1, 0.02);
}

}  // namespace
}  // namespace plumbline::pipeline
