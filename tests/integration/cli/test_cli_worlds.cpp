// SPDX-License-Identifier: BSD-3-Clause
// Worlds with known truth and what is measured against them: synth, map synth:..., evaluate.
#include <algorithm>
#include <iterator>

#include "plumbline/cloud/io/ply.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

const char* const kAscii =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "end_header\n";

class Worlds : public ProgramTest {
 protected:
  /// One line that holds all of `told`, and nothing written.
  void expect_refused(const std::string& arguments, int code, const std::vector<std::string>& told) const {
    const Outcome o = run(arguments);
    EXPECT_EQ(o.code, code) << arguments << "\n" << o;
    EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o;
    for (const std::string& text : told) EXPECT_TRUE(o.told(text)) << text << "\nnot in\n" << o;
    EXPECT_FALSE(fs::exists(path("x"))) << arguments;
  }
  void write_scene(const std::string& name, const std::string& wall, const std::string& way) const {
    write(name, "name: cell\nobjects:\n  - floor: {from: [0, 0], to: [4, 3]}\n  - wall: {" + wall +
                    "}\nrobots:\n  - path: " + way + "\n");
  }
};

TEST_F(Worlds, FloorOfTheInstrument) {
  // True poses and exact depth through the shipped cloud stages: what is left is the instrument's own.
  ASSERT_EQ(run("synth room -o room --sensor ideal --frames 30 --fps 5 --width 320 --height 240 "
                "--reference-spacing 1cm -q")
                .code,
            0);
  const Outcome mapped =
      run("map room/robot0 -o out -p known_poses -q --set output.views= --set fuse.voxel=5mm "
          "--set fuse.filters= "
          "--set cloud.stride=1 --set poses.keyframe_distance=5cm --set poses.keyframe_angle=0.1");
  ASSERT_EQ(mapped.code, 0) << mapped;
  const Outcome measured = run("evaluate cloud out room --json -o errors");
  ASSERT_EQ(measured.code, 0) << measured;
  const auto report = nlohmann::json::parse(measured.out);
  EXPECT_LT(report["accuracy_mm"]["mean"], 0.1) << measured;
  EXPECT_GT(report["at"]["20mm"]["recall"], 0.985) << measured;
  for (const char* name : {"accuracy", "completeness"}) {
    const auto ply = cloud::read_ply(path(std::string("errors/") + name + ".ply"));
    ASSERT_TRUE(ply.has_value()) << ply.error().message;
    ASSERT_NE(ply->floats("error"), nullptr);
    ASSERT_NE(ply->bytes("red"), nullptr);
    EXPECT_FALSE(cv::imread(path(std::string("errors/") + name + ".png").string()).empty());
  }
  const auto accuracy = cloud::read_ply(path("errors/accuracy.ply"));
  double sum = 0.0;
  for (const float e : *accuracy->floats("error")) sum += 1000.0 * static_cast<double>(e);
  EXPECT_NEAR(sum / static_cast<double>(accuracy->vertex_count), report["accuracy_mm"]["mean"], 1e-6);
}

TEST_F(Worlds, SeveralEstimatesSideBySide) {
  std::string truth;
  std::string near;
  std::string far;
  for (int i = 0; i < 40; ++i) {
    const double x = 0.1 * i;
    const double y = i % 7 * 0.05;
    truth += std::to_string(i / 10.0) + " " + std::to_string(x) + " " + std::to_string(y) + " 0 0 0 0 1\n";
    near += std::to_string(i / 10.0) + " " + std::to_string(x) + " " + std::to_string(y) + " " +
            (i % 2 == 0 ? "0.001" : "-0.001") + " 0 0 0 1\n";
    far += std::to_string(i / 10.0) + " " + std::to_string(x) + " " + std::to_string(y) + " " +
           (i % 2 == 0 ? "0.01" : "-0.01") + " 0 0 0 1\n";
  }
  write("gt.txt", truth);
  write("near.txt", near);
  write("far.txt", far);
  const Outcome o = run("evaluate trajectory near.txt far.txt gt.txt --align none --json --plot charts");
  ASSERT_EQ(o.code, 0) << o;
  const auto report = nlohmann::json::parse(o.out);
  ASSERT_EQ(report["estimates"].size(), 2U);
  EXPECT_EQ(report["estimates"][0]["name"], "near");
  EXPECT_NEAR(report["estimates"][0]["ate_m"]["rmse"], 0.001, 1e-9);
  EXPECT_NEAR(report["estimates"][1]["ate_m"]["rmse"], 0.01, 1e-9);
  for (const char* chart : {"path", "error", "poses", "error_distribution"}) {
    EXPECT_NE(slurp(path(std::string("charts/") + chart + ".svg")).find("<svg"), std::string::npos) << chart;
  }
  const Outcome text = run("evaluate trajectory near.txt far.txt gt.txt --align none");
  EXPECT_NE(text.out.find("\nnear "), std::string::npos) << text;
  EXPECT_NE(text.out.find("\nfar "), std::string::npos) << text;
}

TEST_F(Worlds, MapsWhatIsRenderedOnTheWay) {
  const std::string url = "'synth:room?frames=4&texture=none&seed=3&width=160&height=120'";
  const Outcome o = run("map " + url + " -o a -p known_poses -q --set output.views=");
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_EQ(read_json(path("a/summary.json"))["frames"]["read"], 4);
  ASSERT_EQ(run("map " + url + " -o b -p known_poses -q --set output.views= --threads 1").code, 0);
  EXPECT_EQ(slurp(path("a/map.ply")), slurp(path("b/map.ply")));
}

TEST_F(Worlds, RecordingOfTwoRobotsIsWhole) {
  const Outcome o =
      run("synth room -o world --robots 2 --frames 3 --width 160 --height 120 --reference-spacing 10cm -q");
  ASSERT_EQ(o.code, 0) << o;
  for (const std::string robot : {"world/robot0/", "world/robot1/"}) {
    for (const char* file : {"rgb.txt", "depth.txt", "associations.txt", "groundtruth.txt", "camera.yaml"}) {
      EXPECT_TRUE(fs::exists(path(robot + file))) << robot << file;
    }
    for (const char* folder : {"rgb", "depth"}) {
      const auto files = fs::directory_iterator(path(robot + folder));
      EXPECT_EQ(std::distance(begin(files), end(files)), 3) << robot << folder;
    }
    EXPECT_EQ(run("info " + robot).code, 0);
  }
  const auto scene = read_json(path("world/scene.json"));
  EXPECT_EQ(scene["robots"].size(), 2U);
  EXPECT_TRUE(scene["robots"][1]["start"].contains("position_m"));
  EXPECT_TRUE(scene["options"].contains("seed"));
  const auto reference = cloud::read_ply(path("world/reference.ply"));
  ASSERT_TRUE(reference.has_value()) << reference.error().message;
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) EXPECT_NE(reference->floats(name), nullptr);
  for (const char* name : {"red", "green", "blue", "visible"}) EXPECT_NE(reference->bytes(name), nullptr);
}

TEST_F(Worlds, WrongScenesAreRefused) {
  expect_refused("synth offcie -o x", 2, {"'offcie'", "did you mean office?"});
  expect_refused("synth none.yaml -o x", 2,
                 {"scene 'none.yaml': neither a file nor one of", "allowed: corridor"});
  expect_refused("map 'synth:rom?frames=5' -o x", 2, {"'rom'", "did you mean room?"});
  expect_refused("map 'synth:room?frmes=5' -o x", 2, {"frmes", "did you mean frames?"});
  write_scene("key.yaml", "from: [0, 3], to: [4, 3], hieght: 2.6", "[[1, 1], [3, 1]]");
  expect_refused("synth key.yaml -o x", 2, {"key.yaml:4:", "hieght", "did you mean height?"});
  write_scene("point.yaml", "from: [0, 3], to: [0, 3], height: 2.6", "[[1, 1], [3, 1]]");
  expect_refused("synth point.yaml -o x", 2, {"point.yaml:4:", "degenerate wall"});
  write_scene("through.yaml", "name: north, from: [0, 1.5], to: [4, 1.5], height: 2.6", "[[1, 1], [1, 2.5]]");
  expect_refused("synth through.yaml -o x", 2, {"through.yaml:6", "goes through north", "move a waypoint"});
  expect_refused("synth room -o x --frames 0", 2, {"frames", "zero frames"});
  expect_refused("map 'synth:room?frames=0' -o x", 2, {"frames", "zero frames"});
  expect_refused("map 'synth:room?frames=5' -o x --camera tum_fr1", 2, {"its own camera", "plumbline synth"});
}

TEST_F(Worlds, CloudsThatCannotBeMeasured) {
  write("ok.ply", std::string(kAscii) + "0 0 0\n1 0 1\n1 1 1\n");
  write("hole.ply", std::string(kAscii) + "0 0 0\n1 nan 1\n1 1 1\n");
  write("holes.ply", std::string(kAscii) + "0 nan 0\n1 nan 1\n1 nan 1\n");
  write("empty.ply",
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
        "end_header\n");
  expect_refused("evaluate cloud ok.ply empty.ply", 3, {"empty.ply", "no points"});
  expect_refused("evaluate cloud empty.ply ok.ply", 3, {"empty.ply", "no points"});
  expect_refused("evaluate cloud ok.ply hole.ply", 3, {"hole.ply", "1 of 3 points", "remove them"});
  expect_refused("evaluate cloud holes.ply ok.ply", 3, {"holes.ply", "finite"});
  expect_refused("evaluate cloud ok.ply -o x", 2, {"-o", "REFERENCE"});
  const Outcome left_out = run("evaluate cloud hole.ply ok.ply --json");
  ASSERT_EQ(left_out.code, 0) << left_out;
  EXPECT_EQ(nlohmann::json::parse(left_out.out)["points_not_finite"], 1);
  EXPECT_TRUE(left_out.told("1 of 3 points")) << left_out;
}

TEST_F(Worlds, PathsThatCannotBeMeasured) {
  write("a.txt", "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n3 2 1 0 0 0 0 1\n");
  write("b.txt", "101 0 0 0 0 0 0 1\n102 1 0 0 0 0 0 1\n103 2 1 0 0 0 0 1\n");
  write("short.txt", "1 0 0 0\n");
  expect_refused("evaluate trajectory a.txt b.txt", 3, {"a.txt", "do not overlap", "same recording?"});
  expect_refused("evaluate trajectory a.txt b.txt a.txt", 3, {"b.txt", "do not overlap"});
  expect_refused("evaluate trajectory short.txt a.txt", 3, {"short.txt:1"});
  EXPECT_EQ(run("evaluate trajectory a.txt").code, 2);
  write("file", "");
  EXPECT_EQ(run("evaluate trajectory a.txt a.txt --plot file/x").code, 5);
}

}  // namespace
}  // namespace plumbline::integration
