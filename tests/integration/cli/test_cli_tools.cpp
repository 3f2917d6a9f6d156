// SPDX-License-Identifier: BSD-3-Clause
// The commands around map: help, info, render, export, evaluate, synth, filter, pipelines.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

class Tools : public ProgramTest {
 protected:
  void map_wall() {
    write_wall(path("wall"));
    const Outcome o = run("map wall -o out -p known_poses -q --set output.views= --set fuse.voxel=2cm");
    ASSERT_EQ(o.code, 0) << o;
  }
  [[nodiscard]] std::size_t points(const std::string& file) const {
    const auto read = cloud::read_cloud(path(file));
    return read ? read->cloud->size() : 0;
  }
};

TEST_F(Tools, HelpAndVersionEverywhere) {
  for (const char* command :
       {"", "map", "info", "render", "report", "export", "evaluate", "evaluate trajectory", "evaluate cloud",
        "synth", "filter", "filters", "filters list", "filters describe", "filters check", "pipelines",
        "pipelines list", "pipelines check"}) {
    const Outcome help = run(std::string(command) + " --help");
    EXPECT_EQ(help.code, 0) << command;
    EXPECT_NE(help.out.find("Usage"), std::string::npos) << command;
    EXPECT_EQ(help.err, "") << command;
  }
  for (const char* command : {"", "map", "evaluate", "evaluate cloud"}) {
    const Outcome version = run(std::string(command) + " --version");
    EXPECT_EQ(version.code, 0) << command;
    EXPECT_EQ(version.out.rfind("plumbline ", 0), 0U) << command << version;
  }
}

TEST_F(Tools, InfoOfRecordingMapAndCloud) {
  map_wall();
  const Outcome recording = run("info wall");
  EXPECT_EQ(recording.code, 0) << recording;
  EXPECT_NE(recording.out.find("tum"), std::string::npos) << recording;
  EXPECT_NE(recording.out.find("12"), std::string::npos) << recording;
  const Outcome map = run("info out");
  EXPECT_EQ(map.code, 0) << map;
  EXPECT_NE(map.out.find("frames.tracked: 12"), std::string::npos) << map;
  const Outcome cloud = run("info out/map.pcd");
  EXPECT_EQ(cloud.code, 0) << cloud;
  EXPECT_NE(cloud.out.find("points: " + std::to_string(points("out/map.ply"))), std::string::npos) << cloud;
  const Outcome path_info = run("info out/trajectory.txt");
  EXPECT_EQ(path_info.code, 0) << path_info;
  EXPECT_EQ(path_info.out.rfind("poses: 12\nfrom: 10.000000 s\n", 0), 0U) << path_info;
  EXPECT_EQ(run("info nothing").code, 3);
}

TEST_F(Tools, InfoOfAResultIsAPage) {
  map_wall();
  nlohmann::json summary = read_json(path("out/summary.json"));
  for (int i = 0; i < 500; ++i)
    summary["loops"]["list"].push_back({{"from", i}, {"to", i + 1}, {"off_m", 0.25}});
  std::string reason = "because";
  for (int i = 0; i < 60; ++i) reason += " of this";
  summary["reason"] = reason;
  write("out/summary.json", summary.dump());

  const Outcome page = run("info out");
  ASSERT_EQ(page.code, 0) << page;
  EXPECT_NE(page.out.find("loops.list: 500 entries: from, off_m, to\n"), std::string::npos) << page;
  EXPECT_NE(page.out.find("\nreason: because of this"), std::string::npos) << page;
  std::istringstream lines(page.out);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120U) << line;

  const Outcome all = run("info out --json");
  EXPECT_EQ(all.code, 0) << all;
  EXPECT_EQ(nlohmann::json::parse(all.out), summary);
  EXPECT_EQ(run("info out --format json").out, all.out);
  EXPECT_EQ(run("info out/map.ply --json").code, 2);

  write("out/summary.json", "{\"frames\": " + std::string(100000, '[') + "}");
  for (const char* command : {"info out", "info out --json", "report out"}) {
    const Outcome deep = run(command);
    EXPECT_EQ(deep.code, 3) << deep;
    EXPECT_TRUE(deep.told("summary.json:1:75: lists and objects nested deeper than 64 levels")) << deep;
  }
}

TEST_F(Tools, RenderNeedsNoDisplay) {
  map_wall();
  for (const char* input : {"out", "out/map.ply", "out/map.pcd"}) {
    const Outcome o =
        run(std::string("render ") + input + " -o shot.png --view top --size 320x200", "env -u DISPLAY ");
    ASSERT_EQ(o.code, 0) << o;
    const cv::Mat shot = cv::imread(path("shot.png").string());
    EXPECT_EQ(shot.size(), cv::Size(320, 200));
    fs::remove(path("shot.png"));
  }
  EXPECT_EQ(run("render out -o shot.png --view tpo").code, 2);
  EXPECT_EQ(run("render out -o shot.jpg").code, 2);
  EXPECT_EQ(run("render nothing -o shot.png").code, 3);
  EXPECT_EQ(run("render wall -o shot.png").code, 3);
  EXPECT_EQ(run("render out -o nowhere/shot.png").code, 5);
  EXPECT_EQ(run("render out -o shot.png --color error").code, 2);
}

TEST_F(Tools, ExportsCloudPathAndLines) {
  map_wall();
  EXPECT_EQ(run("export out -o c.pcd").code, 0);
  EXPECT_EQ(run("export out -o c.ply").code, 0);
  EXPECT_EQ(points("c.pcd"), points("out/map.ply"));
  EXPECT_EQ(points("c.ply"), points("out/map.ply"));
  EXPECT_EQ(run("export out --what trajectory -o t.txt").code, 0);
  const auto rows = [&](const char* file) {  // comments above them differ
    const std::string text = slurp(path(file));
    return text.substr(text.find("\n10."));
  };
  EXPECT_EQ(rows("t.txt"), rows("out/trajectory.txt"));
  EXPECT_EQ(run("export out --what keyframes -o k.ply").code, 0);
  EXPECT_EQ(run("export out --what lines -o l.ply").code, 0);
  EXPECT_EQ(run("export out -o c.obj").code, 0);  // a mesh
  EXPECT_EQ(run("export wall -o c.ply").code, 3);
  EXPECT_EQ(run("export out/map.ply -o again.pcd").code, 0);  // a cloud by itself
  EXPECT_EQ(points("again.pcd"), points("out/map.ply"));
  EXPECT_EQ(run("export out/map.ply --what trajectory -o t.txt").code, 2);
  const Outcome file = run("export out/summary.json -o c.ply");
  EXPECT_EQ(file.code, 3);
  EXPECT_TRUE(file.told("out/summary.json: is a file; give the result folder")) << file;
}

TEST_F(Tools, EvaluateTellsWhatIsThere) {
  map_wall();
  const Outcome text = run("evaluate trajectory out wall/groundtruth.txt");
  EXPECT_EQ(text.code, 0) << text;
  const Outcome json =
      run("evaluate trajectory out/trajectory.txt wall --frames wall/rgb.txt --json --align none");
  ASSERT_EQ(json.code, 0) << json;
  const auto report = nlohmann::json::parse(json.out);
  EXPECT_LT(report["ate_m"]["rmse"], 1e-5);
  EXPECT_EQ(report["tracked_percent"], 100.0);
  EXPECT_EQ(run("evaluate trajectory out nothing.txt").code, 3);
  write("later.txt", "900 0 0 0 0 0 0 1\n901 0 0 0 0 0 0 1\n902 0 0 0 0 0 0 1\n");
  const Outcome later = run("evaluate trajectory out later.txt");
  EXPECT_EQ(later.code, 3) << later;
  EXPECT_TRUE(later.told("out/trajectory.txt against later.txt: ")) << later;
  EXPECT_EQ(run("evaluate trajectory out wall --align so3").code, 2);
  const Outcome plots = run("evaluate trajectory out wall --plot charts");
  EXPECT_EQ(plots.code, 0) << plots;
  EXPECT_FALSE(fs::is_empty(path("charts")));

  const Outcome cloud = run("evaluate cloud out out/map.ply --json");
  ASSERT_EQ(cloud.code, 0) << cloud;
  EXPECT_LT(nlohmann::json::parse(cloud.out)["accuracy_mm"]["rmse"], 1.0) << cloud;
  EXPECT_EQ(run("evaluate cloud out").code, 0);
  EXPECT_EQ(run("evaluate cloud out out/map.ply --trajectory out/trajectory.txt").code, 2);
  const std::string start =
      "evaluate cloud out out/map.ply --json --trajectory out --truth out/trajectory.txt";
  EXPECT_EQ(nlohmann::json::parse(run(start).out)["alignment"]["type"], "se3");
  EXPECT_EQ(nlohmann::json::parse(run(start + " --align none").out)["alignment"]["type"], "none");

  std::string far;
  for (int i = 0; i < 400; ++i)
    far += "90." + std::to_string(100 + i % 20) + " 0." + std::to_string(100 + i / 20) + " 90\n";
  write("far.xyz", far);
  const Outcome failed = run("evaluate cloud out far.xyz --align se3");
  EXPECT_EQ(failed.code, 4) << failed;
  EXPECT_NE(failed.out.find("overlap 0.0 %"), std::string::npos) << failed;
  EXPECT_TRUE(failed.told("could not be aligned with far.xyz")) << failed;
}

TEST_F(Tools, SynthWritesARecordingThatMaps) {
  const Outcome o = run("synth room -o world --frames 3 --width 160 --height 120 --reference-spacing 10cm");
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_TRUE(fs::exists(path("world/reference.ply")));
  EXPECT_EQ(run("synth room -o world").code, 2);
  EXPECT_EQ(run("synth room -o other --texture velvet").code, 2);
  EXPECT_EQ(run("map world/robot0 -o out -p known_poses -q --set output.views=").code, 0);
}

TEST_F(Tools, FilterRunsAChainAndTellsWhatItDid) {
  map_wall();
  write("chain.yaml", "chain: coarse\nfilters:\n  - type: voxel_grid\n    leaf: 10 cm\n");
  const Outcome o = run("filter chain.yaml out/map.ply coarse.pcd");
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_NE(o.out.find("voxel_grid"), std::string::npos) << o;
  EXPECT_LT(points("coarse.pcd"), points("out/map.ply"));
  EXPECT_GT(points("coarse.pcd"), 0U);
  write("bad.yaml", "chain: bad\nfilters:\n  - type: voxel_gird\n");
  const Outcome bad = run("filter bad.yaml out/map.ply x.ply");
  EXPECT_EQ(bad.code, 2) << bad;
  EXPECT_TRUE(bad.told("bad.yaml:3:")) << bad;
  EXPECT_EQ(run("filter chain.yaml nothing.ply x.ply").code, 3);
  EXPECT_EQ(run("filter chain.yaml out/map.ply x.obj").code, 2);
}

TEST_F(Tools, ResultsRecordingsAndInputsAreNotWrittenOver) {
  map_wall();
  write("chain.yaml", "chain: coarse\nfilters:\n  - type: voxel_grid\n    leaf: 10 cm\n");
  fs::create_directories(path("out/robots/a"));
  write("out/robots/a/trajectory.txt", "as if of a robot\n");
  fs::copy_file(path("out/map.ply"), path("in.ply"));
  fs::create_symlink("out/map.ply", path("link.ply"));
  const std::string map = slurp(path("out/map.ply"));
  const std::string truth = slurp(path("wall/groundtruth.txt"));
  for (const char* arguments :
       {"export out -o out/map.ply", "export out -o link.ply", "export in.ply -o in.ply",
        "export out --what trajectory -o out/trajectory.txt",
        "export out --what trajectory -o wall/groundtruth.txt",
        "export out --what trajectory -o out/robots/a/trajectory.txt", "export out -o out/config.pgm",
        "filter chain.yaml in.ply in.ply", "filter chain.yaml in.ply out/map.ply",
        "filter chain.yaml in.ply out/map.pcd", "render out -o wall/rgb/000.png"}) {
    const Outcome refused = run(arguments);
    EXPECT_EQ(refused.code, 2) << arguments << refused;
    EXPECT_TRUE(refused.told("choose another name")) << arguments << refused;
  }
  EXPECT_TRUE(slurp(path("out/map.ply")) == map && slurp(path("in.ply")) == map);
  EXPECT_EQ(slurp(path("wall/groundtruth.txt")), truth);

  // New names in these folders may be written, and written again.
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(run("filter chain.yaml out/map.ply out/thin.ply").code, 0);
    EXPECT_EQ(run("export out -o out/thin.pcd").code, 0);
  }
}

TEST_F(Tools, StandardOutputThatCannotBeWrittenIsAnError) {
  write("a.xyz", "0 0 1\n0 1 1\n");
  for (const char* arguments : {"--help", "map --help", "--version", "filters list", "filters describe",
                                "pipelines schema", "completion bash", "man map", "info a.xyz"}) {
    const Outcome full = run(std::string(arguments) + " >/dev/full 2>err.txt; exit $?; :");
    EXPECT_EQ(full.code, 5) << arguments << full;
    EXPECT_TRUE(full.told("standard output: cannot be written (No space left on device)"))
        << arguments << full;
  }
  EXPECT_EQ(run("filters describe 2>said.txt | true").code, 0);
  EXPECT_EQ(slurp(path("said.txt")), "") << "a reader that closes its pipe wants no more";
}

TEST_F(Tools, TypingErrorsAreToldWithWhatIsNear) {
  const auto told = [&](const std::string& arguments, const std::string& text) {
    const Outcome o = run(arguments);
    EXPECT_EQ(o.code, 2) << arguments << o;
    EXPECT_EQ(o.err.rfind("plumbline: error: ", 0), 0U) << arguments << o;
    EXPECT_TRUE(o.told(text)) << arguments << o;
  };
  told("", "a command is required");
  told("mpa wall -o out", "there is no command 'mpa'; did you mean map?");
  told("evaluate trajctory a b", "did you mean trajectory?");
  told("map wall -o out --voxel 2cm", "there is no option --voxel");
  told("map wall -o out --voxel=2cm", "--set STAGE.OPTION=VALUE");
  told("render out --ouput x.png", "did you mean --output?");
  told("report a b c d e f", "one argument too many");
  told("map wall", "--output is required");
  told("map wall -o out --poses some", "'some' (allowed: given, ignore, prior)");
  told("render a.xyz -o a.png --size 80x60 --width 70", "give only one of them");
  told("render a.xyz -o a.png --size 1000000x1000000", "64 to 8192 pixels");
  write("a.xyz", "0 0 1\n0 1 1\n");
  told("view a.xyz --http no-such-host.invalid", "there is no host no-such-host.invalid");
  told("view a.xyz --http 192.0.2.1:8080", "is not an address of this machine");

  const std::string help = run("map --help").out;
  for (const char* text : {"--poses prior|given|ignore  Poses", "--pace HZ (0 to 1000)", "--for S (above 0)",
                           "--threads N (1 to 256)", "--from S (0 or more)", "--format auto|tum|"})
    EXPECT_NE(help.find(text), std::string::npos) << text << "\n" << help;
}

TEST_F(Tools, ShippedPipelinesAndFiltersHaveNothingWrong) {
  const fs::path shipped = fs::path(PLUMBLINE_SOURCE_DIR) / "pipelines";
  const Outcome list = run("pipelines list");
  EXPECT_EQ(list.code, 0);
  for (const auto& entry : fs::directory_iterator(shipped)) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string name = entry.path().stem().string();
    EXPECT_NE(list.out.find(name), std::string::npos);
    const Outcome check = run("pipelines check " + name);
    EXPECT_EQ(check.code, 0) << check;
  }
  for (const auto& entry : fs::directory_iterator(shipped / "filters")) {
    if (entry.path().extension() != ".yaml") continue;
    const Outcome check = run("filters check " + entry.path().stem().string());
    EXPECT_EQ(check.code, 0) << check;
  }
  EXPECT_EQ(run("filters check examples/voxel_grid").code, 0);
  EXPECT_EQ(run("filters check examples").code, 2);  // a folder
  const Outcome filters = run("filters list");
  EXPECT_NE(filters.out.find("voxel_grid"), std::string::npos) << filters;
  EXPECT_EQ(run("filters describe voxel_grid").code, 0);
  EXPECT_EQ(run("filters describe voxel_gird").code, 2);
}

}  // namespace
}  // namespace plumbline::integration
