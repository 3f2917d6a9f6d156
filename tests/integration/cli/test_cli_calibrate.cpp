// SPDX-License-Identifier: BSD-3-Clause
// plumbline calibrate
#include <string>

#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

class Calibrate : public ProgramTest {};

// A generated camera is what its file says.
TEST_F(Calibrate, LeavesACameraThatFitsAlone) {
  const Outcome o = run("calibrate \"synth:room?frames=40&texture=full&fps=15\" -o found.yaml");
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_NE(o.out.find("fx"), std::string::npos) << o;
  EXPECT_NE(o.out.find("nothing better was found"), std::string::npos) << o;
  const std::string found = slurp(path("found.yaml"));
  EXPECT_NE(found.find("fx: 535.4\n"), std::string::npos) << found;
  EXPECT_NE(found.find("readout: 0 "), std::string::npos) << found;
  EXPECT_EQ(found.find("\ndepth_slope"), std::string::npos) << found;
}

TEST_F(Calibrate, TooLittleToTellIsSaid) {
  write_wall(path("wall"));
  const Outcome o = run("calibrate wall -o found.yaml");
  EXPECT_EQ(o.code, 3) << o;
  EXPECT_TRUE(o.told("film a place with texture")) << o;
  EXPECT_FALSE(fs::exists(path("found.yaml")));
}

TEST_F(Calibrate, OutputIsCheckedBeforeTheWork) {
  write_wall(path("wall"));
  write("cloud.ply", "mine");
  write("notes.yaml", "mine: 1\n");
  const std::string camera = slurp(path("wall/camera.yaml"));
  write("own.yaml", camera);
  for (const char* output : {"cloud.ply", "notes.yaml", "wall/camera.yaml"}) {
    const Outcome o = run(std::string("calibrate wall -o ") + output);
    EXPECT_EQ(o.code, 2) << output << o;
  }
  EXPECT_EQ(run("calibrate wall --camera own.yaml -o own.yaml").code, 2);
  EXPECT_EQ(slurp(path("notes.yaml")), "mine: 1\n");
  EXPECT_EQ(slurp(path("wall/camera.yaml")), camera);
  const Outcome nowhere = run("calibrate wall -o no/folder.yaml");
  EXPECT_EQ(nowhere.code, 5) << nowhere;
  EXPECT_TRUE(nowhere.told("make the folder first")) << nowhere;
  EXPECT_FALSE(nowhere.told("frames")) << nowhere;
  EXPECT_EQ(run("calibrate wall -o own.yaml").code, 3)
      << "a camera file may be replaced, but this is too little";
}

TEST_F(Calibrate, OneCameraAtATime) {
  write_wall(path("wall"));
  write_wall(path("other"));
  write("other/camera.yaml", slurp(path("other/camera.yaml")) + "readout: 0.02\n");
  const Outcome o = run("calibrate wall other");
  EXPECT_EQ(o.code, 2) << o;
  EXPECT_TRUE(o.told("one camera at a time")) << o;
  EXPECT_EQ(run("calibrate").code, 2);
  EXPECT_EQ(run("calibrate nothing").code, 3);
}

}  // namespace
}  // namespace plumbline::integration
