// SPDX-License-Identifier: BSD-3-Clause
// What comes beside the merged cloud, and what must not be in it.
#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/cloud/io/ply.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/store.hpp"
#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

class Dense : public ProgramTest {
 protected:
  [[nodiscard]] cloud::PlyData ply(const std::string& name) const {
    auto read = cloud::read_ply(path(name));
    EXPECT_TRUE(read.has_value()) << name;
    return read ? std::move(*read) : cloud::PlyData();
  }
  /// Points of a map above the floor and between the camera and the front wall of the test's cell.
  [[nodiscard]] std::size_t in_the_way(const std::string& name) const {
    const cloud::PlyData map = ply(name);
    const auto &x = *map.floats("x"), &y = *map.floats("y"), &z = *map.floats("z");
    std::size_t count = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      count += std::abs(x[i]) < 1.2F && y[i] > 1.0F && y[i] < 1.85F && z[i] > 0.1F && z[i] < 1.8F ? 1U : 0U;
    }
    return count;
  }
};

TEST_F(Dense, KeyframeCloudsLevelsAndTurntable) {
  write_wall(path("wall"));
  const Outcome mapped =
      run("map wall -o out -q --set fuse.keyframe_clouds=on --set output.levels=2 --set fuse.voxel=1cm "
          "--set output.views= --set fuse.up=camera");
  ASSERT_EQ(mapped.code, 0) << mapped;
  const cloud::PlyData whole = ply("out/map.ply");
  const cloud::PlyData coarse = ply("out/levels/map_20mm.ply");
  const cloud::PlyData coarser = ply("out/levels/map_40mm.ply");
  EXPECT_LT(coarse.vertex_count, whole.vertex_count / 2);
  EXPECT_LT(coarser.vertex_count, coarse.vertex_count / 2);
  EXPECT_GT(coarser.vertex_count, 100U);
  EXPECT_NE(coarse.floats("confidence"), nullptr);

  const auto keyframes = dataset::read_trajectory(path("out/keyframes.txt"));
  ASSERT_TRUE(keyframes);
  std::size_t clouds = 0;
  for (const auto& entry : fs::directory_iterator(path("out/keyframes"))) {
    ++clouds;
    const cloud::PlyData one = ply("out/keyframes/" + entry.path().filename().string());
    EXPECT_GT(one.vertex_count, 1000U);
    // In the frame of the results: the wall is ahead (x) of the first camera, as in the map.
    const auto &x = *one.floats("x"), &all = *whole.floats("x");
    EXPECT_NEAR(*std::max_element(x.begin(), x.end()), *std::max_element(all.begin(), all.end()), 0.1F);
  }
  EXPECT_EQ(clouds, keyframes->size());

  const Outcome turned = run("render out -o turn --turntable 3 --size 160x120 -q");
  ASSERT_EQ(turned.code, 0) << turned;
  std::vector<std::string> pictures;
  for (const auto& entry : fs::directory_iterator(path("turn"))) pictures.push_back(entry.path().string());
  std::sort(pictures.begin(), pictures.end());
  ASSERT_EQ(pictures.size(), 3U);
  const cv::Mat first = cv::imread(pictures[0]);
  ASSERT_EQ(first.size(), cv::Size(160, 120));
  EXPECT_GT(cv::norm(first, cv::imread(pictures[1]), cv::NORM_L1), 10000.0);
}

TEST_F(Dense, KnownPosesAreTakenAtTheMomentOfTheDepthImage) {
  // The same depth images, stamped 10 ms later: the camera that took them was further on.
  write_wall(path("together"));
  WallRecording later;
  later.depth_offset_s = 0.01;
  write_wall(path("later"), later);
  const auto box_at = [&](const std::string& name) {
    const Outcome mapped =
        run("map " + name + " -o out -p known_poses -q --force --set output.views= --set fuse.up=none");
    EXPECT_EQ(mapped.code, 0) << mapped;
    const cloud::PlyData map = ply("out/map.ply");
    const auto &x = *map.floats("x"), &z = *map.floats("z");
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (std::abs(z[i] - static_cast<float>(kBox_m)) > 0.05F) continue;
      sum += static_cast<double>(x[i]);
      ++count;
    }
    EXPECT_GT(count, 500U);
    return sum / static_cast<double>(std::max<std::size_t>(1, count));
  };
  const double speed = kStep_px * kWall_m / kFocal * 30.0;  // m/s
  EXPECT_NEAR(box_at("later") - box_at("together"), speed * later.depth_offset_s, 0.002);
}

TEST_F(Dense, ACameraThatStandsStillAddsNothing) {
  const auto clouds_between_keyframes = [&](int frames) {
    WallRecording stops;
    stops.frames = frames;
    stops.moving = 12;
    const std::string name = std::to_string(frames);
    write_wall(path(name), stops);
    EXPECT_EQ(run("map " + name + " -o out" + name + " -q --set output.views= --set fuse.up=none").code, 0);
    const auto store = maps::StoreReader::open(path("out" + name + "/map.db"));
    EXPECT_TRUE(store && store->frame_cloud_ids());
    return store && store->frame_cloud_ids() ? store->frame_cloud_ids()->size() : 0;
  };
  const std::size_t soon = clouds_between_keyframes(45);
  EXPECT_GT(soon, 10U);  // every third frame
  EXPECT_LE(clouds_between_keyframes(90), soon);
}

TEST_F(Dense, WhoWalksThroughLeavesNoGhost) {
  write("cell.yaml",
        "name: cell\nobjects:\n  - floor: {from: [-2, -3], to: [2, 2.1]}\n"
        "  - wall: {from: [-2, 2.05], to: [2, 2.05], thickness: 0.1, material: poster_wall}\n"
        "  - lamp: {at: [0, 0, 2.5], power: 2}\n"
        "robots:\n  - path: [{at: [-0.2, -1, 1.2], look: [0, 9, 0]}, {at: [0.4, -1, 1.2], look: [0, 9, 0]}]\n"
        "walkers:\n  - {from: [-0.6, 1.4], to: [0.6, 1.4], speed: 0.8}\n");
  ASSERT_EQ(
      run("synth cell.yaml -o cell --walkers 1 --sensor ideal --frames 32 --fps 8 --width 320 --height 240 "
          "--reference-spacing 5cm -q")
          .code,
      0);
  const std::string map =
      "map cell/robot0 -p known_poses -q --set output.views= --set fuse.voxel=2cm "
      "--set poses.keyframe_distance=1cm -o ";
  ASSERT_EQ(run(map + "all --set fuse.free_space=off").code, 0);
  ASSERT_EQ(run(map + "out").code, 0);
  EXPECT_GT(in_the_way("all/map.ply"), 1000U);
  EXPECT_LE(in_the_way("out/map.ply"), in_the_way("all/map.ply") / 100);
  // The wall behind is whole.
  EXPECT_GT(ply("out/map.ply").vertex_count, 8000U);
}

}  // namespace
}  // namespace plumbline::integration
