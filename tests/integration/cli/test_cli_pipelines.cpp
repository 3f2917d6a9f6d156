// SPDX-License-Identifier: BSD-3-Clause
// Pipelines of users: the tutorial word for word, includes, taps, pictures of graphs.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <sstream>
#include <utility>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

const fs::path kSource = PLUMBLINE_SOURCE_DIR;

/// The fenced blocks of the section of that name of docs/reference/commands.md, without their fences.
std::vector<std::string> blocks_of_page(const std::string& heading) {
  const std::string page = slurp(kSource / "docs/reference/commands.md");
  const std::size_t begin = page.find("\n## " + heading + "\n");
  if (begin == std::string::npos) return {};
  std::istringstream section(page.substr(begin + 1, page.find("\n## ", begin + 4) - begin));
  std::vector<std::string> blocks;
  bool inside = false;
  for (std::string line; std::getline(section, line);) {
    if (line.rfind("```", 0) == 0) {
      inside = !inside;
      if (inside) blocks.emplace_back();
    } else if (inside) {
      blocks.back() += line + "\n";
    }
  }
  return blocks;
}

class Pipelines : public ProgramTest {};

TEST_F(Pipelines, TheTutorialWorksWordForWord) {
  const std::vector<std::string> blocks = blocks_of_page("A pipeline of your own");
  ASSERT_EQ(blocks.size(), 3U);  // copy; the new end of the file; check and run
  fs::create_directory_symlink(kSource / "pipelines", path("pipelines"));
  ASSERT_EQ(std::system(("cd '" + path("").string() + "' && " + blocks[0]).c_str()), 0) << blocks[0];
  const std::string copied = slurp(path("mine.yaml"));
  const std::size_t last_stage = copied.find("\n  output:\n");
  ASSERT_NE(last_stage, std::string::npos) << copied;
  write("mine.yaml", copied.substr(0, last_stage + 1) + blocks[1]);
  std::istringstream commands(blocks[2]);
  int run_commands = 0;
  for (std::string line; std::getline(commands, line);) {
    std::string words = line.substr(0, line.find('#'));
    ASSERT_EQ(words.rfind("plumbline ", 0), 0U) << line;
    const std::size_t recording = words.find("RECORDING");
    if (recording != std::string::npos)
      words.replace(recording, 9, "'synth:room?frames=12&width=320&height=240'");
    const Outcome o = run(words.substr(10));
    ASSERT_EQ(o.code, 0) << words << "\n" << o;
    ++run_commands;
  }
  EXPECT_GE(run_commands, 4);
  const auto before = cloud::read_cloud(path("out/mine/before.ply"));
  const auto after = cloud::read_cloud(path("out/mine/map.ply"));
  ASSERT_TRUE(before);
  ASSERT_TRUE(after);
  EXPECT_GT(before->cloud->size(), 1000U);
  EXPECT_GT(after->cloud->size(), before->cloud->size() / 2);
  EXPECT_NE(slurp(path("out/mine/before.ply")), slurp(path("out/mine/map.ply")));
  EXPECT_GT(fs::file_size(path("before.png")), 10000U);
  EXPECT_GT(fs::file_size(path("after.png")), 10000U);
}

/// Sum of a column of frames.csv.
double column_sum(const fs::path& file, const std::string& column) {
  std::istringstream table(slurp(file));
  const auto cells = [&](std::vector<std::string>& to) {
    std::string line;
    to.clear();
    if (!std::getline(table, line)) return false;
    std::istringstream rest(line);
    for (std::string cell; std::getline(rest, cell, ',');) to.push_back(cell);
    return true;
  };
  std::vector<std::string> row;
  cells(row);
  const auto at = std::find(row.begin(), row.end(), column) - row.begin();
  EXPECT_LT(static_cast<std::size_t>(at), row.size()) << column;
  double sum = 0.0;
  while (cells(row)) sum += std::atof(row.at(static_cast<std::size_t>(at)).c_str());
  return sum;
}

TEST_F(Pipelines, FamiliesAreWhatTheirNamesSay) {
  const std::vector<std::string> families{"points", "lines", "surface", "photometric"};
  const std::vector<std::pair<std::string, std::vector<std::string>>> pipelines{
      {"points_only", {"points"}},
      {"points_lines", {"points", "lines"}},
      {"paper", {"points", "lines"}},
      {"depth_only", {"surface"}}};
  for (const auto& [pipeline, used] : pipelines) {
    const Outcome o =
        run("map 'synth:room?frames=16' --threads 1 --force -o out --set output.views= -p " + pipeline);
    ASSERT_EQ(o.code, 0) << pipeline << "\n" << o;
    for (const std::string& family : families) {
      const bool is_used = std::find(used.begin(), used.end(), family) != used.end();
      EXPECT_EQ(column_sum(path("out/frames.csv"), family) > 0.0, is_used) << pipeline << ": " << family;
    }
    const auto summary = read_json(path("out/summary.json"));
    if (pipeline != "depth_only") {
      EXPECT_EQ(summary["refine"]["tried"], 0) << pipeline << ": aligned surfaces";
    }
    EXPECT_EQ(summary["landmarks"]["points"] > 0, used.front() == "points") << pipeline;
  }
}

TEST_F(Pipelines, TapsWriteEveryPortAndFramesAreARecordingAgain) {
  write_wall(path("wall"));
  write("wall/camera.yaml", slurp(path("wall/camera.yaml")) + "depth_slope: [0.001, 0]\n");
  write("mine.yaml",
        "include: known_poses.yaml\n"
        "stages:\n  features: {type: features, inputs: {frame: read}, orb.count: 200}\n"
        "taps:\n"
        "  - {port: read, file: frames/frame-*.png}\n"
        "  - {port: features, file: features/*.csv, every: 5}\n"
        "  - {port: poses.track, file: deep/er/track.csv}\n"
        "  - {port: poses.map, file: path.txt}\n"
        "  - {port: poses.map, file: path.ply}\n"
        "  - {port: cloud, file: keyframes/*.pcd}\n"
        "  - {port: fuse, file: raw.ply}\n");
  const Outcome o = run("map wall -o out -p mine.yaml --set output.views=");
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_EQ(without_frame(slurp(path("out/raw.ply"))), slurp(path("out/map.ply")));
  EXPECT_EQ(slurp(path("out/path.txt")), slurp(path("out/trajectory.txt")));
  EXPECT_EQ(slurp(path("out/path.ply")).substr(0, 3), "ply");
  EXPECT_TRUE(fs::exists(path("out/features/000000.csv")));
  EXPECT_FALSE(fs::exists(path("out/features/000001.csv")));
  EXPECT_TRUE(fs::exists(path("out/features/000010.csv")));
  EXPECT_NE(slurp(path("out/features/000005.csv")).find("\npoint,"), std::string::npos);
  EXPECT_EQ(slurp(path("out/deep/er/track.csv")).substr(0, 46),
            "frame,stamp,keyframe\n0,10.000000,0\n1,10.033333");
  const auto keyframes = dataset::read_trajectory(path("out/keyframes.txt"));
  ASSERT_TRUE(keyframes);
  std::size_t clouds = 0;
  for (const auto& entry : fs::directory_iterator(path("out/keyframes"))) {
    EXPECT_TRUE(cloud::read_cloud(entry.path())) << entry.path();
    ++clouds;
  }
  EXPECT_EQ(clouds, keyframes->size());
  // What was tapped is read again, and gives the same cloud at the same poses.
  EXPECT_EQ(slurp(path("out/frames/camera.yaml")).find("depth_slope"), std::string::npos)
      << "is in the depth";
  fs::copy_file(path("out/trajectory.txt"), path("poses.txt"));
  const Outcome info = run("info out/frames");
  EXPECT_EQ(info.code, 0) << info;
  EXPECT_NE(info.out.find("12"), std::string::npos) << info;
  // The effective configuration has the taps and the chains spelt out.
  const Outcome again = run("pipelines check out/config.yaml");
  EXPECT_EQ(again.code, 0) << again;
  EXPECT_NE(slurp(path("out/config.yaml")).find("  - port: fuse.cloud\n    file: raw.ply\n"),
            std::string::npos);
  EXPECT_NE(slurp(path("out/config.yaml")).find("    filters:\n      - {type: pass_through, field: z, "),
            std::string::npos);
}

TEST_F(Pipelines, TapsThatCannotBeWrittenAreConfigurationErrors) {
  write_wall(path("wall"));
  write(
      "mine.yaml",
      "include: known_poses.yaml\ntaps:\n  - {port: fuse, file: map.ply}\n  - {port: cloud, file: a.ply}\n");
  const Outcome o = run("map wall -o out -p mine.yaml");
  EXPECT_EQ(o.code, 2) << o;
  EXPECT_TRUE(o.told("mine.yaml:3:5: taps[0]: writes map.ply, which stages.output writes as well")) << o;
  EXPECT_TRUE(o.told("mine.yaml:4:25: taps[1].file: a.ply: many files are written here")) << o;
  EXPECT_FALSE(fs::exists(path("out")));
  EXPECT_FALSE(fs::exists(path("out.partial")));
}

TEST_F(Pipelines, AreListedDescribedAndDrawn) {
  const Outcome list = run("pipelines list");
  EXPECT_EQ(list.code, 0) << list;
  for (const char* told : {"pipelines:\n", "  rgbd ", "  known_poses ", "stages:\n", "  fuse "}) {
    EXPECT_NE(list.out.find(told), std::string::npos) << told << list;
  }
  const Outcome fuse = run("pipelines describe fuse");
  EXPECT_NE(fuse.out.find("keyframe_cloud, each frame"), std::string::npos) << fuse;
  EXPECT_NE(fuse.out.find("  voxel "), std::string::npos) << fuse;
  const Outcome typing_error = run("pipelines describe fsue");
  EXPECT_EQ(typing_error.code, 2) << typing_error;
  EXPECT_TRUE(typing_error.told("did you mean fuse?")) << typing_error;
  EXPECT_NE(run("pipelines describe").out.find("\n## fuse\n"), std::string::npos);
  const nlohmann::json schema = nlohmann::json::parse(run("pipelines schema fuse").out, nullptr, false);
  EXPECT_EQ(schema["properties"]["type"]["const"], "fuse");
  EXPECT_EQ(run("pipelines graph rgbd").out.substr(0, 8), "digraph ");
  const Outcome drawn = run("pipelines graph rgbd -o rgbd.png");
  EXPECT_EQ(drawn.code, 0) << drawn;
  const cv::Mat picture = cv::imread(path("rgbd.png").string());
  EXPECT_GT(picture.cols, picture.rows);
  EXPECT_EQ(run("pipelines graph rgbd -o rgbd.jpg").code, 2);
  EXPECT_EQ(run("pipelines graph rgbd -o nowhere/rgbd.png").code, 5);
}

}  // namespace
}  // namespace plumbline::integration
