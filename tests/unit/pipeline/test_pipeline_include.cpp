// SPDX-License-Identifier: BSD-3-Clause
// Pipelines that begin with another file's stages.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "plumbline/pipeline/graph.hpp"
#include "test_pipeline_toys.hpp"

namespace plumbline::pipeline {
namespace {

namespace fs = std::filesystem;

const char* const kBase = R"(description: base
stages:
  count: {type: count, n: 7}
  twice:
    type: scale
    inputs: {number: count}
    by: 3
    late: on
  sum: {type: sum, inputs: {number: twice}}
  collect: {type: collect, inputs: {total: sum}}
)";

class Include : public testing::Test {
 protected:
  Include() : folder_(fs::path(testing::TempDir()) / ("plumbline_include_" + std::to_string(getpid()))) {
    toys::register_toys(registry_, bench_);
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "shipped");
    write("base.yaml", kBase);
  }
  ~Include() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  core::Result<Graph> load(const std::string& text, const std::vector<std::string>& overrides = {}) {
    write("own.yaml", text);
    return load_graph(folder_ / "own.yaml", registry_, folder_ / "shipped", overrides);
  }
  void expect_reported(const std::string& text, const std::string& told) {
    const auto graph = load(text);
    ASSERT_FALSE(graph) << told;
    EXPECT_NE(graph.error().message.find(told), std::string::npos) << told << "\nnot in\n"
                                                                   << graph.error().message;
  }
  static const Node& node(const Graph& graph, const std::string& name) {
    for (const Node& n : graph.nodes) {
      if (n.name == name) return n;
    }
    throw std::runtime_error("no node " + name);
  }

  toys::Bench bench_;
  StageRegistry registry_;
  fs::path folder_;
};

TEST_F(Include, AStageChangesOnlyWhatItNames) {
  const auto graph = load("description: own\ninclude: base.yaml\nstages:\n  twice: {by: 5}\n");
  ASSERT_TRUE(graph) << graph.error().message;
  EXPECT_EQ(graph->description, "own");
  EXPECT_EQ(node(*graph, "twice").options.value("by"), "5");
  EXPECT_EQ(node(*graph, "twice").options.value("late"), "on");
  EXPECT_EQ(node(*graph, "count").options.value("n"), "7");
  const auto same_type = load("include: base\nstages: {twice: {type: scale, by: 5}}\n", {"twice.late=off"});
  ASSERT_TRUE(same_type) << same_type.error().message;
  EXPECT_EQ(same_type->description, "base");
  EXPECT_EQ(node(*same_type, "twice").options.value("late"), "off");
}

TEST_F(Include, AnotherTypeReplacesTheStageWhole) {
  const auto graph = load("include: base\nstages: {twice: {type: count, n: 3}}\nremove: count\n");
  ASSERT_TRUE(graph) << graph.error().message;
  EXPECT_EQ(node(*graph, "twice").options.value("n"), "3");
  EXPECT_EQ(graph->nodes.size(), 3U);
}

TEST_F(Include, StagesAreAddedAndInputsTurned) {
  const auto graph = load(
      "include: base\nstages:\n  more: {type: scale, inputs: {number: twice}}\n"
      "  sum: {inputs: {number: more, other: twice}}\n");
  ASSERT_TRUE(graph) << graph.error().message;
  EXPECT_EQ(graph->nodes[node(*graph, "sum").inputs[0]->node].name, "more");
  EXPECT_EQ(graph->nodes[node(*graph, "sum").inputs[1]->node].name, "twice");
}

TEST_F(Include, TapsAddUp) {
  write("tapped.yaml", "include: base.yaml\ntaps: [{port: sum, file: a.txt}]\n");
  const auto graph = load("include: tapped.yaml\ntaps:\n  - {port: twice, file: b.txt}\n");
  ASSERT_TRUE(graph) << graph.error().message;
  EXPECT_EQ(graph->nodes.size(), 6U);
  expect_reported("include: tapped.yaml\ntaps:\n  - {port: twice, file: a.txt}\n",
                  "own.yaml:3:5: taps[1]: writes a.txt, which taps[0] writes as well");
}

TEST_F(Include, LaterFilesAreOnTopOfEarlierOnes) {
  write("fast.yaml", "include: base\nstages: {twice: {by: 1}}\n");
  write("parts/slow.yaml", "include: ../base.yaml\nstages: {twice: {by: 2}}\n");
  const auto graph = load("include: [fast.yaml, parts/slow.yaml]\n");
  ASSERT_TRUE(graph) << graph.error().message;
  EXPECT_EQ(node(*graph, "twice").options.value("by"), "2");
}

TEST_F(Include, ShippedPipelinesAreFoundByName) {
  write("shipped/factory.yaml", kBase);
  EXPECT_TRUE(load("include: factory\n"));
  expect_reported(
      "include: factry\n",
      "own.yaml:1:10: include: there is no 'factry' beside this file, and no shipped pipeline of that name; "
      "did you mean factory?");
}

TEST_F(Include, FilesAreFoundBesideThePipelineThatNamesThem) {
  write("parts/base.yaml", kBase);
  write("parts/data.txt", "x");
  write("parts/mid.yaml", "include: base.yaml\nstages: {twice: {file: data.txt}}\n");
  const auto graph = load("include: parts/mid.yaml\n");
  ASSERT_FALSE(graph);  // the toy looks beside the pipeline that is run
  EXPECT_NE(graph.error().message.find("parts/mid.yaml:2:24: stages.twice.file: no such file"),
            std::string::npos)
      << graph.error().message;
  const CheckContext context{folder_, folder_ / "shipped", nullptr};
  const std::string mid = (folder_ / "parts/mid.yaml").string();
  EXPECT_EQ(context.find("data.txt", {mid, 2, 24}), folder_ / "parts/data.txt");
  EXPECT_EQ(context.find("base.yaml", {"--set", 0, 0}), folder_ / "base.yaml");
  EXPECT_EQ(context.find("data.txt", {"--set", 0, 0}), fs::path());
}

TEST_F(Include, ProblemsNameTheFileTheyAreIn) {
  write("bad.yaml",
        "stages:\n  count: {type: count, n: -1}\n  sum: {type: sum, inputs: {number: cuont}}\nx: 1\n");
  const auto graph =
      load("include: bad.yaml\nstages:\n  count: {m: 3}\n  collect: {type: collect, inputs: {total: sum}}\n");
  ASSERT_FALSE(graph);
  for (const char* told : {"bad.yaml:2:27: stages.count.n: -1 is out of range",
                           "bad.yaml:3:37: stages.sum.inputs.number: there is no",
                           "bad.yaml:4:1: x: unknown key", "own.yaml:3:11: stages.count.m: unknown key"}) {
    EXPECT_NE(graph.error().message.find(told), std::string::npos) << told << "\nnot in\n"
                                                                   << graph.error().message;
  }
}

TEST_F(Include, ChangesOfNothingAreTold) {
  expect_reported(
      "include: base\nstages:\n  twcie: {by: 5}\n",
      "own.yaml:3:3: stages.twcie: there is no included stage 'twcie' to change, and a new one needs a type; "
      "did you mean twice?");
  expect_reported("include: base\nremove: [twcie]\n",
                  "own.yaml:2:10: remove: there is no included stage 'twcie'; did you mean twice?");
  expect_reported(std::string(kBase) + "remove: twice\n",
                  "remove: there is no include whose stages could be removed");
  expect_reported("include: {a: b}\n", "own.yaml:1:10: include: must be a name or a list of names");
  expect_reported("include: base\nremove: twice\n",
                  "base.yaml:9:37: stages.sum.inputs.number: there is no stage 'twice'");
}

TEST_F(Include, CirclesAreNamed) {
  write("a.yaml", "include: b.yaml\n");
  write("b.yaml", "include: own.yaml\n");
  expect_reported(
      "include: a.yaml\n",
      "b.yaml:1:10: include: the files include each other in a circle (own.yaml -> a.yaml -> b.yaml "
      "-> own.yaml)");
  expect_reported("include: ./own.yaml\n", "in a circle (own.yaml -> own.yaml)");
}

TEST_F(Include, ManyTimesManyFilesAreRefused) {
  write("l0.yaml", kBase);
  for (int i = 1; i < 12; ++i) {
    const std::string below = "l" + std::to_string(i - 1) + ".yaml";
    write("l" + std::to_string(i) + ".yaml", "include: [" + below + ", " + below + "]\n");
  }
  expect_reported("include: l11.yaml\n", "includes more than 50 files");
}

}  // namespace
}  // namespace plumbline::pipeline
