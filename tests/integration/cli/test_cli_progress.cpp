// SPDX-License-Identifier: BSD-3-Clause
// Progress, versions and the manual.
#include <algorithm>
#include <sstream>
#include <vector>

#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

class Progress : public ProgramTest {
 protected:
  Progress() { write_wall(path("wall")); }

  /// Objects among the lines of stderr.
  static std::vector<nlohmann::json> objects(const std::string& text) {
    std::vector<nlohmann::json> found;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (line.empty() || line.front() != '{') continue;
      found.push_back(nlohmann::json::parse(line));
    }
    return found;
  }
};

TEST_F(Progress, ProgramsGetObjects) {
  const Outcome o = run("map wall -o out -p known_poses --progress json --set output.views=");
  ASSERT_EQ(o.code, 0) << o;
  const std::vector<nlohmann::json> told = objects(o.err);
  ASSERT_GE(told.size(), 3U) << o;

  const auto last =
      std::find_if(told.rbegin(), told.rend(), [](const auto& t) { return t["event"] == "progress"; });
  ASSERT_NE(last, told.rend()) << o;
  EXPECT_EQ((*last)["what"], "frames");
  EXPECT_EQ((*last)["done"], 12);
  EXPECT_EQ((*last)["total"], 12);
  EXPECT_EQ((*last)["seconds_left"], 0.0);
  EXPECT_GT((*last)["per_second"], 0.0);

  std::string steps;
  for (const nlohmann::json& t : told) {
    if (t["event"] == "step") steps += t["what"].get<std::string>() + ";";
  }
  EXPECT_NE(steps.find("fuse;"), std::string::npos) << o;
  EXPECT_NE(steps.find("output"), std::string::npos) << o;
}

TEST_F(Progress, LogsGetLinesAndQuietRunsNothing) {
  const Outcome lines = run("map wall -o out -p known_poses --set output.views=");
  EXPECT_TRUE(lines.told("plumbline: 12 of 12 frames, ")) << lines;
  EXPECT_TRUE(lines.told("plumbline: finishing: fuse\n")) << lines;
  const Outcome views = run("export out -o model.obj --mesh");
  EXPECT_FALSE(views.told("a second")) << "there is no rate of things that are not frames" << views;
  EXPECT_TRUE(objects(lines.err).empty()) << lines;
  EXPECT_EQ(lines.err.find('\r'), std::string::npos) << lines;

  const Outcome none = run("map wall -o out -p known_poses --force --progress none --set output.views=");
  EXPECT_FALSE(none.told("12 of 12")) << none;
  EXPECT_FALSE(none.told("finishing")) << none;
  const Outcome quiet = run("map wall -o out -p known_poses --force -q --progress json --set output.views=");
  EXPECT_EQ(quiet.err, "") << quiet;
}

TEST_F(Progress, OneLineIsRewrittenOnATerminal) {
  const Outcome o = run("--version >/dev/null; script -qec '" PLUMBLINE_PROGRAM
                        " map wall -o out -p known_poses --set output.views=' typescript >/dev/null");
  ASSERT_EQ(o.code, 0) << o;
  const std::string shown = slurp(path("typescript"));
  EXPECT_NE(shown.find("12/12 frames"), std::string::npos) << shown;
  EXPECT_NE(shown.find("\r\033[Kfinishing: "), std::string::npos) << shown;
  EXPECT_EQ(shown.find("plumbline: 12 of 12"), std::string::npos) << shown;
}

TEST_F(Progress, VersionTellsLibrariesAndFormats) {
  const Outcome o = run("--version");
  EXPECT_EQ(o.out.rfind("plumbline 0.", 0), 0U) << o;
  for (const char* library : {"PCL 1.", "Ceres 2.", "OpenCV 4.", "VTK 9.", "CycloneDDS 0.", "map.db format "})
    EXPECT_NE(o.out.find(library), std::string::npos) << library << o;
}

TEST_F(Progress, ManualAndCompletionOfOthersAreRefused) {
  const Outcome page = run("man evaluate cloud");
  EXPECT_EQ(page.out.rfind(".TH PLUMBLINE", 0), 0U) << page;
  EXPECT_NE(page.out.find("\\fB\\-\\-trajectory\\fR"), std::string::npos) << page;
  const Outcome unknown = run("man fly");
  EXPECT_EQ(unknown.code, 2) << unknown;
  EXPECT_TRUE(unknown.told("'fly'")) << unknown;
  EXPECT_EQ(run("completion tcsh").code, 2);
}

}  // namespace
}  // namespace plumbline::integration
