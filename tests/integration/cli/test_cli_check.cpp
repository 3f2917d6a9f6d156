// SPDX-License-Identifier: BSD-3-Clause
// A path is judged against its recording: plumbline check, and the same at the end of map.
#include <functional>

#include "plumbline/dataset/trajectory_io.hpp"
#include "program.hpp"

namespace plumbline::integration {
namespace {

class Checks : public ProgramTest {
 protected:
  void film() const {
    ASSERT_EQ(
        run("synth room -o world --frames 90 --fps 15 --width 320 --height 240 --reference-spacing 20cm "
            "--seed 3 -q")
            .code,
        0);
  }
  /// The true path, changed.
  void write_path(const std::string& name,
                  const std::function<void(std::size_t, geometry::StampedPose&)>& change) const {
    auto path = dataset::read_trajectory(this->path("world/robot0/groundtruth.txt"));
    ASSERT_TRUE(path) << path.error().message;
    for (std::size_t i = 0; i < path->size(); ++i) change(i, (*path)[i]);
    ASSERT_TRUE(dataset::write_trajectory(this->path(name), *path));
  }
};

TEST_F(Checks, PathsOfOtherPrograms) {
  film();
  write_path("right.txt", [](std::size_t, geometry::StampedPose&) {});
  const Outcome right = run("check right.txt world/robot0 --json right.json --threads 2");
  ASSERT_EQ(right.code, 0) << right;
  EXPECT_EQ(right.out.rfind("Shape ± ", 0), 0U) << right;
  const auto numbers = read_json(path("right.json"));
  EXPECT_LT(numbers["expected_m"], 0.006) << right;
  EXPECT_GT(numbers["pairs"], 20) << right;
  ASSERT_EQ(run("check right.txt world/robot0 --json one.json -q --threads 1").code, 0);
  EXPECT_EQ(slurp(path("one.json")), slurp(path("right.json")));

  // A jump of 12 cm in the middle, at 3 s.
  write_path("torn.txt", [](std::size_t i, geometry::StampedPose& pose) {
    if (i >= 45) pose.world_from_camera.translation.x() += 0.12;
  });
  const Outcome torn = run("check torn.txt world/robot0 --json torn.json");
  EXPECT_EQ(torn.code, 4) << torn;
  EXPECT_EQ(torn.out.rfind("Not trustworthy: ", 0), 0U) << torn;
  EXPECT_GT(read_json(path("torn.json"))["expected_m"], 0.02) << torn;

  // Stamps half a frame off are no poses of the frames, unless one says so.
  write_path("off.txt", [](std::size_t, geometry::StampedPose& pose) { pose.stamp += 0.02; });
  const Outcome off = run("check off.txt world/robot0");
  EXPECT_EQ(off.code, 3) << off;
  EXPECT_TRUE(off.told("--max-dt")) << off;
  EXPECT_EQ(run("check off.txt world/robot0 --max-dt 0.03 -q").code % 4, 0);
  EXPECT_EQ(run("check right.txt ros2://0").code, 2);
}

TEST_F(Checks, EndOfMap) {
  film();
  const Outcome mapped = run("map world/robot0 -o out --set output.views=");
  ASSERT_EQ(mapped.code, 0) << mapped;
  EXPECT_EQ(mapped.out.rfind("Shape ± ", 0), 0U) << mapped;
  const auto summary = read_json(path("out/summary.json"));
  const auto& in_map = summary["check"];
  EXPECT_TRUE(in_map["trusted"]) << in_map;
  EXPECT_LT(in_map["expected_m"], 0.008) << in_map;

  // One sentence first, everywhere; what is told follows from the verdict.
  const auto& verdict = summary["verdict"];
  EXPECT_EQ(mapped.out.rfind(verdict["sentence"].get<std::string>(), 0), 0U) << mapped;
  EXPECT_EQ(run("info out").out.rfind(verdict["sentence"].get<std::string>(), 0), 0U);
  EXPECT_EQ(verdict["accuracy"]["expected_m"], in_map["expected_m"]);
  EXPECT_TRUE(verdict["accuracy"]["trusted"] && verdict["accuracy"]["reasons"].empty()) << verdict;
  EXPECT_EQ(verdict["coverage"]["tracked"], 1.0) << verdict;
  EXPECT_EQ(verdict["coverage"]["components"], 1) << verdict;
  EXPECT_EQ(in_map["along"].size(), in_map["anchors"].get<std::size_t>());

  // The command sees the same, from the recording.
  ASSERT_EQ(run("check out world/robot0 --json again.json -q").code, 0);
  const auto again = read_json(path("again.json"));
  EXPECT_EQ(again["anchors"], in_map["anchors"]);
  EXPECT_NEAR(again["expected_m"], in_map["expected_m"], 0.3 * in_map["expected_m"].get<double>() + 5e-4);

  // Poses that come along are checked, too: a path that turns the other way.
  write_path("mirrored.txt", [](std::size_t, geometry::StampedPose& pose) {
    pose.world_from_camera = pose.world_from_camera.inverse();
  });
  const Outcome given =
      run("map world/robot0 -o given -p known_poses --set poses.file=mirrored.txt --set output.views=");
  EXPECT_EQ(given.code, 4) << given;
  EXPECT_EQ(given.out.rfind("Not trustworthy: ", 0), 0U) << given;
  EXPECT_FALSE(read_json(path("given/summary.json"))["verdict"]["accuracy"]["trusted"]);
  const Outcome off = run("map world/robot0 -o off -p fast --set output.views= --set check.enabled=off");
  EXPECT_EQ(off.code, 0) << off;
  const auto without = read_json(path("off/summary.json"));
  EXPECT_FALSE(without.contains("check"));
  EXPECT_TRUE(without["verdict"]["accuracy"]["expected_m"].is_null());

  // Of a single frame nothing can be said.
  const Outcome one = run("map world/robot0 -o one --to 0.01 --set output.views=");
  EXPECT_EQ(one.code, 0) << one;
  EXPECT_EQ(one.out.rfind("No reason to doubt", 0), 0U) << one;
}

TEST_F(Checks, FramesThatShowNothingAreNotLost) {
  ASSERT_EQ(run("synth room -o dark --frames 90 --fps 15 --width 320 --height 240 --reference-spacing 20cm "
                "--seed 3 --events cover@4.4+1.6 -q")
                .code,
            0);
  const Outcome mapped = run("map dark/robot0 -o out --set output.views=");
  const auto summary = read_json(path("out/summary.json"));
  const auto& coverage = summary["verdict"]["coverage"];
  EXPECT_EQ(mapped.code, 0) << mapped;
  EXPECT_GT(summary["frames"]["lost"], 9) << "a quarter of the frames is dark";
  EXPECT_GT(summary["frames"]["lost_by"]["shows nothing"], 9) << summary["frames"];
  EXPECT_NE(slurp(path("out/frames.csv")).find(",shows nothing,1\n"), std::string::npos);
  EXPECT_NEAR(coverage["blind_s"], 1.5, 0.3) << coverage;
  EXPECT_LT(coverage["lost_s"], 0.5) << coverage;
  EXPECT_GT(coverage["tracked"], 0.9) << coverage;
}

}  // namespace
}  // namespace plumbline::integration
