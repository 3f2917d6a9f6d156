// SPDX-License-Identifier: BSD-3-Clause
// plumbline map: what comes out, that it is the same every time, and what happens to OUT.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <map>
#include <sstream>
#include <thread>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

const char* const kNoPictures = " --set output.views=";

class MapCommand : public ProgramTest {
 protected:
  MapCommand() { write_wall(path("wall")); }
};

TEST_F(MapCommand, WritesTheWholeResultFolder) {
  const Outcome o = run("map wall -o out -p known_poses", "env -u DISPLAY ");
  ASSERT_EQ(o.code, 0) << o;
  for (const char* file : {"map.ply", "map.pcd", "trajectory.txt", "keyframes.txt", "keyframes.csv",
                           "lines.ply", "summary.json", "config.yaml", "frames.csv", "timing.csv",
                           "snapshots/iso.png", "snapshots/top.png", "snapshots/front.png"}) {
    EXPECT_GT(fs::file_size(path("out") / file), 0U) << file;
  }
  EXPECT_FALSE(fs::exists(path("out.partial")));

  const nlohmann::json summary = read_json(path("out/summary.json"));
  EXPECT_EQ(summary["frames"]["read"], 12);
  EXPECT_EQ(summary["frames"]["tracked"], 12);
  EXPECT_EQ(summary["frames"]["tracked_percent"], 100.0);
  EXPECT_GT(summary["cloud"]["points"], 1000);

  const nlohmann::json& timing = summary["timing"];
  const double mapping_s = timing["wall_s"].get<double>() - timing["export_s"].get<double>();
  EXPECT_NEAR(timing["fps"].get<double>() * mapping_s, 12.0, 0.1);
  EXPECT_GT(summary["timing"]["stages_ms"]["read"]["median"], 0.0);
  EXPECT_GT(summary["memory"]["peak_rss_mb"], 1.0);
  EXPECT_TRUE(o.told("12 of 12 frames")) << o;
}

TEST_F(MapCommand, TellsWhatFiltersLeaveOut) {
  const auto chain = [&](const char* name, const char* limit) {
    write(name, std::string("chain: near\nfilters:\n  - type: pass_through\n") + limit);
    return std::string("map wall -p known_poses --set output.views= --set cloud.filters=") + name;
  };
  const Outcome box = run(chain("box.yaml", "    max: 1.75\n") + " -o box");  // all but the wall
  ASSERT_EQ(box.code, 0) << box;
  const nlohmann::json cloud = read_json(path("box/summary.json"))["cloud"];
  EXPECT_EQ(cloud["left_out"][0]["by"], "depth_limits");
  EXPECT_EQ(cloud["left_out"][0]["points"], 0);
  EXPECT_EQ(cloud["left_out"][1]["by"], "pass_through");
  const double share = cloud["left_out"][1]["points"].get<double>() / cloud["measured"].get<double>();
  EXPECT_EQ(cloud["left_out_of_map"][0]["by"], "clusters");
  EXPECT_GT(share, 0.5);
  EXPECT_LT(share, 0.99);
  EXPECT_NE(box.out.find("% by pass_through, of what keyframes measured"), std::string::npos) << box;

  const Outcome none = run(chain("none.yaml", "    max: 1\n") + " -o none");
  EXPECT_EQ(none.code, 4) << none;
  EXPECT_TRUE(none.told("the cloud is empty: left out were 100 % by pass_through")) << none;
}

TEST_F(MapCommand, TracksTheWall) {
  const Outcome o = run(std::string("map wall -o out -q") + kNoPictures);
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_EQ(slurp(path("out/trajectory.txt")).find("-0.000000000"), std::string::npos);
  EXPECT_EQ(o.out, "");
  EXPECT_EQ(o.err, "");
  const nlohmann::json summary = read_json(path("out/summary.json"));
  EXPECT_EQ(summary["frames"]["tracked"], 12);
  EXPECT_GT(summary["landmarks"]["points"], 50);
  const Outcome e = run("evaluate trajectory out wall --frames wall/rgb.txt --json");
  ASSERT_EQ(e.code, 0) << e;
  const auto report = nlohmann::json::parse(e.out);
  EXPECT_LT(report["ate_m"]["rmse"], 0.01) << e;
  EXPECT_EQ(report["matched"], 12);
  EXPECT_EQ(report["tracked_percent"], 100.0);
}

TEST_F(MapCommand, TellsHowExactlyItIsKnown) {
  ASSERT_EQ(run("synth room -o film --frames 60 --reference-spacing 0.2 -q").code, 0);
  const Outcome o = run(std::string("map film/robot0 -o out -q --set fuse.voxel=20mm") + kNoPictures);
  ASSERT_EQ(o.code, 0) << o;
  std::istringstream table(slurp(path("out/keyframes.csv")));
  std::string line;
  ASSERT_TRUE(std::getline(table, line));
  EXPECT_EQ(line,
            "robot,keyframe,stamp,tx,ty,tz,qx,qy,qz,qw,sigma_position,sigma_rotation,points,lines,edges");
  std::size_t rows = 0;
  for (; std::getline(table, line); ++rows) {
    std::vector<std::string> cells;
    std::istringstream words(line);
    for (std::string cell; std::getline(words, cell, ',');) cells.push_back(cell);
    ASSERT_EQ(cells.size(), 15U) << line;
    for (const int column : {10, 11}) {
      const double sigma = std::stod(cells[static_cast<std::size_t>(column)]);
      EXPECT_EQ(sigma > 0.0, rows > 0) << line;
      EXPECT_LT(sigma, 0.2) << line;
    }
    EXPECT_GT(std::stoi(cells[12]), 0) << line;
  }
  const nlohmann::json summary = read_json(path("out/summary.json"));
  EXPECT_EQ(summary["keyframes"], rows);
  EXPECT_GT(rows, 2U);
  EXPECT_GT(summary["refine"]["sigma_position_m"]["median"], 0.0);
  EXPECT_GT(summary["cloud"]["sigma_m"]["median"], 0.0);
  EXPECT_GE(summary["cloud"]["sigma_m"]["p90"], summary["cloud"]["sigma_m"]["median"]);
  for (const char* file : {"out/map.ply", "out/map.pcd"}) {
    const auto cloud = cloud::read_cloud(path(file));
    ASSERT_TRUE(cloud.has_value());
    ASSERT_EQ(cloud->columns.others.size(), 1U) << file;
    EXPECT_EQ(cloud->columns.others[0].name, "sigma");
    for (const float sigma : cloud->columns.others[0].values)
      ASSERT_TRUE(std::isfinite(sigma) && sigma > 0.0F && sigma < 0.2F) << sigma;
  }
  const Outcome drawn = run("render out -o sigma.png --color sigma --size 320x240");
  EXPECT_EQ(drawn.code, 0) << drawn;
  EXPECT_GT(fs::file_size(path("sigma.png")), 1000U);
  EXPECT_EQ(run("map wall -o plain -q -p known_poses --set fuse.voxel=20mm" + std::string(kNoPictures)).code,
            0);
  const Outcome unknown = run("render plain -o none.png --color sigma");
  EXPECT_EQ(unknown.code, 2) << unknown;
  EXPECT_TRUE(unknown.told("has no sigma of its points")) << unknown;
}

TEST_F(MapCommand, SameBytesForAnyNumberOfThreadsAndFromItsOwnConfiguration) {
  for (const char* pipeline : {"rgbd", "known_poses"}) {
    const std::string name = pipeline;
    const std::string common = "map wall -q --set fuse.voxel=20mm" + std::string(kNoPictures);
    ASSERT_EQ(run(common + " -p " + name + " -o a_" + name + " --threads 1").code, 0);
    ASSERT_EQ(run(common + " -p " + name + " -o b_" + name + " --threads 3").code, 0);
    const Outcome again = run("map wall -q -o c_" + name + " -p a_" + name + "/config.yaml");
    ASSERT_EQ(again.code, 0) << again;
    for (const char* file : {"map.ply", "map.pcd", "trajectory.txt", "keyframes.txt", "keyframes.csv",
                             "lines.ply", "frames.csv", "pose_samples.npy"}) {
      if (name == "known_poses" && !fs::exists(path("a_" + name) / file))
        continue;  // its path is not checked
      const std::string bytes = slurp(path("a_" + name) / file);
      EXPECT_EQ(bytes, slurp(path("b_" + name) / file)) << name << " " << file;
      EXPECT_EQ(bytes, slurp(path("c_" + name) / file)) << name << " " << file;
    }
  }
}

TEST_F(MapCommand, PlayedAtAPaceItTakesItsTimeAndGivesTheSameBytes) {
  const std::string common = "map wall -q --set fuse.voxel=20mm" + std::string(kNoPictures);
  ASSERT_EQ(run(common + " -o at_once").code, 0);
  const Outcome paced = run(common + " -o paced --pace 20");
  ASSERT_EQ(paced.code, 0) << paced;
  for (const char* file :
       {"map.ply", "trajectory.txt", "keyframes.txt", "lines.ply", "frames.csv", "config.yaml", "map.db"}) {
    EXPECT_EQ(slurp(path("at_once") / file), slurp(path("paced") / file)) << file;
  }
  const nlohmann::json before = read_json(path("at_once/summary.json"))["timing"];
  const nlohmann::json timing = read_json(path("paced/summary.json"))["timing"];
  EXPECT_EQ(timing["pace_hz"], 20.0);
  EXPECT_GT(timing["behind_s"], 0.0);
  EXPECT_GE(timing["map_s"], 11.0 / 20.0);
  EXPECT_EQ(before["pace_hz"], 0.0);
  EXPECT_EQ(before["behind_s"], 0.0);
  EXPECT_EQ(run(common + " -o none --pace -1").code, 2);
}

TEST_F(MapCommand, TakesPartOfTheRecording) {
  const Outcome o =
      run(std::string("map wall -o out -p known_poses --from 0.1 --to 0.3 --every 2") + kNoPictures);
  ASSERT_EQ(o.code, 0) << o;
  const int read = read_json(path("out/summary.json"))["frames"]["read"];
  EXPECT_GE(read, 3);
  EXPECT_LE(read, 4);
  EXPECT_EQ(run("map wall -o none --from 100").code, 2);
}

TEST_F(MapCommand, AnEarlierResultIsReplacedOnlyWithForce) {
  const std::string map = std::string("map wall -p known_poses -q -o out") + kNoPictures;
  ASSERT_EQ(run(map + " --every 3").code, 0);
  const std::string before = slurp(path("out/summary.json"));
  const Outcome refused = run(map);
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(refused.told("--force")) << refused;
  EXPECT_EQ(slurp(path("out/summary.json")), before);
  ASSERT_EQ(run(map + " --force").code, 0);
  EXPECT_EQ(read_json(path("out/summary.json"))["frames"]["read"], 12);
  EXPECT_FALSE(fs::exists(path("out.partial")));
  EXPECT_FALSE(fs::exists(path("out.replaced")));

  // A run that fails leaves the earlier result alone.
  const std::string good = slurp(path("out/summary.json"));
  EXPECT_EQ(run(map + " --force --set poses.file=missing.txt").code, 3);
  EXPECT_EQ(slurp(path("out/summary.json")), good);
  EXPECT_FALSE(fs::exists(path("out.partial")));
}

TEST_F(MapCommand, NeverDeletesWhatIsNoResult) {
  const std::string map = std::string("map wall -p known_poses -q --force") + kNoPictures;
  fs::create_directory(path("thesis"));
  write("thesis/chapter1.txt", "years of work");
  EXPECT_EQ(run(map + " -o thesis").code, 2);
  EXPECT_EQ(slurp(path("thesis/chapter1.txt")), "years of work");
  EXPECT_EQ(run(map + " -o wall").code, 2);
  EXPECT_TRUE(fs::exists(path("wall/rgb.txt")));
  EXPECT_EQ(run(map + " -o thesis/chapter1.txt").code, 2);
  fs::create_directory(path("empty"));
  EXPECT_EQ(run(map + " -o empty/").code, 0);
  EXPECT_TRUE(fs::exists(path("empty/map.ply")));
  fs::create_directory(path("new.partial"));
  write("new.partial/mine.txt", "x");
  EXPECT_EQ(run(map + " -o new").code, 2);
  EXPECT_TRUE(fs::exists(path("new.partial/mine.txt")));
}

TEST_F(MapCommand, OutputThatCannotBeWrittenIsToldBeforeTheRun) {
  const Outcome o = run("map wall -p known_poses -o /proc/nothing/out");
  EXPECT_EQ(o.code, 5);
  EXPECT_TRUE(o.told("/proc/nothing/out")) << o;
  EXPECT_FALSE(o.told("frames")) << o;
}

TEST_F(MapCommand, KnownPosesOfSeveralRobots) {
  write_wall(path("wall"));
  write_wall(path("other"));
  const std::string map =
      std::string("map wall other -p known_poses -q --force --set fuse.voxel=20mm") + kNoPictures;
  const Outcome o = run(map + " -o two");
  ASSERT_EQ(o.code, 0) << o;
  ASSERT_EQ(run("map wall -p known_poses -q -o one --set fuse.voxel=20mm" + std::string(kNoPictures)).code,
            0);
  for (const char* robot : {"wall", "other"}) {
    EXPECT_EQ(slurp(path("two/robots") / robot / "trajectory.txt"), slurp(path("one/trajectory.txt")));
    EXPECT_EQ(slurp(path("two/robots") / robot / "keyframes.txt"), slurp(path("one/keyframes.txt")));
  }
  const auto cloud = cloud::read_cloud(path("two/map.ply"));
  ASSERT_TRUE(cloud);
  EXPECT_EQ(cloud->columns.robot.size(), cloud->cloud->size());
  EXPECT_EQ(slurp(path("two/frames.csv")).substr(0, 27), "frame,state,robot,stamp,key");
  EXPECT_FALSE(fs::exists(path("two/map.db")));
  for (const auto& left : fs::directory_iterator(path("two"))) {
    EXPECT_EQ(left.path().string().find(".db"), std::string::npos) << left.path();
  }

  fs::create_directory(path("ways"));
  fs::copy_file(path("one/trajectory.txt"), path("ways/wall.txt"));
  EXPECT_EQ(run(map + " -o x --set 'poses.file=ways/{robot}.txt'").code, 3) << "other.txt is missing";
  fs::copy_file(path("one/trajectory.txt"), path("ways/other.txt"));
  const Outcome files = run(map + " -o x --set 'poses.file=ways/{robot}.txt'");
  EXPECT_EQ(files.code, 0) << files;
  const Outcome same = run(map + " -o y --set poses.file=ways/wall.txt");
  EXPECT_EQ(same.code, 2) << same;
  EXPECT_TRUE(same.told("{robot}")) << same;
}

TEST_F(MapCommand, AFullDiskIsAnErrorAndLeavesNothing) {
  // The shell's file size limit stands in for the disk's end, in blocks of 1024 bytes (512 in some shells).
  // The store of clouds that wait for their poses takes less than 400 kB, map.ply more than 1 MB.
  const std::string map = std::string("map wall -p known_poses -o out") + kNoPictures;
  const std::map<std::string, std::string> ends = {
      {"ulimit -f 900; ", "map.ply: "}, {"ulimit -f 8; ", "clouds-1.db: cannot be read or written"}};
  for (const auto& [limit, what] : ends) {
    const Outcome o = run(map, limit);
    EXPECT_EQ(o.code, 5) << limit << o;
    EXPECT_TRUE(o.told(what)) << limit << o;
    EXPECT_FALSE(fs::exists(path("out"))) << limit;
    EXPECT_FALSE(fs::exists(path("out.partial"))) << limit;
  }
}

/// Starts the program without a shell, so that its process id is known.
pid_t start(const fs::path& folder, const std::vector<std::string>& arguments) {
  const pid_t child = fork();
  if (child != 0) return child;
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  if (chdir(folder.c_str()) == 0 && std::freopen("err.txt", "w", stderr) != nullptr &&
      std::freopen("out.txt", "w", stdout) != nullptr) {
    execv(PLUMBLINE_PROGRAM, argv.data());
  }
  _exit(127);
}

TEST_F(MapCommand, CtrlCWritesWhatWasMapped) {
  // Seconds of rendering, were it not stopped.
  const pid_t child = start(path("."), {"plumbline", "map", "synth:room?frames=3000&width=160&height=120",
                                        "-o", "out", "-p", "known_poses", "--set", "output.views="});
  ASSERT_GT(child, 0);
  for (int i = 0; i < 3000 && !fs::exists(path("out.partial/config.yaml")); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  kill(child, SIGINT);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0) << slurp(path("err.txt"));
  const nlohmann::json summary = read_json(path("out/summary.json"));
  ASSERT_TRUE(summary.is_object());
  EXPECT_EQ(summary["stopped"], true) << summary;
  EXPECT_GT(summary["frames"]["read"], 0);
  EXPECT_LT(summary["frames"]["read"], 3000);
  EXPECT_TRUE(fs::exists(path("out/map.ply")));
  EXPECT_NE(slurp(path("out.txt")).find("stopped after"), std::string::npos);
  EXPECT_NE(slurp(path("err.txt")).find("stopping"), std::string::npos);

  const Outcome resumed = run(
      "map 'synth:room?frames=3000&width=160&height=120' -o out -p known_poses --set output.views= --resume");
  EXPECT_EQ(resumed.code, 2) << resumed;
  EXPECT_TRUE(resumed.told("was stopped after") && resumed.told("of 3000 frames") && resumed.told("--force"))
      << resumed;
}

TEST_F(MapCommand, AGeneratedWorldIsARecordingToo) {
  const Outcome o =
      run(std::string("map 'synth:room?frames=4&width=160&height=120&seed=3' -o out -p known_poses") +
          kNoPictures);
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_EQ(read_json(path("out/summary.json"))["frames"]["read"], 4);
  const Outcome typo = run("map 'synth:rom?frames=4' -o out2");
  EXPECT_EQ(typo.code, 2) << typo;
  EXPECT_TRUE(typo.told("room")) << typo;
}

TEST_F(MapCommand, AStandardDeviationThatIsNotKnownIsNullAndSaysWhy) {
  const std::vector<std::pair<std::string, std::string>> runs{
      {"frames=4&width=320&height=240'", "the map has fewer than two keyframes"},
      {"frames=40&width=320&height=240' --set refine.accuracy=off", "refine.accuracy is off"}};
  for (const auto& [world, why] : runs) {
    const Outcome o = run("map 'synth:room?" + world + " -o out --force -q" + kNoPictures);
    ASSERT_EQ(o.code, 0) << o;
    const auto summary = read_json(path("out/summary.json"));
    for (const char* name : {"sigma_position_m", "sigma_rotation_rad"}) {
      EXPECT_TRUE(summary["refine"][name]["median"].is_null()) << summary["refine"];
      EXPECT_TRUE(summary["refine"][name]["p90"].is_null()) << summary["refine"];
    }
    EXPECT_EQ(summary["refine"]["sigma_note"], why);
    EXPECT_TRUE(summary["cloud"]["sigma_m"]["median"].is_null()) << summary["cloud"];
  }

  const Outcome page = run("report out -o page.html");
  ASSERT_EQ(page.code, 0) << page;
  EXPECT_NE(slurp(path("page.html")).find("not known: refine.accuracy is off"), std::string::npos);
  const Outcome drawn = run("render out -o sigma.png --color sigma");
  EXPECT_EQ(drawn.code, 2) << drawn;
  EXPECT_TRUE(drawn.told("sigma_note")) << drawn;
}

/// A hand that turns a Kinect fast, back to where it began: landmarks are there twice, some centimetres
/// apart. No frame may be found on the other copy.
TEST_F(MapCommand, AFastTurnTearsNoPath) {
  const char* data = std::getenv("PLUMBLINE_DATA");
  const fs::path recording = fs::path(data == nullptr ? "" : data) / "tum_fr1_rpy_b";
  if (data == nullptr || !fs::is_directory(recording)) GTEST_SKIP() << "PLUMBLINE_DATA has no tum_fr1_rpy_b";

  const Outcome o = run("map '" + recording.string() + "' --from 0.4 -o out -q" + kNoPictures);
  ASSERT_EQ(o.code, 0) << o;
  const Outcome judged = run("evaluate trajectory out '" + recording.string() + "' --json");
  ASSERT_EQ(judged.code, 0) << judged;
  const auto report = nlohmann::json::parse(judged.out);
  EXPECT_EQ(report["matched"], report["poses"]);
  EXPECT_LT(report["rpe"]["per_frame"]["translation_m"]["max"].get<double>(), 0.035);
}

}  // namespace
}  // namespace plumbline::integration
