// SPDX-License-Identifier: BSD-3-Clause
// What has changed between two maps of a room: plumbline compare.
#include <fstream>
#include <string>

#include "program.hpp"

namespace plumbline::integration {
namespace {

class Compare : public ProgramTest {
 protected:
  void map(const std::string& world, const std::string& out) const {
    const Outcome mapped = run("map \"synth:room?frames=60&fps=10&width=320&height=240" + world + "\" -o " +
                               out + " -q --set output.views= --set output.pcd=off --set fuse.voxel=2cm");
    ASSERT_EQ(mapped.code, 0) << mapped;
  }
  /// A chair less and a table elsewhere.
  void map_two_days() const {
    std::ofstream(path("edits.yaml")) << "- {remove: chair 19}\n- {move: coffee table, by: [0.3, 0.2]}\n";
    map("", "a");
    map("&changes=" + path("edits.yaml").string(), "b");
  }
};

TEST_F(Compare, TellsWhatWentAndWhatMoved) {
  map_two_days();
  const Outcome o = run("compare a b -o diff --threads 1");
  ASSERT_EQ(o.code, 0) << o;
  const auto summary = read_json(path("diff/summary.json"));
  EXPECT_GE(summary["changes"]["moved"], 1) << o;
  EXPECT_GE(summary["changes"]["vanished"], 1) << o;
  EXPECT_GT(summary["agreement"], 0.7);
  EXPECT_LT(summary["median_limit_m"], 0.01);
  for (const char* file :
       {"changes.ply", "changes.csv", "changes.html", "top.png", "iso.png", "distance.png"})
    EXPECT_GT(slurp(path("diff") / file).size(), 100U) << file;

  // The table's way, 0.36 m, is in the list, and the page flies there.
  const std::string csv = slurp(path("diff/changes.csv"));
  EXPECT_NE(csv.find(",moved,"), std::string::npos) << csv;
  EXPECT_NE(o.out.find("moved by 0.3"), std::string::npos) << o;
  EXPECT_NE(slurp(path("diff/changes.html")).find("data-at="), std::string::npos);

  // The same bytes for any number of threads; an earlier comparison is replaced only on demand.
  ASSERT_EQ(run("compare a b -o again --threads 2 -q").code, 0);
  for (const char* file : {"changes.ply", "changes.csv", "changes.html"})
    EXPECT_EQ(slurp(path("diff") / file), slurp(path("again") / file)) << file;
  EXPECT_EQ(run("compare a b -o diff -q").code, 2);
  EXPECT_EQ(run("compare a b -o diff -q --force --spacing 5cm").code, 0);
}

TEST_F(Compare, CloudsTellShiftsAndNothingAboutFreeSpace) {
  map_two_days();
  const Outcome o = run("compare a/map.ply b/map.ply -o diff");
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_TRUE(o.told("has no map.db")) << o;
  const auto summary = read_json(path("diff/summary.json"));
  EXPECT_EQ(summary["places"]["vanished"], 0);
  EXPECT_GT(summary["places"]["not seen after"], 50);
}

TEST_F(Compare, RefusesWhatDoesNotFit) {
  map("", "a");
  const Outcome mapped =
      run("map \"synth:office?frames=40&fps=10&width=320&height=240\" -o other -q --set output.views= --set "
          "output.pcd=off");
  ASSERT_EQ(mapped.code, 0) << mapped;
  const Outcome o = run("compare a other -o diff");
  EXPECT_EQ(o.code, 4) << o;
  EXPECT_FALSE(std::filesystem::exists(path("diff")));
  EXPECT_EQ(run("compare a nowhere -o diff").code, 3);
  EXPECT_EQ(run("compare a a -o diff --spacing 0").code, 2);
}

}  // namespace
}  // namespace plumbline::integration
