// SPDX-License-Identifier: BSD-3-Clause
// Filters from shared objects.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <map>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "program.hpp"

namespace plumbline::integration {
namespace {

class Plugins : public ProgramTest {
 protected:
  static std::string plugin(const std::string& name) {
    return " --plugin " + std::string(PLUMBLINE_PLUGINS) + "/" + name + ".so";
  }
  void write_inputs() const {
    write("cloud.xyz", "0 0 1 200 100 50\n1 0 1 10 20 30\n");
    write("chain.yaml", "chain: a\nfilters:\n  - {type: grey, share: 1}\n  - {type: pass_through, max: 3}\n");
  }
};

TEST_F(Plugins, AFilterIsListedDescribedCheckedAndRun) {
  write_inputs();
  const auto list = run("filters list" + plugin("grey"));
  EXPECT_EQ(list.code, 0) << list;
  EXPECT_NE(list.out.find("\ngrey                     Takes the colour out of a cloud.\n"), std::string::npos)
      << list;
  EXPECT_EQ(run("filters list").out.find("grey"), std::string::npos);
  const auto described = run("filters describe grey" + plugin("grey"));
  EXPECT_EQ(described.code, 0) << described;
  EXPECT_NE(described.out.find("share                Share of the colour to remove (default: 1)"),
            std::string::npos)
      << described;
  EXPECT_EQ(run("filters check chain.yaml" + plugin("grey")).code, 0);
  const auto without = run("filters check chain.yaml");
  EXPECT_EQ(without.code, 2);
  EXPECT_TRUE(without.told("chain.yaml:3:12: filters[0].type: 'grey'")) << without;
  EXPECT_TRUE(without.told("; filters of your own are loaded by the program's --plugin FILE.so")) << without;
  EXPECT_TRUE(run("filters describe grey")
                  .told("; filters of your own are loaded by the program's --plugin FILE.so"));
  const auto ran = run("filter chain.yaml cloud.xyz out.pcd" + plugin("grey"));
  EXPECT_EQ(ran.code, 0) << ran;
  EXPECT_NE(ran.out.find("grey"), std::string::npos) << ran;
  // 0.299 * 200 + 0.587 * 100 + 0.114 * 50 = 124
  EXPECT_NE(slurp(path("out.pcd")).find(std::string("\x7c\x7c\x7c", 3)), std::string::npos);
}

TEST_F(Plugins, OptionsOfAPluginAreCheckedLikeAnyOther) {
  write("chain.yaml", "chain: a\nfilters:\n  - type: grey\n    share: 120 %\n    shade: 1\n");
  const auto told = run("filters check chain.yaml" + plugin("grey"));
  EXPECT_EQ(told.code, 2);
  EXPECT_TRUE(told.told("chain.yaml:4:12: filters[0].share")) << told;
  EXPECT_TRUE(told.told("chain.yaml:5:5: filters[0].shade: unknown key")) << told;
  EXPECT_TRUE(told.told("did you mean share?")) << told;
}

TEST_F(Plugins, WhatDoesNotFitIsRefusedWithItsReason) {
  write_inputs();
  write("text.so", "not a shared object\n");
  const std::map<std::string, std::string> reasons = {
      {plugin("foreign"), "is not a Plumbline plugin: it has no plumbline_filter_plugin"},
      {plugin("stranger"),
       "is not a Plumbline plugin: its plumbline_filter_plugin was not made by PLUMBLINE_FILTER_PLUGIN"},
      {plugin("old"), "was built for filter interface 0, this program has"},
      {plugin("other_libraries"), "was built with plumbline 0.0.1, PCL 1.12.1, Eigen alignment 32"},
      {plugin("nothing"), "adds no filters"},
      {plugin("twice"), "filter 'crop_box' is registered twice"},
      {plugin("grey") + plugin("grey"), "filter 'grey' is registered twice"},
      {plugin("none"), "none.so: no such file"},
      {" --plugin text.so", "plugin text.so: cannot be loaded"},
      {" --plugin .", "is not a file"}};
  for (const auto& [flag, reason] : reasons) {
    for (const std::string command : {"filters list", "filters describe range", "filters check chain.yaml",
                                      "filter chain.yaml cloud.xyz out.ply"}) {
      const auto told = run(command + flag);
      EXPECT_EQ(told.code, 2) << command << flag << "\n" << told;
      EXPECT_TRUE(told.told(reason)) << command << flag << "\n" << told;
    }
    EXPECT_FALSE(fs::exists(path("out.ply"))) << flag;
  }
}

TEST_F(Plugins, APipelineUsesThem) {
  write("keyframe.yaml", "chain: keyframe\nfilters:\n  - type: grey\n  - {type: voxel_grid, leaf: 2 cm}\n");
  const std::string command =
      "map 'synth:room?frames=6' -o out --set cloud.filters=" + path("keyframe.yaml").string();
  const auto without = run(command);
  EXPECT_EQ(without.code, 2) << without;
  EXPECT_TRUE(without.told("'grey' is not a filter")) << without;
  EXPECT_TRUE(without.told("; filters of your own are loaded by the program's --plugin FILE.so")) << without;
  const auto mapped = run(command + plugin("grey"));
  EXPECT_TRUE(mapped.code == 0 || mapped.code == 4) << mapped;  // six frames are few
  const auto map = cloud::read_cloud(path("out/map.ply"));
  ASSERT_TRUE(map) << map.error().message << mapped;
  EXPECT_GT(map->cloud->size(), 1000U);
  for (const cloud::Point& p : *map->cloud) ASSERT_TRUE(p.r == p.g && p.g == p.b);
}

TEST_F(Plugins, APipelineWithThemIsChecked) {
  write("mine.yaml",
        "include: rgbd.yaml\nstages:\n  cloud:\n    filters:\n      - {type: grey, share: 2}\n      - type: "
        "grey\n");
  const auto without = run("pipelines check mine.yaml");
  EXPECT_EQ(without.code, 2);
  EXPECT_TRUE(without.told("mine.yaml:6:15: stages.cloud.filters[1].type: 'grey' is not a filter"))
      << without;
  const auto wrong = run("pipelines check mine.yaml" + plugin("grey"));
  EXPECT_EQ(wrong.code, 2);
  EXPECT_TRUE(wrong.told("mine.yaml:5:29: stages.cloud.filters[0].share")) << wrong;
  EXPECT_FALSE(wrong.told("filters[1]")) << wrong;
  write("mine.yaml", "include: rgbd.yaml\nstages:\n  cloud:\n    filters:\n      - type: grey\n");
  EXPECT_EQ(run("pipelines check mine.yaml" + plugin("grey")).code, 0);
  EXPECT_EQ(run("pipelines graph mine.yaml" + plugin("grey")).code, 0);
  EXPECT_NE(run("pipelines schema" + plugin("grey")).out.find("\"grey\""), std::string::npos);
  EXPECT_EQ(run("pipelines schema").out.find("\"grey\""), std::string::npos);
}

}  // namespace
}  // namespace plumbline::integration
