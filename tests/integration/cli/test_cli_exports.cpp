// SPDX-License-Identifier: BSD-3-Clause
// plumbline export and `exports:` as users meet them. Programs of others judge the files in judges/.
#include <cmath>
#include <opencv2/core.hpp>
#include <sstream>
#include <vector>

#include "plumbline/dataset/image_io.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "program.hpp"

namespace plumbline::integration {
namespace {

constexpr const char* kRecording = "\"synth:room?frames=60&width=320&height=240\"";

class Exports : public ProgramTest {};

/// Rows of numbers that are no comments.
std::vector<std::vector<double>> rows_of(const fs::path& file) {
  std::vector<std::vector<double>> rows;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (line.empty() || line.front() == '#' || std::isalpha(line.front()) != 0) continue;
    for (char& c : line) c = c == ',' ? ' ' : c;
    std::istringstream words(line);
    rows.emplace_back();
    for (double value = 0.0; words >> value;) rows.back().push_back(value);
  }
  return rows;
}

TEST_F(Exports, AllPathsAreOneAndRunsWriteTheirExports) {
  const Outcome mapped =
      run(std::string("map ") + kRecording +
          " -o out -q --set 'output.exports=[grid.yaml, room.las, {file: model, format: colmap}]'");
  ASSERT_EQ(mapped.code, 0) << mapped;
  for (const char* file : {"out/grid.yaml", "out/grid.pgm", "out/room.las", "out/model/sparse/0/points3D.bin",
                           "out/model/images/000001.png"})
    EXPECT_TRUE(fs::exists(path(file))) << file;

  ASSERT_EQ(run("report out").code, 0);
  EXPECT_NE(slurp(path("out/report.html")).find("<a href=\"room.las\">"), std::string::npos);

  // One path in four forms.
  for (const char* options :
       {"-o tum.txt --what trajectory", "-o all.kitti", "-o euroc.csv --what trajectory", "-o poses.csv",
        "-o each --what trajectory --format tum"}) {
    const Outcome outcome = run(std::string("export out ") + options);
    ASSERT_EQ(outcome.code, 0) << options << outcome;
  }
  const auto tum = dataset::read_trajectory(path("tum.txt"));
  ASSERT_TRUE(tum);
  const auto kitti = rows_of(path("all.kitti"));
  const auto euroc = rows_of(path("euroc.csv"));
  std::ifstream poses(path("poses.csv"));
  ASSERT_EQ(kitti.size(), tum->size());
  ASSERT_EQ(euroc.size(), tum->size());
  EXPECT_TRUE(fs::exists(path("each/out.txt")));
  for (std::size_t i = 0; i < tum->size(); ++i) {
    const auto& pose = (*tum)[i];
    for (int k = 0; k < 3; ++k) {
      const auto axis = static_cast<std::size_t>(k);
      EXPECT_NEAR(kitti[i][4 * axis + 3], pose.world_from_camera.translation[k], 1e-6);
      EXPECT_NEAR(euroc[i][1 + axis], pose.world_from_camera.translation[k], 1e-6);
      EXPECT_NEAR(kitti[i][4 * axis], pose.world_from_camera.rotation(k, 0), 1e-6);
    }
    EXPECT_NEAR(euroc[i][0], pose.stamp * 1e9, 2e3);
  }
  EXPECT_NE(slurp(path("poses.csv")).find("cov_x_x,cov_x_y"), std::string::npos);

  // The body that carries the camera 10 cm ahead of itself.
  ASSERT_EQ(run("export out -o body.txt --what trajectory --body 0,0,0.1,0,0,0,1").code, 0);
  const auto body = dataset::read_trajectory(path("body.txt"));
  ASSERT_TRUE(body);
  const Eigen::Vector3d off =
      (*body)[3].world_from_camera.translation - (*tum)[3].world_from_camera * Eigen::Vector3d(0, 0, -0.1);
  EXPECT_LT(off.norm(), 1e-6);

  const Outcome unknown = run("export out -o base.txt --what trajectory --body base");
  EXPECT_EQ(unknown.code, 3) << unknown;
  EXPECT_TRUE(unknown.told("does not say where its base is")) << unknown;
  EXPECT_EQ(run("export out -o base.txt --what trajectory --body 0,0,0.1,0,0").code, 2);

  // What cannot be.
  const Outcome full = run("export out -o full.las", "ulimit -f 16; trap '' XFSZ; ");
  EXPECT_EQ(full.code, 5) << full;
  EXPECT_FALSE(fs::exists(path("full.las")));
  const Outcome full_folder = run("export out -o full", "ulimit -f 16; trap '' XFSZ; ");
  EXPECT_EQ(full_folder.code, 5) << full_folder;
  EXPECT_FALSE(fs::exists(path("full")));
  EXPECT_EQ(run("export out -o out/model").code, 2) << "an earlier export is not replaced unasked";
  EXPECT_EQ(run("export out -o out/model --force").code, 0);
  EXPECT_EQ(run("export out -o out --force").code, 2) << "a result is no export";
  const Outcome gone = run("export out -o poses_only --recording nowhere");
  EXPECT_EQ(gone.code, 0) << gone;
  EXPECT_TRUE(gone.told("poses only, without pictures")) << gone;
  EXPECT_TRUE(fs::exists(path("poses_only/sparse/0/images.bin")));
  fs::create_directory(path("aside"));
  const Outcome there = run("export ../out -o there", "cd aside && ");
  EXPECT_EQ(there.code, 0) << there;
  EXPECT_TRUE(fs::exists(path("aside/there/images"))) << "the recording is found from another folder";
  const Outcome robots = run("export out -o twice --recording a --recording b");
  EXPECT_TRUE(robots.told("2 given, the map is of 1 robot")) << robots;

  // Without its store a map has neither free space nor tracks.
  fs::remove(path("out/map.db"));
  const Outcome grid = run("export out -o late.yaml");
  EXPECT_EQ(grid.code, 3) << grid;
  EXPECT_TRUE(grid.told("no map.db")) << grid;
  EXPECT_EQ(run("export out -o late.las").code, 0);
}

TEST_F(Exports, TheBaseOfABagHasAPath) {
  ASSERT_EQ(run("synth room -o world --frames 30 --seed 1 --odometry ideal --out-format mcap -q").code, 0);
  ASSERT_EQ(run("map world/robot0/recording.mcap -o out -q --set output.views=").code, 0);
  ASSERT_EQ(run("export out -o base.txt --what trajectory --body base").code, 0);
  ASSERT_EQ(run("export out -o camera.txt --what trajectory").code, 0);

  // In generated worlds the base is where the camera is, x ahead and z up.
  const auto base = dataset::read_trajectory(path("base.txt"));
  const auto camera = dataset::read_trajectory(path("camera.txt"));
  ASSERT_TRUE(base && camera);
  ASSERT_EQ(base->size(), camera->size());
  const Eigen::Matrix3d& ahead = (*camera)[7].world_from_camera.rotation;
  EXPECT_LT(((*base)[7].world_from_camera.rotation.col(0) - ahead.col(2)).norm(), 1e-5);
  EXPECT_LT(((*base)[7].world_from_camera.rotation.col(2) + ahead.col(1)).norm(), 1e-5);
}

/// The recording is gone: models have the pictures that the map keeps.
TEST_F(Exports, KeptPicturesReplaceARecordingThatIsGone) {
  ASSERT_EQ(run("synth room -o world --frames 60 --width 320 --height 240 -q").code, 0);
  const Outcome mapped = run("map world/robot0 -o out -q --set store.images=whole --set output.views=");
  ASSERT_EQ(mapped.code, 0) << mapped;
  ASSERT_EQ(run("export out -o with --format colmap").code, 0);
  fs::rename(path("world"), path("elsewhere"));

  const Outcome colmap = run("export out -o without --format colmap");
  ASSERT_EQ(colmap.code, 0) << colmap;
  const auto read = [&](const std::string& file) { return dataset::read_image(path(file)); };
  std::size_t compared = 0;
  for (const auto& entry : fs::directory_iterator(path("with/images"))) {
    const std::string name = entry.path().filename().string();
    const auto original = read("with/images/" + name);
    const auto kept = read("without/images/" + name);
    ASSERT_TRUE(original && kept) << name;
    EXPECT_LT(cv::norm(*original, *kept, cv::NORM_L1) / static_cast<double>(original->total() * 3), 2.0);
    ++compared;
  }
  EXPECT_GE(compared, 2U);

  const Outcome nerfstudio = run("export out -o scene --format nerfstudio");
  ASSERT_EQ(nerfstudio.code, 0) << nerfstudio;
  EXPECT_NE(nerfstudio.err.find("without depth images"), std::string::npos) << nerfstudio;
  EXPECT_EQ(slurp(path("scene/transforms.json")).find("depth_file_path"), std::string::npos);
  ASSERT_EQ(run("export out -o page.html").code, 0);
  EXPECT_NE(slurp(path("page.html")).find("/9j/"), std::string::npos) << "small pictures as base64";

  // Small pictures alone make no model.
  ASSERT_EQ(run("map elsewhere/robot0 -o small -q --set output.views=").code, 0);
  fs::rename(path("elsewhere"), path("far"));
  const Outcome poses = run("export small -o poses --format colmap");
  ASSERT_EQ(poses.code, 0) << poses;
  EXPECT_NE(poses.err.find("poses only"), std::string::npos) << poses;
}

TEST_F(Exports, WrongListsAreToldBeforeTheRun) {
  const Outcome wrong =
      run(std::string("map ") + kRecording +
          " -o out -q --set 'output.exports=[grid.e57, {file: plan.svg, heights: [0 m, 1 m]}, ../up.las]'");
  EXPECT_EQ(wrong.code, 2) << wrong;
  EXPECT_TRUE(wrong.told("grid.e57")) << wrong;
  EXPECT_TRUE(wrong.told("--heights: is not an option of plan")) << wrong;
  EXPECT_TRUE(wrong.told("below the result folder")) << wrong;
  EXPECT_FALSE(fs::exists(path("out")));
}

}  // namespace
}  // namespace plumbline::integration
