// SPDX-License-Identifier: BSD-3-Clause
// A robot that loses itself: a second component, joined where both show the same place, and told where they
// do not.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <nlohmann/json.hpp>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "program.hpp"

namespace plumbline::integration {
namespace {

class Components : public ProgramTest {
 protected:
  [[nodiscard]] nlohmann::json summary(const std::string& folder) const {
    return read_json(path(folder + "/summary.json"));
  }
};

const std::string kLean = " -q --set output.views= --set output.pcd=off --set fuse.voxel=20mm";

// A turn of one and a half within a second, in a room that the camera goes round.
TEST_F(Components, ASpinIsOneMap) {
  const Outcome mapped = run("map 'synth:room?frames=330&seed=12&events=spin@6+1*1.5' -o '" +
                             path("out").string() + "'" + kLean);
  ASSERT_EQ(mapped.code, 0) << mapped;
  const nlohmann::json told = summary("out");
  EXPECT_GT(told["frames"]["tracked_percent"], 90.0);
  ASSERT_EQ(told["components"]["list"].size(), 1U) << told["components"];
  const nlohmann::json& joined = told["components"]["list"][0];
  EXPECT_TRUE(joined["joined"]);
  EXPECT_GE(joined["agreeing_keyframes"], 2);
  EXPECT_GT(joined["joined_s"], 6.0);
  EXPECT_FALSE(fs::exists(path("out/components")));
}

// A hand before the lens while the camera moves on, and no way back: two maps, both kept, and said.
TEST_F(Components, WhatNeverJoinsStaysApartAndIsSaid) {
  const std::string out = path("out").string();
  const Outcome mapped = run("map 'synth:room?frames=340&seed=1&events=cover@5+3' -o '" + out + "'" + kLean);
  ASSERT_EQ(mapped.code, 4) << mapped;
  EXPECT_TRUE(mapped.told("form a second map that shares no place with the first: film a place of both"))
      << mapped;
  const nlohmann::json told = summary("out");
  ASSERT_EQ(told["components"]["list"].size(), 2U) << told["components"];
  std::size_t apart = 0;
  for (const nlohmann::json& one : told["components"]["list"]) {
    if (one["joined"]) continue;
    ++apart;
    const std::string folder = "out/components/" + one["name"].get<std::string>();
    const auto cloud = cloud::read_cloud(path(folder + "/map.ply"));
    ASSERT_TRUE(cloud) << cloud.error().message;
    EXPECT_GT(cloud->cloud->size(), 1000U);
    const auto way = dataset::read_trajectory(path(folder + "/trajectory.txt"));
    ASSERT_TRUE(way) << way.error().message;
    EXPECT_EQ(way->size(), one["frames"].get<std::size_t>());
    EXPECT_FALSE(one["why_not"].get<std::string>().empty());

    const std::string map = "export '" + path(folder).string() + "' -o ";
    EXPECT_EQ(run(map + "apart.las").code, 0);
    ASSERT_EQ(run(map + "apart.txt --what trajectory").code, 0);
    const auto path_apart = dataset::read_trajectory(path("apart.txt"));
    ASSERT_TRUE(path_apart) << path_apart.error().message;
    EXPECT_EQ(path_apart->size(), way->size());
    const Outcome grid = run(map + "apart.yaml");
    EXPECT_EQ(grid.code, 3) << grid;
    EXPECT_TRUE(grid.told("did not join the map of its run")) << grid;
    EXPECT_FALSE(fs::exists(path("apart.yaml")));
  }
  EXPECT_EQ(apart, 1U);

  // The poses of both make up all that were tracked, and the store holds both.
  const auto main_way = dataset::read_trajectory(path("out/trajectory.txt"));
  ASSERT_TRUE(main_way);
  EXPECT_LT(main_way->size(), told["frames"]["tracked"].get<std::size_t>());
  const Outcome exported =
      run("export '" + out + "' --what trajectory -o '" + path("again.txt").string() + "'");
  ASSERT_EQ(exported.code, 0) << exported;
  const auto again = dataset::read_trajectory(path("again.txt"));
  ASSERT_TRUE(again);
  ASSERT_EQ(again->size(), main_way->size());
  for (std::size_t i = 0; i < again->size(); ++i) {
    const auto off = (*again)[i].world_from_camera.translation - (*main_way)[i].world_from_camera.translation;
    EXPECT_LT(off.norm(), 1e-6) << i;
  }

  // Fused with a larger map that it shares no place with, the robot is named, and both its maps are kept.
  const std::string other = path("other").string(), both = path("both").string();
  ASSERT_EQ(run("map 'synth:office?frames=200&fps=6&width=320&height=240' -o '" + other + "'" + kLean).code,
            0);
  const Outcome fused = run("fuse '" + other + "' '" + out + "' -o '" + both + "'" + kLean);
  ASSERT_EQ(fused.code, 4) << fused;
  EXPECT_TRUE(fused.told("components/: out, out-2")) << fused;
  EXPECT_EQ(summary("both")["frames"]["read"], 540);
  EXPECT_EQ(summary("both")["components"]["list"].size(), 2U);
  ASSERT_EQ(run("export '" + both + "' --what trajectory -o '" + path("way.txt").string() + "'").code, 0);
  const auto way = dataset::read_trajectory(path("way.txt"));
  ASSERT_TRUE(way) << way.error().message;
  EXPECT_EQ(way->size(), summary("other")["frames"]["tracked"].get<std::size_t>());
}

// The same bytes with one thread as with two.
TEST_F(Components, OneThreadGivesTheSameMap) {
  const std::string input = "map 'synth:room?frames=330&seed=12&events=spin@6+1*1.5'" + kLean;
  ASSERT_EQ(run(input + " --threads 1 -o '" + path("one").string() + "'").code, 0);
  ASSERT_EQ(run(input + " --threads 2 -o '" + path("two").string() + "'").code, 0);
  EXPECT_EQ(slurp(path("one/trajectory.txt")), slurp(path("two/trajectory.txt")));
  EXPECT_EQ(slurp(path("one/map.ply")), slurp(path("two/map.ply")));
}

}  // namespace
}  // namespace plumbline::integration
