// SPDX-License-Identifier: BSD-3-Clause
// Where a camera is in a finished map: plumbline localize.
#include <cmath>
#include <map>
#include <sstream>
#include <string>

#include "plumbline/dataset/trajectory_io.hpp"
#include "program.hpp"

namespace plumbline::integration {
namespace {

class Localize : public ProgramTest {
 protected:
  /// A room's first 3.5 of 6 seconds, mapped.
  void map_first_part() const {
    const Outcome filmed = run("synth room -o world --frames 60 --fps 10 --width 320 --height 240 -q");
    ASSERT_EQ(filmed.code, 0) << filmed;
    const Outcome mapped =
        run("map world/robot0 -o a --to 3.5 -q --set output.views= --set output.pcd=off --set "
            "cloud.filters=[] --set "
            "fuse.voxel=3cm");
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
};

TEST_F(Localize, PosesAreInTheFrameOfTheMapWhichStaysAsItIs) {
  map_first_part();
  const auto before = state_of("a");
  fs::permissions(path("a"), fs::perms::owner_read | fs::perms::owner_exec);
  const Outcome o = run("localize a world/robot0 -o here --from 1.5 --threads 1");
  const Outcome again = run("localize a/map.db world/robot0 -o again --from 1.5 --threads 2 -q");
  fs::permissions(path("a"), fs::perms::owner_all);
  ASSERT_EQ(o.code, 0) << o;
  ASSERT_EQ(again.code, 0) << again;
  EXPECT_EQ(state_of("a"), before);

  // The same bytes for any number of threads, and for the folder and its map.db.
  for (const char* file : {"trajectory.txt", "frames.csv"})
    EXPECT_EQ(slurp(path("here") / file), slurp(path("again") / file)) << file;

  // Frames that were mapped lie where the map has them.
  const auto mapped = dataset::read_trajectory(path("a/trajectory.txt"));
  const auto located = dataset::read_trajectory(path("here/trajectory.txt"));
  ASSERT_TRUE(mapped && located);
  EXPECT_GE(located->size(), 40U);
  int common = 0;
  for (const auto& x : *mapped) {
    for (const auto& y : *located) {
      if (std::abs(x.stamp - y.stamp) > 1e-4) continue;
      ++common;
      EXPECT_LT((x.world_from_camera.translation - y.world_from_camera.translation).norm(), 0.02);
    }
  }
  EXPECT_GE(common, 15);

  const auto summary = read_json(path("here/summary.json"));
  EXPECT_EQ(summary["localized"]["located"], located->size());
  EXPECT_EQ(summary["localized"]["first_frame"], 0);
  EXPECT_TRUE(summary["trustworthy"]);
  std::istringstream frames(slurp(path("here/frames.csv")));
  std::string line;
  std::getline(frames, line);
  EXPECT_EQ(line.rfind("frame,state,stamp,how,sigma_position,", 0), 0U) << line;
}

TEST_F(Localize, AForeignRecordingIsNotLocated) {
  map_first_part();
  const Outcome o = run("localize a 'synth:office?frames=12&fps=10&width=320&height=240' -o there");
  EXPECT_EQ(o.code, 4) << o;
  EXPECT_TRUE(o.told("0 of 12 frames")) << o;
  EXPECT_EQ(read_json(path("there/summary.json"))["localized"]["located"], 0);
  EXPECT_NE(slurp(path("there/frames.csv")).find("lost"), std::string::npos);
}

TEST_F(Localize, WhatIsNoMapIsRefused) {
  EXPECT_EQ(run("localize nowhere 'synth:room?frames=5' -o out").code, 3);
  fs::create_directory(path("empty"));
  EXPECT_EQ(run("localize empty 'synth:room?frames=5' -o out").code, 3);
  EXPECT_EQ(run("map 'synth:room?frames=5' -p localize -o out").code, 2);
  write("a.db", "not a map");
  EXPECT_EQ(run("localize a.db 'synth:room?frames=5' -o out").code, 3);
  EXPECT_EQ(run("localize empty 'synth:room?frames=5' -o out -p rgbd").code, 2);
  EXPECT_FALSE(fs::exists(path("out")));
}

}  // namespace
}  // namespace plumbline::integration
