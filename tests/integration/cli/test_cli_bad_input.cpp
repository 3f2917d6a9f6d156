// SPDX-License-Identifier: BSD-3-Clause
// Broken recordings and broken configuration: one line that names place and remedy, the right exit code.
#include <sstream>

#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

const char* const kMap = "map wall -o out -p known_poses --set output.views= ";

class BadInput : public ProgramTest {
 protected:
  void truncate(const std::string& name) const { fs::resize_file(path(name), fs::file_size(path(name)) / 2); }
  void expect_refused(const Outcome& o, int code, const std::vector<std::string>& told) const {
    EXPECT_EQ(o.code, code) << o;
    for (const std::string& text : told) EXPECT_TRUE(o.told(text)) << text << "\nnot in\n" << o;
    EXPECT_FALSE(fs::exists(path("out")));
    EXPECT_FALSE(fs::exists(path("out.partial")));
  }
};

TEST_F(BadInput, FolderMissing) { expect_refused(run(kMap), 3, {"wall", "no such"}); }

TEST_F(BadInput, FolderEmpty) {
  fs::create_directory(path("wall"));
  expect_refused(run(kMap), 3, {"wall"});
}

TEST_F(BadInput, ListNamesFilesThatAreNotThere) {
  write_wall(path("wall"));
  fs::remove_all(path("wall/rgb"));
  expect_refused(run(kMap), 3, {"rgb"});
}

TEST_F(BadInput, PosesFarFromTheOriginAreRefused) {
  write_wall(path("wall"));
  write("far.txt", "1 0 0 0 0 0 0 1\n2 691000 5334000 520 0 0 0 1\n");
  expect_refused(run(std::string(kMap) + "--set poses.file=far.txt"), 3,
                 {"far.txt", "the pose at 2.000000 s lies at 691000 5334000 520 m", "subtract an offset"});
}

TEST_F(BadInput, OneTruncatedPictureIsSkipped) {
  write_wall(path("wall"));
  truncate("wall/rgb/005.png");
  const Outcome o = run(kMap);
  EXPECT_EQ(o.code, 0) << o;
  EXPECT_TRUE(o.told("005.png")) << o;
  const nlohmann::json summary = read_json(path("out/summary.json"));
  EXPECT_EQ(summary["frames"]["read"], 11);
  EXPECT_EQ(summary["frames"]["unreadable"], 1);
  EXPECT_NE(slurp(path("out/frames.csv")).find("\n5,unreadable,"), std::string::npos);
}

TEST_F(BadInput, LibrariesSayNothingOfTheirOwn) {
  write_wall(path("wall"));
  const cv::Mat picture = cv::imread(path("wall/rgb/005.png").string());
  fs::remove(path("wall/rgb/005.png"));
  cv::imwrite(path("wall/rgb/005.bmp").string(), picture);
  truncate("wall/rgb/005.bmp");
  std::string list = slurp(path("wall/rgb.txt"));
  write("wall/rgb.txt", list.replace(list.find("005.png"), 7, "005.bmp"));

  const Outcome o = run(std::string(kMap) + " -q");
  EXPECT_EQ(o.code, 0) << o;
  EXPECT_TRUE(o.told("wall/rgb/005.bmp: truncated or damaged")) << o;
  std::istringstream lines(o.err);
  for (std::string line; std::getline(lines, line);) EXPECT_EQ(line.rfind("plumbline: ", 0), 0U) << line;
}

TEST_F(BadInput, ManyBadFramesAreSummarisedAndNotTrusted) {
  WallRecording wall;
  wall.frames = 30;
  write_wall(path("wall"), wall);
  for (int f = 5; f < 25; ++f) truncate("wall/depth/" + frame_name(f));
  const Outcome o = run(kMap);
  EXPECT_EQ(o.code, 4) << o;
  EXPECT_TRUE(o.told("20 of 30 frames could not be read")) << o;
  EXPECT_TRUE(o.told("not trustworthy")) << o;
  const nlohmann::json summary = read_json(path("out/summary.json"));
  EXPECT_EQ(summary["trustworthy"], false);
  EXPECT_NE(summary["reason"].get<std::string>().find("20 unreadable"), std::string::npos) << summary;
}

TEST_F(BadInput, FilesThatGitLfsDidNotFetchAreNamed) {
  const std::string pointer =
      "version https://git-lfs.github.com/spec/v1\n"
      "oid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393\nsize 12345\n";
  const std::vector<std::string> told = {"is a Git LFS pointer, not the file itself", "git lfs pull"};
  for (const char* name :
       {"a.mcap", "a.db3", "a.bag", "a.mkv", "a.zip", "a.ply", "a.pcd", "a.xyz", "map.db"}) {
    write(name, pointer);
    expect_refused(run(std::string("info ") + name), 3, told);
  }
  for (const char* name : {"a.mcap", "a.mkv", "a.zip"})
    expect_refused(run(std::string("map ") + name + " -o out"), 3, told);

  fs::create_directory(path("bag"));
  write("bag/bag_0.mcap", pointer);
  expect_refused(run("map bag -o out"), 3, told);
  write("truth.txt", pointer);
  expect_refused(run("evaluate trajectory truth.txt truth.txt"), 3, told);

  write_wall(path("wall"));
  write("camera.yaml", pointer);
  expect_refused(run(std::string(kMap) + "--camera camera.yaml"), 2, told);
  for (int f = 0; f < 12; ++f) write("wall/rgb/" + frame_name(f), pointer);
  expect_refused(run(kMap), 3, told);
  write("wall/rgb.txt", pointer);
  expect_refused(run(kMap), 3, told);
}

TEST_F(BadInput, FramesWithoutFilesAreCountedFirst) {
  WallRecording wall;
  wall.frames = 30;
  write_wall(path("wall"), wall);
  for (int f = 5; f < 25; ++f) fs::remove(path("wall/depth/" + frame_name(f)));
  const Outcome told = run("info wall");
  EXPECT_EQ(told.code, 0) << told;
  EXPECT_TRUE(told.told("20 of 30 frames are missing and left out")) << told;
  EXPECT_NE(told.out.find("missing: 20 pairs, whose files do not exist\npairs: 10\n"), std::string::npos)
      << told;

  const Outcome o = run(kMap);
  EXPECT_EQ(o.code, 4) << o;
  EXPECT_TRUE(o.told("20 of 30 frames are missing and left out")) << o;
  const nlohmann::json summary = read_json(path("out/summary.json"));
  EXPECT_EQ(summary["frames"]["available"], 10);
  EXPECT_EQ(summary["frames"]["read"], 10);
  EXPECT_EQ(summary["frames"]["unreadable"], 0);
  EXPECT_EQ(summary["frames"]["missing"], 20);
  EXPECT_NE(summary["reason"].get<std::string>().find("20 without files"), std::string::npos) << summary;
}

TEST_F(BadInput, DamagedPicturesAreNotCopied) {
  write_wall(path("wall"));
  truncate("wall/rgb/005.png");
  for (const char* copy : {"copy", "copy.mcap"}) {
    const Outcome o = run(std::string("convert wall ") + copy);
    EXPECT_EQ(o.code, 0) << o;
    EXPECT_TRUE(o.told("005.png")) << o;
    EXPECT_TRUE(o.told("1 of 12 frames cannot be copied and are left out")) << o;
    EXPECT_NE(o.out.find("11 frames to"), std::string::npos) << o;
  }
}

TEST_F(BadInput, NothingUsable) {
  write_wall(path("wall"));
  for (int f = 0; f < 12; ++f) truncate("wall/rgb/" + frame_name(f));
  expect_refused(run(kMap), 3, {"wall"});
}

TEST_F(BadInput, DepthOfAnotherSize) {
  write_wall(path("wall"));
  cv::imwrite(path("wall/depth/004.png").string(), cv::Mat(100, 100, CV_16UC1, cv::Scalar(10000)));
  const Outcome o = run(kMap);
  EXPECT_EQ(o.code, 0) << o;
  EXPECT_TRUE(o.told("004.png")) << o;
  EXPECT_EQ(read_json(path("out/summary.json"))["frames"]["unreadable"], 1);
}

TEST_F(BadInput, EightBitDepth) {
  write_wall(path("wall"));
  for (int f = 0; f < 12; ++f) {
    cv::imwrite((path("wall/depth") / frame_name(f)).string(),
                cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(100)));
  }
  expect_refused(run(kMap), 3, {"depth/", "16"});
}

TEST_F(BadInput, CameraWithoutFocalLength) {
  WallRecording wall;
  wall.camera_without = "fx";
  write_wall(path("wall"), wall);
  expect_refused(run(kMap), 2, {"camera.yaml", "fx"});
  expect_refused(run(std::string(kMap) + "--camera tum_fr9"), 2, {"tum_fr9", "tum_fr"});
}

TEST_F(BadInput, ImpossibleDepthScales) {
  for (const double scale : {1.0, 500000.0}) {
    WallRecording wall;
    wall.camera_scale = scale;
    fs::remove_all(path("wall"));
    write_wall(path("wall"), wall);
    expect_refused(run(kMap), 3, {"depth_scale"});
  }
}

TEST_F(BadInput, ColourOfAnotherSize) {
  write_wall(path("wall"));
  cv::imwrite(path("wall/rgb/004.png").string(), painting(100, 100, 3));
  const Outcome o = run(kMap);
  EXPECT_EQ(o.code, 0) << o;
  EXPECT_TRUE(o.told("004.png")) << o;
  EXPECT_EQ(read_json(path("out/summary.json"))["frames"]["unreadable"], 1);
}

TEST_F(BadInput, DepthWithoutAnyMeasurement) {
  write_wall(path("wall"));
  for (int f = 0; f < 12; ++f) {
    cv::imwrite((path("wall/depth") / frame_name(f)).string(), cv::Mat::zeros(kHeight, kWidth, CV_16UC1));
  }
  expect_refused(run(kMap), 3, {"wall", "no measurement"});
}

TEST_F(BadInput, OneFrameOrTwoAreARecording) {
  for (const int frames : {1, 2}) {
    WallRecording wall;
    wall.frames = frames;
    fs::remove_all(path("wall"));
    write_wall(path("wall"), wall);
    const Outcome o = run("map wall -o out --force --set output.views=");
    EXPECT_EQ(o.code, 0) << o;
    EXPECT_EQ(read_json(path("out/summary.json"))["frames"]["tracked"], frames);
  }
}

TEST_F(BadInput, StampsThatRunBackwardsAreSortedAndTold) {
  write_wall(path("wall"));
  std::istringstream lines(slurp(path("wall/rgb.txt")));
  std::string backwards;
  for (std::string line; std::getline(lines, line);) backwards = line + "\n" + backwards;
  write("wall/rgb.txt", backwards);
  const Outcome o = run(kMap);
  EXPECT_EQ(o.code, 0) << o;
  EXPECT_TRUE(o.told("rgb.txt: the stamps are not in order")) << o;
  EXPECT_EQ(read_json(path("out/summary.json"))["frames"]["read"], 12);
}

TEST_F(BadInput, TruthThatIsNoNumberIsNamed) {
  write_wall(path("wall"));
  std::ofstream(path("wall/groundtruth.txt"), std::ios::app) << "11 nan 0 0 0 0 0 1\n";
  const Outcome o = run("map wall -o out --set output.views=");
  EXPECT_EQ(o.code, 0) << o;
  EXPECT_TRUE(o.told("groundtruth.txt: 1 of 13 rows")) << o;
  const Outcome e = run("evaluate trajectory out wall");
  EXPECT_EQ(e.code, 0) << e;
  EXPECT_TRUE(e.told("groundtruth.txt: 1 of 13 rows")) << e;
  std::ofstream(path("wall/groundtruth.txt"), std::ios::app) << "12 zero 0 0 0 0 0 1\n";
  const Outcome z = run("evaluate trajectory out wall");
  EXPECT_EQ(z.code, 3) << z;
  EXPECT_TRUE(z.told("groundtruth.txt:14: 'zero'")) << z;
}

TEST_F(BadInput, NamesWithSpacesAndForeignLettersAreNames) {
  write_wall(path("eine Küche"));
  const Outcome o = run("map './eine Küche/' -o 'mein Ergebnis/' -p known_poses --set output.views=");
  EXPECT_EQ(o.code, 0) << o;
  EXPECT_TRUE(fs::exists(path("mein Ergebnis/map.ply")));
}

TEST_F(BadInput, AnEmptyPipelineFileIsNamed) {
  write_wall(path("wall"));
  write("empty.yaml", "");
  expect_refused(run("map wall -o out -p empty.yaml"), 2, {"empty.yaml: a pipeline is a map"});
}

TEST_F(BadInput, DoubtfulDepthScaleIsAWarningThatNamesTheLikelyOne) {
  WallRecording wall;
  wall.camera_scale = 600.0;
  write_wall(path("wall"), wall);
  const Outcome o = run(kMap);
  EXPECT_TRUE(o.told("warning")) << o;
  EXPECT_TRUE(o.told("5000")) << o;
}

TEST_F(BadInput, NothingInCommonInTime) {
  WallRecording wall;
  wall.depth_offset_s = 1000.0;
  write_wall(path("wall"), wall);
  expect_refused(run(kMap), 3, {"depth.txt"});
}

TEST_F(BadInput, ConfigurationIsRefusedBeforeAnythingIsStarted) {
  write_wall(path("wall"));
  write("p.yaml",
        "stages:\n  read: {type: read}\n  poses: {type: poses, inputs: {frame: raed}, keyframe_distnce: 3}\n"
        "  fuse: {type: fuse, inputs: {cloud: read, map: poses}, voxel: 5 s}\n"
        "  output: {type: output, inputs: {map: poses, cloud: fuse}, views: iso tpo}\n");
  expect_refused(
      run("map wall -o out -p p.yaml --set fuse.voxel=0 --set fsue.voxel=5mm --set fuse"), 2,
      {"p.yaml:3:40: stages.poses.inputs.frame: there is no stage 'raed'", "did you mean read?",
       "p.yaml:3:47: stages.poses.keyframe_distnce: unknown key", "did you mean keyframe_distance?",
       "p.yaml:4:38: stages.fuse.inputs.cloud: 'read' does not give the keyframe_cloud",
       "p.yaml:4:64: stages.fuse.voxel: '5 s': the unit 's' does not fit", "there is no view 'tpo'",
       "--set fuse.voxel: 0 is out of range", "--set fsue.voxel: there is no stage 'fsue'",
       "--set fuse: write it as stage.key=value"});
  expect_refused(run("map wall -o out -p nothing.yaml"), 2,
                 {"pipeline 'nothing.yaml': neither a file nor one of"});
  write("twice.yaml", "stages:\n  read: {type: read}\n  read: {type: read}\n");
  expect_refused(run("map wall -o out -p twice.yaml"), 2,
                 {"twice.yaml:3:3: stages.read: the key is given twice"});
}

TEST_F(BadInput, UsageErrors) {
  for (const char* arguments : {"", "mpa", "map", "map wall", "map wall -o", "map wall -o out --evry 2",
                                "map wall -o out --every 0", "map wall -o out --threads 0",
                                "map wall -o out -q -v", "evaluate", "render wall -o x.png --size 3"}) {
    const Outcome o = run(arguments);
    EXPECT_EQ(o.code, 2) << arguments << "\n" << o;
    EXPECT_FALSE(o.err.empty()) << arguments;
  }
}

}  // namespace
}  // namespace plumbline::integration
