// SPDX-License-Identifier: BSD-3-Clause
// Another visit of a finished map: plumbline map --into.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "plumbline/dataset/trajectory_io.hpp"
#include "program.hpp"

namespace plumbline::integration {
namespace {

const char* const kLean =
    " -q --set output.views= --set output.pcd=off --set fuse.voxel=3cm --set merge.min_pairs=3";

class VisitCommand : public ProgramTest {
 protected:
  /// A room's first 3.5 of 6 seconds, mapped.
  void map_first_day() const {
    const Outcome filmed = run("synth room -o world --frames 60 --fps 10 --width 320 --height 240 -q");
    ASSERT_EQ(filmed.code, 0) << filmed;
    const Outcome mapped = run("map world/robot0 -o first --to 3.5" + std::string(kLean));
    ASSERT_EQ(mapped.code, 0) << mapped;
  }

  /// Bytes and times of everything in a folder.
  [[nodiscard]] std::map<std::string, std::pair<std::string, fs::file_time_type>> state_of(
      const std::string& folder) const {
    std::map<std::string, std::pair<std::string, fs::file_time_type>> state;
    for (const auto& entry : fs::recursive_directory_iterator(path(folder))) {
      state[entry.path().string()] = {entry.is_regular_file() ? slurp(entry.path()) : "",
                                      fs::last_write_time(entry.path())};
    }
    return state;
  }

  /// Largest distance between poses of equal stamps of two paths, metres; none: infinite.
  [[nodiscard]] double farthest_apart_m(const std::string& a, const std::string& b) const {
    const auto first = dataset::read_trajectory(path(a));
    const auto second = dataset::read_trajectory(path(b));
    if (!first || !second) return 1e9;
    double farthest = 1e9;
    for (const auto& x : *first) {
      for (const auto& y : *second) {
        if (std::abs(x.stamp - y.stamp) > 1e-4) continue;
        const double apart = (x.world_from_camera.translation - y.world_from_camera.translation).norm();
        farthest = farthest > 1e8 ? apart : std::max(farthest, apart);
      }
    }
    return farthest;
  }
};

TEST_F(VisitCommand, BothVisitsAreInTheFrameOfTheFirstWhichStaysAsItIs) {
  map_first_day();
  const auto before = state_of("first");
  const Outcome o =
      run("map world/robot0 -o second --from 1.5 --into first --threads 1" + std::string(kLean));
  const Outcome again =
      run("map world/robot0 -o again --from 1.5 --into first/map.db --threads 2" + std::string(kLean));
  ASSERT_EQ(o.code, 0) << o;
  ASSERT_EQ(again.code, 0) << again;
  EXPECT_EQ(state_of("first"), before);
  EXPECT_FALSE(fs::exists(path("second.visit")));
  for (const char* file : {"map.ply", "robots/robot0/trajectory.txt", "robots/robot0-2/trajectory.txt"})
    EXPECT_EQ(slurp(path("second") / file), slurp(path("again") / file)) << file;

  // The first visit stays where it was; frames of both lie where the first has them.
  EXPECT_LT(farthest_apart_m("first/trajectory.txt", "second/robots/robot0/trajectory.txt"), 0.002);
  EXPECT_LT(farthest_apart_m("first/trajectory.txt", "second/robots/robot0-2/trajectory.txt"), 0.02);
  const auto summary = read_json(path("second/summary.json"));
  EXPECT_TRUE(summary["trustworthy"]);
  EXPECT_EQ(summary["frame"]["output_from_map"],
            read_json(path("first/summary.json"))["frame"]["output_from_map"]);
  const auto& visit = summary["visit"];
  EXPECT_TRUE(visit["joined"]);
  EXPECT_TRUE(visit["held"]);
  EXPECT_LT(visit["kept"], visit["keyframes"]);

  // A third visit that shows nothing new costs next to nothing.
  const Outcome third = run("map world/robot0 -o third --from 1.5 --into second" + std::string(kLean));
  ASSERT_EQ(third.code, 0) << third;
  EXPECT_LE(read_json(path("third/summary.json"))["visit"]["kept"], 3);
  EXPECT_LT(static_cast<double>(fs::file_size(path("third/map.db"))),
            1.15 * static_cast<double>(fs::file_size(path("second/map.db"))));
}

TEST_F(VisitCommand, AForeignRecordingStaysApart) {
  map_first_day();
  const Outcome o = run("map 'synth:office?frames=30&fps=10&width=320&height=240' -o second --into first" +
                        std::string(kLean));
  EXPECT_EQ(o.code, 4) << o;
  const auto summary = read_json(path("second/summary.json"));
  EXPECT_FALSE(summary["visit"]["joined"]);
  EXPECT_FALSE(summary["trustworthy"]);
  EXPECT_TRUE(fs::exists(path("second/components")));
  EXPECT_LT(farthest_apart_m("first/trajectory.txt", "second/robots/robot0/trajectory.txt"), 0.002);
}

TEST_F(VisitCommand, WhatDoesNotFitIsRefused) {
  EXPECT_EQ(run("map 'synth:room?frames=5' -o out --into nowhere").code, 3);
  map_first_day();
  const Outcome itself = run("map world/robot0 -o first --into first --force");
  EXPECT_EQ(itself.code, 2) << itself;
  EXPECT_TRUE(itself.told("stays as it is")) << itself;
  const Outcome poses = run("map world/robot0 -o out --into first --poses given");
  EXPECT_EQ(poses.code, 2) << poses;

  // An interrupted visit is continued with the map that it was begun with, and no other.
  ASSERT_EQ(run("map world/robot0 -o out.visit --from 1.5 --set store.images=off" + std::string(kLean)).code,
            0);
  const Outcome other = run("map world/robot0 -o out --from 1.5 --into first --resume" + std::string(kLean));
  EXPECT_EQ(other.code, 2) << other;
  EXPECT_TRUE(other.told("another map")) << other;
}

}  // namespace
}  // namespace plumbline::integration
