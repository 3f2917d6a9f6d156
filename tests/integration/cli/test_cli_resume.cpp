// SPDX-License-Identifier: BSD-3-Clause
// map.db: what a run leaves when it is killed at any moment or the disk is full, and what can be done with
// it.
#include <csignal>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "plumbline/maps/store.hpp"
#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

constexpr int kFrames = 60;
const char* const kCheap = " -q --set output.views= --set fuse.voxel=20mm";

class ResumeCommand : public ProgramTest {
 protected:
  ResumeCommand() {
    WallRecording recording;
    recording.frames = kFrames;
    write_wall(path("wall"), recording);
  }

  /// Starts `map RECORDINGS -o OUT` and kills it as soon as its store holds so many keyframes.
  void map_and_kill(const std::string& out, std::size_t keyframes,
                    const std::string& recordings = "wall") const {
    const pid_t child = fork();
    if (child == 0) {
      const std::string command = "cd '" + path("").string() + "' && exec " + PLUMBLINE_PROGRAM + " map " +
                                  recordings + " -o " + out + kCheap + " 2>err.txt";
      execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    ASSERT_GT(child, 0);
    const fs::path file = path(out + ".partial/map.db");
    int status = 0;
    while (waitpid(child, &status, WNOHANG) == 0) {
      if (stored(file) >= keyframes) {
        kill(child, SIGKILL);
        waitpid(child, &status, 0);
        break;
      }
      usleep(2000);
    }
    ASSERT_TRUE(WIFSIGNALED(status)) << "it came to its end before it could be killed";
  }
  static std::size_t stored(const fs::path& file) {
    if (!fs::exists(file)) return 0;
    const auto reader = maps::StoreReader::open(file);
    if (!reader) return 0;
    const auto contents = reader->contents();
    return contents ? contents->keyframes : 0;
  }
  static std::vector<std::string> lines_of(const fs::path& file) {
    std::ifstream in(file);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }
  [[nodiscard]] double ate_m(const std::string& out) const {
    const Outcome o = run("evaluate trajectory " + out + " wall --frames wall/rgb.txt --json");
    if (o.code != 0) return 1e9;
    return nlohmann::json::parse(o.out)["ate_m"]["rmse"];
  }
};

TEST_F(ResumeCommand, KilledAtAnyMomentNothingCommittedIsLost) {
  ASSERT_EQ(run(std::string("map wall -o whole") + kCheap).code, 0);
  const std::vector<std::string> rows = lines_of(path("whole/frames.csv"));
  ASSERT_EQ(rows.size(), kFrames + 1U);
  const double whole_points = read_json(path("whole/summary.json"))["cloud"]["points"];
  for (const std::size_t keyframes : {1U, 2U, 4U}) {
    const std::string out = "out" + std::to_string(keyframes);
    map_and_kill(out, keyframes);
    if (HasFatalFailure()) return;
    const auto left = maps::load_map(path(out + ".partial/map.db"));
    ASSERT_TRUE(left) << left.error().message;
    EXPECT_GE(left->map.keyframe_count(), keyframes);
    ASSERT_FALSE(left->log.empty());
    for (std::size_t i = 0; i < left->log.size(); ++i) EXPECT_EQ(left->log[i], rows[i + 1]);
    const Outcome told = run("info " + out);
    EXPECT_EQ(told.code, 0) << told;
    EXPECT_NE(told.out.find("store.complete: no"), std::string::npos) << told;
    EXPECT_EQ(run("export " + out + " -o left.ply").code, 0);
    EXPECT_GT(fs::file_size(path("left.ply")), 100000U);

    const Outcome resumed = run("map wall --resume -o " + out + kCheap);
    ASSERT_EQ(resumed.code, 0) << resumed;
    EXPECT_FALSE(fs::exists(path(out + ".partial")));
    const std::vector<std::string> again = lines_of(path(out + "/frames.csv"));
    ASSERT_EQ(again.size(), rows.size());
    for (std::size_t i = 0; i <= left->log.size(); ++i) EXPECT_EQ(again[i], rows[i]) << "what was done stays";
    EXPECT_EQ(lines_of(path(out + "/timing.csv")).size(), kFrames + 1U);
    const nlohmann::json summary = read_json(path(out + "/summary.json"));
    EXPECT_EQ(summary["frames"]["read"], kFrames);
    EXPECT_EQ(summary["frames"]["tracked"], kFrames);
    EXPECT_EQ(summary["frames"]["resumed"], left->log.size());
    const double points = summary["cloud"]["points"];
    EXPECT_NEAR(points / whole_points, 1.0, 0.05);
    EXPECT_LT(ate_m(out), std::max(1.05 * ate_m("whole"), ate_m("whole") + 0.001));
    EXPECT_TRUE(maps::load_map(path(out + "/map.db"))->complete);
  }
}

TEST_F(ResumeCommand, SeveralRobotsGoOnAsWell) {
  constexpr int kOthers = 40;
  WallRecording shorter;
  shorter.frames = kOthers;
  write_wall(path("other"), shorter);
  const std::string two = "other wall";
  const std::string cheap = std::string(kCheap) + " --set merge.min_pairs=3";
  ASSERT_EQ(run("map " + two + " -o whole" + cheap).code, 0);
  const std::vector<std::string> rows = lines_of(path("whole/frames.csv"));
  ASSERT_EQ(rows.size(), kFrames + kOthers + 1U);
  const double whole_points = read_json(path("whole/summary.json"))["cloud"]["points"];
  for (const std::size_t keyframes : {1U, 3U, 6U}) {
    const std::string out = "out" + std::to_string(keyframes);
    map_and_kill(out, keyframes, two + " --set merge.min_pairs=3");
    if (HasFatalFailure()) return;
    const auto left = maps::StoreReader::open(path(out + ".partial/map.db"))->load_each();
    ASSERT_TRUE(left) << left.error().message;
    std::size_t stored_rows = 0;
    for (const maps::StoredMap& map : *left) stored_rows += map.log.size();
    ASSERT_GT(stored_rows, 0U);
    EXPECT_EQ(run("info " + out).code, 0);
    const bool apart = left->size() > 1;
    const Outcome left_cloud = run("export " + out + " -o left.ply");
    EXPECT_EQ(left_cloud.code, apart ? 3 : 0) << "they are not one yet";
    if (apart) {
      EXPECT_TRUE(left_cloud.told("--robot")) << left_cloud;
      EXPECT_EQ(run("export " + out + " --robot wall -o left.ply").code, 0);
      EXPECT_EQ(run("export " + out + " --robot other --what trajectory -o left.txt").code, 0);
      EXPECT_FALSE(lines_of(path("left.txt")).empty());
      EXPECT_EQ(run("render " + out + " --robot wall --size 200x150 -o left.png").code, 0);
      EXPECT_EQ(run("render " + out + " --robot nobody -o left.png").code, 3);
    }

    const Outcome resumed = run("map " + two + " --resume -o " + out + cheap);
    ASSERT_EQ(resumed.code, 0) << resumed;
    const std::vector<std::string> again = lines_of(path(out + "/frames.csv"));
    ASSERT_EQ(again.size(), rows.size());
    for (const maps::StoredMap& map : *left) {
      for (const std::string& line : map.log) {
        EXPECT_EQ(again[std::stoul(line) + 1], line) << "what was done stays";
      }
    }
    const nlohmann::json summary = read_json(path(out + "/summary.json"));
    EXPECT_EQ(summary["frames"]["tracked"], kFrames + kOthers);
    EXPECT_EQ(summary["frames"]["resumed"], stored_rows);
    EXPECT_TRUE(summary["merges"][0]["accepted"]);
    const double points = summary["cloud"]["points"];
    EXPECT_NEAR(points / whole_points, 1.0, 0.05);
    for (const std::string robot : {"other", "wall"}) {
      const std::string own = "/robots/" + robot + "/trajectory.txt";
      EXPECT_LT(ate_m(out + own), std::max(1.05 * ate_m("whole" + own), ate_m("whole" + own) + 0.001));
    }
    EXPECT_TRUE(maps::load_map(path(out + "/map.db"))->complete);
  }
  // Killed when only results were missing: the maps are one already.
  fs::rename(path("whole"), path("end.partial"));
  fs::remove(path("end.partial/summary.json"));
  write("end.partial/.plumbline-unfinished", "");
  const Outcome end = run("map " + two + " --resume -o end" + cheap);
  ASSERT_EQ(end.code, 0) << end;
  EXPECT_EQ(lines_of(path("end/frames.csv")), rows);
  EXPECT_TRUE(fs::exists(path("end/robots/other/trajectory.txt")));
}

TEST_F(ResumeCommand, AFullDiskKeepsWhatWasStored) {
  // The shell's file size limit stands in for the disk's end, in blocks of 1024 bytes (512 in some shells).
  const Outcome o = run(std::string("map wall -o out") + kCheap, "ulimit -f 2000; ");
  EXPECT_EQ(o.code, 5) << o;
  EXPECT_TRUE(o.told("map.db")) << o;
  EXPECT_TRUE(o.told("--resume")) << o;
  EXPECT_FALSE(fs::exists(path("out")));
  ASSERT_GT(stored(path("out.partial/map.db")), 0U) << o;
  ASSERT_TRUE(maps::load_map(path("out.partial/map.db")));
  const Outcome resumed = run(std::string("map wall --resume -o out") + kCheap);
  ASSERT_EQ(resumed.code, 0) << resumed;
  EXPECT_EQ(read_json(path("out/summary.json"))["frames"]["tracked"], kFrames);
}

TEST_F(ResumeCommand, OnlyTheSameRunIsGoneOnWith) {
  map_and_kill("out", 1);
  if (HasFatalFailure()) return;
  const std::string resume = "map wall --resume -o out";
  const Outcome other = run(resume + kCheap + " --set track.keyframe.min_frames=4");
  EXPECT_EQ(other.code, 2) << other;
  EXPECT_TRUE(other.told("track.keyframe.min_frames was 2 and is 4 now")) << other;
  const Outcome fewer = run(resume + kCheap + " --every 2");
  EXPECT_EQ(fewer.code, 2) << fewer;
  EXPECT_TRUE(fewer.told("frames was 60 and is 30 now")) << fewer;
  EXPECT_EQ(run(resume + kCheap + " --set store.enabled=off").code, 2);
  EXPECT_EQ(run(resume + kCheap + " --debug-video video").code, 2);
  ASSERT_GT(stored(path("out.partial/map.db")), 0U) << "a refusal destroys nothing";
  ASSERT_EQ(run(resume + kCheap + " --threads 1").code, 0) << "the number of threads is of no matter";
  const Outcome finished = run("map wall --resume -o out --set output.views=");
  EXPECT_EQ(finished.code, 0) << finished;
  EXPECT_NE(finished.out.find("is finished"), std::string::npos) << finished;
  EXPECT_NE(finished.out.find("--force"), std::string::npos) << finished;
  const Outcome fresh = run("map wall --resume -o fresh --to 0.5 --set output.views= -p fast");
  EXPECT_EQ(fresh.code, 0) << fresh;
  EXPECT_TRUE(fresh.told("starting with the first frame")) << fresh;
}

/// The rows of a trajectory; comments above them differ.
std::string poses(const fs::path& file) {
  std::istringstream lines(slurp(file));
  std::string rows;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind('#', 0) != 0) rows += line + "\n";
  }
  return rows;
}

TEST_F(ResumeCommand, ResultsComeFromTheStoreAsWell) {
  ASSERT_EQ(run(std::string("map wall -o out --threads 1") + kCheap).code, 0);
  ASSERT_EQ(run(std::string("map wall -o other --threads 3") + kCheap).code, 0);
  EXPECT_TRUE(slurp(path("out/map.db")) == slurp(path("other/map.db"))) << "for any number of threads";
  const Outcome told = run("info out");
  EXPECT_NE(told.out.find("store.complete: yes"), std::string::npos) << told;

  const std::string cloud = slurp(path("out/map.ply"));
  for (const char* gone : {"map.ply", "map.pcd", "lines.ply", "trajectory.txt"})
    fs::remove(path("out") / gone);
  ASSERT_EQ(run("export out -o map.ply").code, 0);
  EXPECT_TRUE(without_frame(slurp(path("map.ply"))) == cloud) << "the same cloud in every bit";
  ASSERT_EQ(run("export out --trajectory -o trajectory.txt").code, 0);
  EXPECT_EQ(poses(path("trajectory.txt")), poses(path("other/trajectory.txt")));
  ASSERT_EQ(run("export out --lines -o lines.ply").code, 0);
  EXPECT_TRUE(without_frame(slurp(path("lines.ply"))) == slurp(path("other/lines.ply")));
  ASSERT_EQ(run("export out --voxel 5cm -o coarse.ply").code, 0);
  EXPECT_LT(fs::file_size(path("coarse.ply")), cloud.size() / 3);
  ASSERT_EQ(run("export out/map.db --keyframes clouds").code, 0);
  EXPECT_TRUE(fs::exists(path("clouds/000000.ply")));
  ASSERT_EQ(run("render out/map.db -o picture.png --size 160x120 --lines").code, 0);
  EXPECT_GT(fs::file_size(path("picture.png")), 1000U);
  EXPECT_EQ(run("export out -o map.ply --voxel -1").code, 2);
  EXPECT_EQ(run("export out").code, 2);
}

TEST_F(ResumeCommand, DamagedAndForeignStoresAreRefused) {
  ASSERT_EQ(run(std::string("map wall -o out --to 0.7 -p fast") + kCheap).code, 0);
  const std::string whole = slurp(path("out/map.db"));
  write("short.db", whole.substr(0, whole.size() / 2));
  write("text.db", std::string(20000, 'x'));
  std::string newer = whole;
  newer[63] = 99;  // the last byte of SQLite's user_version
  write("newer.db", newer);
  for (const char* file : {"short.db", "text.db", "newer.db"}) {
    for (const std::string& command :
         {std::string("export ") + file + " -o x.ply", std::string("render ") + file + " -o x.png"}) {
      const Outcome o = run(command);
      EXPECT_EQ(o.code, 3) << command << o;
      EXPECT_TRUE(o.told(file)) << command << o;
    }
  }
  EXPECT_EQ(run("info text.db").code, 3);
  const Outcome o = run("info newer.db");
  EXPECT_EQ(o.code, 3);
  EXPECT_TRUE(o.told("newer")) << o;
  EXPECT_EQ(run("export nothing -o x.ply").code, 3);
}

}  // namespace
}  // namespace plumbline::integration
