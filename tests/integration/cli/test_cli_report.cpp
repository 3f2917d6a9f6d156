// SPDX-License-Identifier: BSD-3-Clause
// A result as one page: plumbline report.
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <set>

#include "../markup.hpp"
#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

using testing_markup::count_of;
using testing_markup::malformed_at;

class Report : public ProgramTest {
 protected:
  static constexpr const char* kSmall = " --set output.width=200 --set output.height=150 ";

  void map_wall(const std::string& more = "") const {
    write_wall(path("wall"));
    const Outcome o = run("map wall -o out -q --set fuse.voxel=2cm" + std::string(kSmall) + more);
    ASSERT_EQ(o.code, 0) << o;
  }
  /// The page, after it has been made and found sound.
  [[nodiscard]] std::string page(const std::string& arguments,
                                 const std::string& file = "out/report.html") const {
    const Outcome o = run("report " + arguments + " --force", "env -u DISPLAY ");
    EXPECT_EQ(o.code, 0) << o;
    EXPECT_NE(o.out.find(file), std::string::npos) << o;
    const std::string html = slurp(path(file));
    expect_sound(html);
    return html;
  }
  /// With empty pictures: their letters may happen to be words.
  static std::string without_pictures(std::string html) {
    const std::string mark = "image/png;base64,";
    for (std::size_t at = html.find(mark); at != std::string::npos; at = html.find(mark, at + 1)) {
      const std::size_t from = at + mark.size();
      html.erase(from, html.find('"', from) - from);
    }
    return html;
  }
  /// Well-formed, and nothing in it comes from elsewhere; only the map to walk through has scripts.
  static void expect_sound(const std::string& page) {
    const std::string html = without_pictures(page);
    EXPECT_EQ(html.rfind("<!DOCTYPE html>\n<html lang=\"en\">", 0), 0U);
    EXPECT_EQ(malformed_at(html), "");
    for (const char* foreign :
         {"http:", "https:", "//www", "<link", "<iframe", "@import", "url(", "file:", "onload"}) {
      EXPECT_EQ(html.find(foreign), std::string::npos) << foreign;
    }
    const std::size_t viewers = count_of("<div class=\"pv\">", html);
    EXPECT_EQ(count_of("<script>", html), viewers);
    EXPECT_EQ(count_of("<script ", html),
              count_of("class=\"pv-scene\"", html) + count_of("class=\"pv-data\"", html));
    EXPECT_EQ(count_of(" src=\"", html), count_of(" src=\"data:image/png;base64,", html) +
                                             count_of(" src=\"data:image/svg+xml;base64,", html));
    EXPECT_EQ(count_of(" href=\"", html),
              count_of(" href=\"#", html) + count_of(" href=\"data:image/png;base64,", html));
    for (const char* number : {">nan", ",nan", "nan,", "\"nan", " nan ", "inf,", ",inf"}) {
      EXPECT_EQ(html.find(number), std::string::npos) << number;
    }
    EXPECT_NE(html.find("prefers-color-scheme:dark"), std::string::npos);
    EXPECT_NE(html.find("@media print"), std::string::npos);
  }
  /// Every link of the table of contents leads to a section.
  static void expect_links_lead_somewhere(const std::string& html) {
    std::size_t links = 0;
    for (std::size_t at = html.find("href=\"#"); at != std::string::npos;
         at = html.find("href=\"#", at + 1)) {
      const std::string name = html.substr(at + 7, html.find('"', at + 7) - at - 7);
      EXPECT_EQ(count_of("<section id=\"" + name + "\"", html), 1U) << name;
      ++links;
    }
    EXPECT_GT(links, 6U);
  }
  static bool has(const std::string& html, const std::string& text) {
    return html.find(text) != std::string::npos;
  }
};

TEST_F(Report, TellsWhatWasMapped) {
  map_wall();
  const std::string html = page("out");
  expect_links_lead_somewhere(html);
  for (const char* text :
       {"Trustworthy (exit code 0)", "12 of 12 read, 12 tracked", "z up", "Voxel size", "20.0\u202Fmm",
        "Bounding box", "loop to close", "frames.csv", "plumbline 0.", "config.yaml", "type: track"}) {
    EXPECT_TRUE(has(html, text)) << text;
  }
  EXPECT_EQ(count_of("<img ", html), 4U);
  EXPECT_FALSE(has(html, "id=\"merges\"") || has(html, "id=\"accuracy\"") ||
               has(html, "Missing in this report"));
  const std::size_t points = read_json(path("out/summary.json"))["cloud"]["points"];
  ASSERT_GT(points, 1000U);
  EXPECT_TRUE(
      has(html, std::to_string(points / 1000) + "\u202F" + std::to_string(points % 1000 + 1000).substr(1)));
}

TEST_F(Report, HoldsTheMapToWalkThrough) {
  map_wall("--set output.views=top");
  const auto scene_of = [](const std::string& html) {
    const std::string mark = "class=\"pv-scene\">";
    const std::size_t from = html.find(mark) + mark.size();
    return nlohmann::json::parse(html.substr(from, html.find("</script>", from) - from));
  };
  const nlohmann::json scene = scene_of(page("out"));
  const nlohmann::json cloud = scene["clouds"].at(0);
  EXPECT_EQ(cloud["count"], read_json(path("out/summary.json"))["cloud"]["points"]);
  EXPECT_TRUE(scene["up"].get<bool>());
  EXPECT_GE(scene["keyframes"].size(), 1U);
  EXPECT_GE(scene["paths"].at(0)["t"].size(), 2U);
  std::set<std::string> layers;
  for (const auto& layer : cloud["layers"]) layers.insert(layer["key"].get<std::string>());
  EXPECT_EQ(layers, (std::set<std::string>{"confidence", "sigma", "view"}));

  const nlohmann::json thin = scene_of(page("out --points 1000"))["clouds"].at(0);
  EXPECT_LE(thin["count"].get<std::size_t>(), 1000U);
  EXPECT_GT(thin["count"].get<std::size_t>(), 300U);
  EXPECT_EQ(thin["of"], cloud["count"]);

  ASSERT_EQ(run("map wall -o other -q --set fuse.voxel=3cm --set output.views=" + std::string(kSmall)).code,
            0);
  const nlohmann::json two = scene_of(page("out other"))["clouds"];
  ASSERT_EQ(two.size(), 2U);
  EXPECT_EQ(two[1]["name"], "other");
  for (const auto& one : two) EXPECT_EQ(one["layers"].back()["key"], "distance");
  const std::string together = slurp(path("out/report.html"));
  EXPECT_EQ(count_of("out and other are aligned by 12 cameras of the same time", together), 2U)
      << "page and viewer";
  EXPECT_EQ(run("report out nothing --force").code, 3);
}

TEST_F(Report, SameFolderSameBytesHoweverItIsNamed) {
  map_wall();
  const std::string first = page("out");
  EXPECT_EQ(first, page("out"));  // the report does not tell of itself
  EXPECT_EQ(first, page("./out/ --threads 1"));
  EXPECT_EQ(first, page("'" + path("out").string() + "'"));
  EXPECT_EQ(first, page("out -o elsewhere.html", "elsewhere.html"));
  EXPECT_FALSE(has(first, path("").string()));  // no place of this machine
  const fs::path copy = path("moved/out");
  fs::create_directories(copy.parent_path());
  fs::copy(path("out"), copy, fs::copy_options::recursive);
  EXPECT_EQ(first, page("moved/out", "moved/out/report.html"));
}

TEST_F(Report, NamesAreText) {
  const std::string name = "a <b>& \"c\" \xFF d";
  write_wall(path(name));
  const std::string quoted = "'" + name + "'";
  ASSERT_EQ(run("map " + quoted + " -o '<i>&\"out' -q --set output.views=top" + kSmall).code, 0);
  const std::string html = page("'<i>&\"out'", "<i>&\"out/report.html");
  EXPECT_TRUE(has(html, "<h1>&lt;i&gt;&amp;&quot;out</h1>"));
  EXPECT_TRUE(has(html, "a &lt;b&gt;&amp; &quot;c&quot; \xEF\xBF\xBD d"));
  EXPECT_FALSE(has(html, "<b>&") || has(html, "<i>"));
}

TEST_F(Report, AccuracyAgainstTruthAndSavedEvaluations) {
  map_wall("--set output.views=top");
  const std::string html = page("out --truth wall");
  EXPECT_TRUE(has(html, "id=\"accuracy\"") && has(html, "ATE, rmse") && has(html, "12 of 12"));
  EXPECT_EQ(html, page("out --truth wall/groundtruth.txt"));
  EXPECT_EQ(count_of("id=\"accuracy\"", page("out")), 0U);

  ASSERT_EQ(run("evaluate trajectory out wall --json 2>/dev/null >out/evaluation.json; true").code, 0);
  write("out/evaluation_b.json",
        R"({"accuracy_mm": {"median": 1.25, "rmse": 2.5}, "wall_thickness_mm": {"rms": 3.75}})");
  write("out/evaluation_c.json", "{ damaged");
  const std::string saved = page("out");
  EXPECT_TRUE(has(saved, "evaluation.json") && has(saved, "evaluation of a path"));
  EXPECT_TRUE(has(saved, "<td class=\"n\">2.5</td>") && has(saved, "evaluation_c.json is not output"));

  EXPECT_EQ(run("report out --truth nothing --force").code, 3);
  const Outcome empty = run("report out --truth out --force");
  EXPECT_EQ(empty.code, 3) << empty;
  EXPECT_TRUE(empty.told("no groundtruth.txt that fits; looked for out/groundtruth.txt")) << empty;
  write("late.txt", "900 0 0 0 0 0 0 1\n901 1 0 0 0 0 0 1\n902 1 1 0 0 0 0 1\n");
  EXPECT_EQ(run("report out --truth late.txt --force").code, 3);  // no common time
}

TEST_F(Report, LostStretchesComeFirstOfHowItWasMade) {
  write_wall(path("wall"));
  for (int f = 5; f < 9; ++f) {  // covered: these show nothing, and do not count as lost
    cv::imwrite((path("wall/rgb") / frame_name(f)).string(),
                cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar::all(0)));
    cv::imwrite((path("wall/depth") / frame_name(f)).string(),
                cv::Mat(kHeight, kWidth, CV_16UC1, cv::Scalar(0)));
  }
  write("wall/rgb/" + frame_name(10), "no picture");
  const Outcome mapped = run("map wall -o out -q --set output.views=top" + std::string(kSmall));
  ASSERT_EQ(mapped.code, 4) << mapped;
  const std::string html = page("out");
  EXPECT_TRUE(has(html, "Not trustworthy (exit code 4)") && has(html, "1 of 8 frames have no pose"));
  const std::size_t stretches = html.find("Stretches without a pose");
  ASSERT_NE(stretches, std::string::npos);
  EXPECT_GT(stretches, html.find("How it was made")) << "the first page is for a client";
  const std::string cell = "</td><td class=\"n\">";
  EXPECT_TRUE(has(html, "0.17" + cell + "0.30" + cell + "4" + cell + "4" + cell + "0"))
      << html.substr(stretches, 1500);
  EXPECT_TRUE(has(html, "0.33" + cell + "0.37" + cell + "1" + cell + "0" + cell + "1"))
      << html.substr(stretches, 1500);
  EXPECT_TRUE(has(html, "class=\"band-lost\"") && has(html, "class=\"band-unreadable\""));
}

TEST_F(Report, TellsOfSeveralRobots) {
  ASSERT_EQ(
      run("synth room -o world --frames 60 --fps 10 --width 320 --height 240 --reference-spacing 10cm -q")
          .code,
      0);
  const std::string lean = " -q --set output.views= --set output.pcd=off --set fuse.voxel=3cm ";
  ASSERT_EQ(run("map world/robot0 -o a --to 3.5" + lean).code, 0);
  ASSERT_EQ(run("map world/robot0 -o b --from 1.5" + lean).code, 0);
  const Outcome fused = run("fuse a b -o out --set merge.min_pairs=3" + lean);
  ASSERT_EQ(fused.code, 0) << fused;
  const std::string html = page("out --truth world/robot0");
  for (const char* text : {"id=\"merges\"", "Evidence: ", "all, one alignment", "Robots</th><td>a, b",
                           "Points by the robot that saw them most", "Fit of the finished map",
                           "adjusted together", "why pairs of keyframes were refused"}) {
    EXPECT_TRUE(has(html, text)) << text;
  }
  EXPECT_EQ(count_of("class=\"line loop\"", html), 2U);  // curve and legend
  EXPECT_EQ(count_of("<img ", html), 4U);                // the plan, and pictures: the folder has none
  EXPECT_FALSE(has(html, "Missing in this report") || has(html, "id=\"tracking\""));
}

TEST_F(Report, WhatIsMissingIsTold) {
  map_wall("--set output.views=");
  const std::string drawn = page("out");
  EXPECT_EQ(count_of("<img ", drawn), 4U);
  EXPECT_EQ(drawn, page("out"));
  write("out/trajectory.txt", "10 nan 0 0 0 0 0 1\n");
  write("out/timing.csv", "frame,stamp\n0,1,2\n");
  for (const char* file : {"frames.csv", "map.db", "keyframes.txt"}) fs::remove(path("out") / file);
  const Outcome less = run("report out --force");
  EXPECT_EQ(less.code, 0) << less;
  for (const char* told : {"frames.csv is not there", "timing.csv is damaged: line 2 has 3 columns of 2",
                           "keyframes.txt is not there", "trajectory.txt:1"}) {
    EXPECT_TRUE(less.told(told)) << less;
    EXPECT_TRUE(has(slurp(path("out/report.html")), told)) << told;
  }
  write("out/map.ply", "ply\n");
  fs::remove(path("out/map.pcd"));
  fs::create_directories(path("out/snapshots"));
  write("out/snapshots/top.png", "no picture");
  const std::string least = page("out");
  EXPECT_TRUE(has(least, "map.ply is damaged") && has(least, "snapshots/top.png is damaged"));
  EXPECT_EQ(count_of("<img ", least), 0U);
  write("out/map.ply", "");
  write("out/config.yaml", "");
  write("out/summary.json",
        R"({"frames": {"read": null, "lost": "x"}, "trustworthy": true, "merges": 3, "loops": []})");
  EXPECT_TRUE(has(page("out"), "\u2013"));  // a dash for what is not known
}

TEST_F(Report, OfARobotsMapMissesNothing) {
  write_wall(path("wall"));
  ASSERT_EQ(run("map wall -o out -q -p robot").code, 0);
  const Outcome o = run("report out");
  EXPECT_EQ(o.code, 0) << o;
  EXPECT_FALSE(o.told("warning")) << o;
  EXPECT_TRUE(o.told("its pipeline robot has no stage output")) << o;
  const std::string html = page("out");
  EXPECT_TRUE(has(html, "Only map.db"));
  EXPECT_FALSE(has(html, "Missing in this report"));
}

TEST_F(Report, RefusesWhatIsNoResult) {
  map_wall("--set output.views=top");
  EXPECT_EQ(run("report nothing").code, 3);
  EXPECT_EQ(run("report wall").code, 3);
  EXPECT_EQ(run("report out/map.ply").code, 3);
  EXPECT_EQ(run("report").code, 2);
  for (const char* damaged : {"", "{ \"frames\": ", "[]", "{}", "null"}) {
    write("out/summary.json", damaged);
    const Outcome o = run("report out");
    EXPECT_EQ(o.code, 3) << damaged << o;
    EXPECT_TRUE(o.told("summary.json: is damaged")) << o;
    EXPECT_EQ(count_of("\n", o.err), 1U) << o;
  }
  EXPECT_FALSE(fs::exists(path("out/report.html")));
  fs::create_directories(path("killed.partial"));
  fs::copy(path("out/map.db"), path("killed.partial/map.db"));
  write("killed.partial/.plumbline-unfinished", "");
  for (const char* folder : {"killed", "killed.partial"}) {
    const Outcome killed = run(std::string("report ") + folder);
    EXPECT_EQ(killed.code, 3) << killed;
    EXPECT_TRUE(killed.told("interrupted") && killed.told("--resume")) << killed;
  }

  // While its run goes on, it has the marker locked.
  const int marker = open(path("killed.partial/.plumbline-unfinished").c_str(), O_RDONLY);
  ASSERT_EQ(flock(marker, LOCK_EX), 0);
  for (const char* folder : {"killed", "killed.partial"}) {
    const Outcome running = run(std::string("report ") + folder);
    EXPECT_EQ(running.code, 3) << running;
    EXPECT_TRUE(running.told("the run is still going on; report when it has ended")) << running;
  }
  close(marker);
}

TEST_F(Report, OnlyReportsAreReplaced) {
  map_wall("--set output.views=top");
  ASSERT_EQ(run("report out -q").code, 0);
  const std::string first = slurp(path("out/report.html"));
  const Outcome again = run("report out");
  EXPECT_EQ(again.code, 2) << again;
  EXPECT_TRUE(again.told("earlier report") && again.told("--force")) << again;
  EXPECT_EQ(run("report out --force -q").code, 0);
  write("mine.html", "<!DOCTYPE html><p>not yours</p>");
  EXPECT_EQ(run("report out -o mine.html --force").code, 2);
  EXPECT_EQ(run("report out -o wall --force").code, 2);
  EXPECT_EQ(slurp(path("mine.html")), "<!DOCTYPE html><p>not yours</p>");
  EXPECT_EQ(run("report out -o nowhere/r.html").code, 5);
  EXPECT_EQ(run("report out -o /proc/r.html").code, 5);
  const Outcome full = run("report out --force", "ulimit -f 16; ");
  EXPECT_EQ(full.code, 5) << full;
  EXPECT_EQ(slurp(path("out/report.html")), first);  // as it was, and nothing half-done beside it
  for (const auto& entry : fs::directory_iterator(path("out"))) {
    EXPECT_NE(entry.path().filename().string().front(), '.') << entry.path();
  }
  EXPECT_EQ(run("report out -o /dev/stdout -q | cat >piped.html; true").code, 0);
  EXPECT_EQ(slurp(path("piped.html")), first);
}

}  // namespace
}  // namespace plumbline::integration
