// SPDX-License-Identifier: BSD-3-Clause
// Output folders: what users put beside or into them is never lost, whenever that is.
#include <string>

#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

const char* const kWithoutPictures = " -q --set output.views= --set output.pcd=off --set fuse.voxel=20mm";
/// Slow enough for something to happen meanwhile.
const char* const kSlow = " --pace 15";

class OutputFolderOfARun : public ProgramTest {
 protected:
  OutputFolderOfARun() {
    WallRecording recording;
    recording.frames = 30;
    write_wall(path("wall"), recording);
  }
  /// Runs the program, and `commands` beside it as soon as `file` is there.
  [[nodiscard]] Outcome run_beside(const std::string& arguments, const std::string& file,
                                   const std::string& commands) const {
    return run(arguments, "{ (while [ ! -e '" + file + "' ]; do sleep 0.01; done; " + commands +
                              ") >beside.txt 2>&1 & } && ");
  }
};

TEST_F(OutputFolderOfARun, WhatAppearsWhileItMapsIsKept) {
  const Outcome o = run_beside(std::string("map wall -o out") + kWithoutPictures + kSlow,
                               "out.partial/map.db", "mkdir out; echo mine >out/notes.txt");
  EXPECT_EQ(o.code, 5) << o;
  EXPECT_TRUE(o.told("out.partial")) << o;
  EXPECT_EQ(slurp(path("out/notes.txt")), "mine\n");
  EXPECT_TRUE(fs::exists(path("out.partial/summary.json")));

  // The result waits until there is room for it.
  const std::string resume = std::string("map wall -o out --resume") + kWithoutPictures;
  EXPECT_EQ(run(resume).code, 5);
  fs::rename(path("out"), path("mine"));
  const Outcome fresh = run(std::string("map wall -o out") + kWithoutPictures);
  EXPECT_EQ(fresh.code, 2) << fresh;
  EXPECT_TRUE(fresh.told("holds a complete result") && fresh.told("--resume")) << fresh;
  ASSERT_EQ(run(resume).code, 0);
  EXPECT_EQ(read_json(path("out/summary.json"))["frames"]["tracked"], 30);
  EXPECT_FALSE(fs::exists(path("out.partial")));
}

TEST_F(OutputFolderOfARun, FilesThatUsersPutIntoAResultAreKept) {
  const std::string map = std::string("map wall -o out") + kWithoutPictures +
                          " --set 'output.exports=[room.las, {file: model, format: colmap}]'";
  ASSERT_EQ(run(map).code, 0);
  ASSERT_EQ(run("report out -q").code, 0);
  fs::create_directories(path("out/photos"));
  write("out/photos/desk.jpg", "mine");
  const Outcome refused = run(map + " --force");
  EXPECT_EQ(refused.code, 2) << refused;
  EXPECT_TRUE(refused.told("with it: photos/desk.jpg; move")) << refused;
  EXPECT_EQ(slurp(path("out/photos/desk.jpg")), "mine");

  fs::rename(path("out/photos"), path("photos"));
  const Outcome replaced = run(map + " --force");
  EXPECT_EQ(replaced.code, 0) << replaced;
  EXPECT_FALSE(fs::exists(path("out/report.html"))) << "it was of the earlier result";
  EXPECT_TRUE(fs::exists(path("out/room.las")) && fs::exists(path("out/model/sparse/0/cameras.bin")));
  EXPECT_FALSE(fs::exists(path("out.replaced")));
}

TEST_F(OutputFolderOfARun, ThatIsRemovedIsAnOutputError) {
  for (const char* commands : {"rm -r out.partial", "mv out.partial moved"}) {
    const Outcome o =
        run_beside(std::string("map wall -o out") + kWithoutPictures + kSlow, "out.partial/map.db", commands);
    EXPECT_EQ(o.code, 5) << commands << o;
    EXPECT_TRUE(o.told("was removed or moved away")) << commands << o;
    EXPECT_FALSE(fs::exists(path("out"))) << commands;
    fs::remove_all(path("out.partial"));
  }
  EXPECT_TRUE(fs::exists(path("moved/map.db")));
}

TEST_F(OutputFolderOfARun, AFusionKeepsWhatAppearsAsWell) {
  ASSERT_EQ(run(std::string("map wall -o a") + kWithoutPictures).code, 0);
  fs::copy(path("a"), path("b"), fs::copy_options::recursive);
  const Outcome o = run_beside("fuse a b -o out -q --set output.views=iso", "out.partial/config.yaml",
                               "mkdir out; echo mine >out/notes.txt");
  EXPECT_EQ(o.code, 5) << o;
  EXPECT_EQ(slurp(path("out/notes.txt")), "mine\n");
  EXPECT_TRUE(fs::exists(path("out.partial/summary.json"))) << "complete";
}

TEST_F(OutputFolderOfARun, FewFilesOrLittleMemoryAreNoFaultOfTheInput) {
  const Outcome files = run(std::string("map wall -o out") + kWithoutPictures,
                            "prlimit --nofile=8 ");  // the shell itself needs more
  EXPECT_EQ(files.code, 5) << files;
  EXPECT_TRUE(files.told("ulimit -n")) << files;

  // Address spaces from hardly enough to start with to nearly enough.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  for (const std::string mb : {"250", "300", "500"}) {
    const Outcome o = run("map wall -o out --threads 1 --force" + std::string(kWithoutPictures),
                          "ulimit -v " + mb + "000; ");
    const bool not_started = o.code == 127;  // the dynamic linker's own words
    EXPECT_TRUE(o.code == 0 || o.code == 5 || not_started) << mb << o;
    EXPECT_TRUE(o.code != 5 || o.told("not enough memory") || o.told("no further thread")) << mb << o;
    EXPECT_FALSE(o.told("install") || o.told("damaged") || o.told("report it")) << mb << o;
  }
#endif
}

}  // namespace
}  // namespace plumbline::integration
