// SPDX-License-Identifier: BSD-3-Clause
// A camera that is not what its file says: a run finds out, and makes its map anew.
#include <regex>
#include <string>

#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

const char* const kCheap = " --set output.views= --set output.pcd=off --set fuse.voxel=20mm";

/// A generated room on disk, made once; each test has its own copy of the file that it makes wrong.
class CameraRefinement : public ProgramTest {
 protected:
  static void SetUpTestSuite() {
    world_ = fs::path(testing::TempDir()) / ("plumbline_camera_world." + std::to_string(getpid()));
    fs::remove_all(world_);
    const std::string command = std::string(PLUMBLINE_PROGRAM) + " synth room -o " + world_.string() +
                                " --frames 90 --fps 15 --reference-spacing 10cm -q";
    ASSERT_EQ(std::system(command.c_str()), 0);
    true_fx_ = fx_of(world_ / "robot0/camera.yaml");
  }
  static void TearDownTestSuite() { fs::remove_all(world_); }
  static double fx_of(const fs::path& file) {
    const std::string text = slurp(file);
    std::smatch found;
    return std::regex_search(text, found, std::regex("\nfx: ([0-9.]+)")) ? std::stod(found[1]) : 0.0;
  }
  static std::string recording() { return (world_ / "robot0").string(); }

  /// The true camera with longer focal lengths.
  void write_camera(const std::string& name, double factor) const {
    std::string text = slurp(world_ / "robot0/camera.yaml");
    for (const std::string key : {"fx", "fy"}) {
      std::smatch found;
      ASSERT_TRUE(std::regex_search(text, found, std::regex("\n" + key + ": ([0-9.]+)")));
      const std::string number = std::to_string(factor * std::stod(found[1]));
      text = std::string(found.prefix()) + "\n" + key + ": " + number + std::string(found.suffix());
    }
    write(name, text);
  }
  [[nodiscard]] Outcome map(const std::string& more) const { return run("map " + more + kCheap); }
  [[nodiscard]] nlohmann::json cameras(const std::string& out) const {
    return read_json(path(out) / "summary.json")["camera"];
  }

  static inline fs::path world_;
  static inline double true_fx_ = 0.0;
};

TEST_F(CameraRefinement, AWrongFocalLengthIsFoundAndTheMapIsMadeAnew) {
  write_camera("long.yaml", 1.02);
  const std::string wrong = recording() + " --camera long.yaml";
  const Outcome o = map(wrong + " -o out");
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_TRUE(o.told("the camera is better with")) << o;
  EXPECT_NEAR(fx_of(path("out/camera.yaml")), true_fx_, 0.005 * true_fx_);
  bool used = false;
  const nlohmann::json told = cameras("out");
  for (const auto& n : told[0]["numbers"]) used = used || (n["name"] == "fx" && n["used"]);
  EXPECT_TRUE(used) << told;
  EXPECT_EQ(told[0]["asked"], 2) << told;

  // The map is as exact as one that was made with the true camera from the start, or nearly.
  const auto error_of = [&](const std::string& out) {
    const Outcome e = run("evaluate trajectory " + out + " " + recording() + " --json");
    return nlohmann::json::parse(e.out)["ate_m"]["rmse"].get<double>();
  };
  ASSERT_EQ(map(recording() + " -q -o right --set track.camera.refine=off").code, 0);
  ASSERT_EQ(map(wrong + " -q -o wrong --set track.camera.refine=off").code, 0);
  EXPECT_LT(error_of("out"), 2.0 * error_of("right") + 0.001);
  EXPECT_LT(error_of("out"), 0.5 * error_of("wrong"));

  // The same bytes for any number of threads, and from the store as from the run.
  for (const char* threads : {"1", "3"}) {
    const std::string again = std::string("again") + threads;
    ASSERT_EQ(map(wrong + " -q -o " + again + " --threads " + threads).code, 0);
    for (const char* file : {"camera.yaml", "trajectory.txt", "map.ply"})
      EXPECT_EQ(slurp(path(again) / file), slurp(path("out") / file)) << file;
  }
  ASSERT_EQ(run("export out/map.db -o stored.ply").code, 0);
  EXPECT_EQ(without_frame(slurp(path("stored.ply"))), slurp(path("out/map.ply")));
}

TEST_F(CameraRefinement, DepthThatCameLaterThanItsStampsSayIsFound) {
  const std::string room =
      "synth room -o late --frames 150 --fps 15 --depth-delay 20ms --reference-spacing 10cm -q";
  ASSERT_EQ(run(room).code, 0);
  const std::regex delay("\ndepth_delay: ([0-9.]+)[^\n]*");
  write("silent.yaml", std::regex_replace(slurp(path("late/robot0/camera.yaml")), delay, ""));
  const Outcome o = map("late/robot0 --camera silent.yaml -o out");
  ASSERT_EQ(o.code, 0) << o;
  std::smatch found;
  const std::string camera = slurp(path("out/camera.yaml"));
  ASSERT_TRUE(std::regex_search(camera, found, delay)) << camera;
  EXPECT_NEAR(std::stod(found[1]), 0.02, 0.005);
}

TEST_F(CameraRefinement, ARightCameraIsLeftAlone) {
  const Outcome o = map(recording() + " -o out");
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_FALSE(o.told("the camera is better")) << o;
  ASSERT_EQ(map(recording() + " -o off --set track.camera.refine=off").code, 0);
  for (const char* file : {"map.ply", "trajectory.txt", "frames.csv"})
    EXPECT_EQ(slurp(path("out") / file), slurp(path("off") / file)) << file;
  const std::string used = slurp(path("off/camera.yaml"));
  const std::string camera = used.substr(used.find("\nname: "));  // what the map said of it stands before
  EXPECT_NE(slurp(path("out/camera.yaml")).find(camera), std::string::npos);
  EXPECT_EQ(cameras("out").size(), 1U);
  EXPECT_TRUE(cameras("off").empty());
}

TEST_F(CameraRefinement, WhileItMapsARunGoesOnWithWhatItFound) {
  ASSERT_EQ(run("synth room -o world --frames 230 --fps 5 --seed 3 --reference-spacing 10cm -q").code, 0);
  std::string text = slurp(path("world/robot0/camera.yaml"));
  for (const char* key : {"fx", "fy"})
    text = std::regex_replace(text, std::regex("\n" + std::string(key)), "\n#");
  const double fx = 1.02 * fx_of(path("world/robot0/camera.yaml"));
  write("long.yaml", text + "fx: " + std::to_string(fx) + "\nfy: " + std::to_string(fx) + "\n");
  const std::string command = "world/robot0 --camera long.yaml ";
  const Outcome o = map(command + "-o out --threads 1");
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_EQ(cameras("out")[0]["from_frame"], 147);
  EXPECT_NEAR(fx_of(path("out/camera.yaml")), fx / 1.02, 0.005 * fx);

  // Up to there it is the run of the camera that was given, and from there on it is not.
  ASSERT_EQ(map(command + "--set track.camera.refine=off -o off").code, 0);
  const std::string with = slurp(path("out/frames.csv"));
  const std::string without = slurp(path("off/frames.csv"));
  const auto differ = std::mismatch(with.begin(), with.end(), without.begin(), without.end()).first;
  EXPECT_EQ(std::count(with.begin(), differ, '\n'), 148);

  // The same for any number of threads, and from the store as from the run.
  ASSERT_EQ(map(command + "-q -o again --threads 3").code, 0);
  EXPECT_EQ(slurp(path("again/map.ply")), slurp(path("out/map.ply")));
  EXPECT_EQ(slurp(path("again/trajectory.txt")), slurp(path("out/trajectory.txt")));
  ASSERT_EQ(run("export out/map.db -o stored.ply").code, 0);
  EXPECT_EQ(without_frame(slurp(path("stored.ply"))), slurp(path("out/map.ply")));
}

TEST_F(CameraRefinement, WithoutAFileTheCameraIsAGuessThatTheRecordingConfirms) {
  fs::copy(recording(), path("bare"), fs::copy_options::recursive);
  fs::remove(path("bare/camera.yaml"));
  const Outcome o = map("bare -o out");
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_TRUE(o.told("no camera.yaml; its images have the size of a Kinect")) << o;
  EXPECT_NEAR(fx_of(path("out/camera.yaml")), true_fx_, 0.01 * true_fx_);
  const Outcome off = map("bare -o off --set track.camera.refine=off");
  EXPECT_EQ(off.code, 4) << off;
  EXPECT_TRUE(off.told("the camera is a guess")) << off;
  const Outcome few = map("bare -o few --to 0.5");
  EXPECT_EQ(few.code, 4) << few;
  EXPECT_TRUE(few.told("the recording cannot confirm")) << few;
}

TEST_F(CameraRefinement, EachRobotHasItsOwn) {
  fs::copy(recording(), path("long"), fs::copy_options::recursive);
  fs::copy(recording(), path("right"), fs::copy_options::recursive);
  write_camera("long/camera.yaml", 1.02);
  const Outcome o = map("long right -o out");
  ASSERT_TRUE(o.code == 0 || o.code == 4) << o;
  EXPECT_NEAR(fx_of(path("out/robots/long/camera.yaml")), true_fx_, 0.005 * true_fx_);
  EXPECT_EQ(fx_of(path("out/robots/right/camera.yaml")), true_fx_);
  EXPECT_EQ(cameras("out")[0]["robot"], "long");
}

}  // namespace
}  // namespace plumbline::integration
