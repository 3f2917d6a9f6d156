// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "plumbline/pipeline/graph.hpp"
#include "test_pipeline_toys.hpp"

namespace plumbline::pipeline {
namespace {

const char* const kGood = R"(description: adds
stages:
  collect: {type: collect, inputs: {total: sum}}
  sum: {type: sum, inputs: {number: twice}}
  twice:
    type: scale
    inputs: {number: count.number}
    by: 3
  count: {type: count, n: 7}
)";

class GraphFile : public testing::Test {
 protected:
  GraphFile() { toys::register_toys(registry_, bench_); }

  core::Result<Graph> parse(const std::string& text, const std::vector<std::string>& overrides = {}) {
    return parse_graph(text, "g.yaml", registry_, "/nowhere", overrides);
  }
  std::string refusal(const std::string& text, const std::vector<std::string>& overrides = {}) {
    const auto graph = parse(text, overrides);
    if (graph) return "accepted";
    EXPECT_EQ(graph.error().kind, core::ErrorKind::kUsage);
    return graph.error().message;
  }
  void expect_reported(const std::string& text, const std::string& told) {
    const std::string message = refusal(text);
    EXPECT_NE(message.find(told), std::string::npos) << message;
  }

  toys::Bench bench_;
  StageRegistry registry_;
};

TEST_F(GraphFile, IsSortedWhateverTheOrderInTheFile) {
  const auto graph = parse(kGood);
  ASSERT_TRUE(graph) << graph.error().message;
  std::string names;
  for (const Node& node : graph->nodes) names += node.name + " ";
  EXPECT_EQ(names, "count twice sum collect ");
  EXPECT_EQ(graph->source().name, "count");
  EXPECT_EQ(graph->nodes[1].options.value("by"), "3");
}

TEST_F(GraphFile, NothingAfterTheEqualsSignIsTheEmptyText) {
  EXPECT_EQ(refusal(kGood, {"twice.file="}), "accepted");
  EXPECT_EQ(refusal(kGood, {"twice.by="}),
            "--set twice.by: is empty; give a value or leave it out (allowed: -9 to 9)");
}

TEST_F(GraphFile, EffectiveConfigurationReadsBackTheSame) {
  const auto graph = parse(kGood, {"twice.by=-4", "count.n=9"});
  ASSERT_TRUE(graph) << graph.error().message;
  const std::string text = to_yaml(*graph);
  EXPECT_NE(text.find("by: -4"), std::string::npos) << text;
  const auto again = parse(text);
  ASSERT_TRUE(again) << again.error().message << text;
  EXPECT_EQ(to_yaml(*again), text);
}

TEST_F(GraphFile, AllProblemsAreToldAtOnceWithTheirPlaces) {
  const std::string message = refusal(R"(stages:
  count: {type: cuont}
  twice:
    type: scale
    inputs: {nmber: count}
    by: 50
    colour: red
  sum: {type: sum, inputs: {number: twise}}
flags: 1
)",
                                      {"twice.by=x", "tice.by=1", "sum", "twice.type=sum"});
  for (const char* told :
       {"g.yaml:2:17: stages.count.type: unknown stage type 'cuont'; did you mean count? "
        "(allowed: collect, count, scale, sum)",
        "g.yaml:5:14: stages.twice.inputs.nmber: unknown input; did you mean number? (allowed: number)",
        "g.yaml:6:9: stages.twice.by: 50 is out of range", "g.yaml:7:5: stages.twice.colour: unknown key",
        "g.yaml:8:37: stages.sum.inputs.number: there is no stage 'twise'", "did you mean twice?",
        "g.yaml:9:1: flags: unknown key", "--set twice.by: 'x' is not a number",
        "--set tice.by: there is no stage 'tice'", "--set sum: write it as stage.key=value",
        "--set twice.type: only options can be set"}) {
    EXPECT_NE(message.find(told), std::string::npos) << told << "\nnot in\n" << message;
  }
}

TEST_F(GraphFile, PortTypesMustFit) {
  expect_reported(
      "stages:\n  a: {type: count}\n  b: {type: collect, inputs: {total: a}}\n",
      "g.yaml:3:38: stages.b.inputs.total: 'a' does not give the total that is needed here; it gives number "
      "(number) (no stage of this file gives a total)");
  expect_reported(
      "stages:\n  a: {type: count}\n  s: {type: sum, inputs: {number: a.total}}\n",
      "'a.total' does not give the number that is needed here; it gives number (number) (allowed: a)");
}

TEST_F(GraphFile, CyclesAreNamed) {
  expect_reported(R"(stages:
  count: {type: count}
  a: {type: scale, inputs: {number: c}}
  b: {type: scale, inputs: {number: a}}
  c: {type: scale, inputs: {number: b}}
  sum: {type: sum, inputs: {number: c, other: count}}
  out: {type: collect, inputs: {total: sum}}
)",
                  "g.yaml:3:3: stages.a: the stages read from each other in a circle (a <- c <- b <- a)");
  expect_reported("stages:\n  a: {type: scale, inputs: {number: a}}\n", "in a circle (a <- a)");
}

TEST_F(GraphFile, UnusedAndMissingStagesAreTold) {
  expect_reported(std::string(kGood) + "  idle: {type: scale, inputs: {number: count}}\n",
                  "g.yaml:10:3: stages.idle: nothing reads from this stage");
  expect_reported(std::string(kGood) + "  again: {type: count}\n",
                  "a pipeline has one stage that gives frames");
  expect_reported("description: x\n", "stages: must be a map of stages");
  expect_reported("stages: {}\n", "stages: must be a map of stages");
  expect_reported("", "a pipeline is a map");
  expect_reported("stages:\n  Bad Name: {type: count}\n", "a stage's name is made of");
  expect_reported("stages:\n  a:\n", "must be a map with a type");
  expect_reported("stages:\n  a: {n: 3}\n", "needs a type (allowed: collect, count, scale, sum)");
}

TEST_F(GraphFile, AnUnknownTypeIsToldOnceAndNotForEveryNeighbour) {
  EXPECT_EQ(
      refusal("stages:\n  a: {type: count}\n  b: {type: scael, inputs: {number: a}}\n"
              "  c: {type: sum, inputs: {number: b}}\n  d: {type: collect, inputs: {total: c}}\n"),
      "g.yaml:3:13: stages.b.type: unknown stage type 'scael'; did you mean scale? (allowed: collect, count, "
      "scale, sum)");
}

TEST_F(GraphFile, FilesAreFoundBesideThePipelineAndAmongTheShipped) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "plumbline_graph";
  std::filesystem::create_directories(folder / "shipped");
  std::ofstream(folder / "own.txt") << "x";
  std::ofstream(folder / "shipped" / "theirs.txt") << "x";
  for (const char* file : {"own.txt", "theirs.txt", "none.txt"}) {
    std::ofstream(folder / "p.yaml") << kGood << "    #\n";
    const auto graph =
        load_graph(folder / "p.yaml", registry_, folder / "shipped", {std::string("twice.file=") + file});
    EXPECT_EQ(graph.has_value(), std::string(file) != "none.txt");
  }
  std::ofstream(folder / "shipped" / "rgbd.yaml") << kGood;
  EXPECT_TRUE(core::find_yaml("pipeline", "rgbd", folder / "shipped"));
  EXPECT_TRUE(core::find_yaml("pipeline", (folder / "p.yaml").string(), folder / "shipped"));
  const auto missing = core::find_yaml("pipeline", "rgdb", folder / "shipped");
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().message.find("did you mean rgbd?"), std::string::npos);
  std::filesystem::remove_all(folder);
}

TEST_F(GraphFile, SuggestionsComeFirst) {
  EXPECT_EQ(
      refusal(kGood, {"twice.faile_at=3"}),
      "--set twice.faile_at: unknown key; did you mean fail_at? (allowed: by, fail_at, throw_at, drop_odd, "
      "late, file)");
}

TEST_F(GraphFile, ProblemsOfAFileAreToldTogetherWithThoseOfItsText) {
  const std::string message = refusal("stages:\n  a: {type: count, n: 3, n: x}\n  b: {type: scael}\n");
  EXPECT_NE(message.find("g.yaml:2:26: stages.a.n: the key is given twice"), std::string::npos) << message;
  EXPECT_NE(message.find("g.yaml:3:13: stages.b.type: unknown stage type"), std::string::npos) << message;
}

TEST_F(GraphFile, ProblemsOfAStagesOwnChecksAreToldWhereTheKeyStands) {
  expect_reported("stages:\n  a: {type: count}\n  b: {type: scale, inputs: {number: a}, file: nowhere}\n",
                  "g.yaml:3:47: stages.b.file: no such file");
  EXPECT_EQ(refusal(kGood, {"twice.file=nowhere"}), "--set twice.file: no such file");
}

TEST_F(GraphFile, NoTwoStagesWriteOneFile) {
  const std::string two = std::string(kGood) + "  more: {type: collect, inputs: {total: sum}";
  EXPECT_EQ(refusal(two + "}\n"),
            "g.yaml:10:3: stages.more: writes total.txt, which stages.collect writes as well");
  EXPECT_EQ(refusal(two + ", writes: ./x/../total.txt}\n"),
            "g.yaml:10:3: stages.more: writes ./x/../total.txt, which stages.collect writes as well");
  EXPECT_EQ(refusal(two + ", writes: more.txt}\n"), "accepted");
  EXPECT_EQ(refusal(kGood, {"collect.writes=summary.json"}),
            "g.yaml:3:3: stages.collect: writes summary.json, which the run itself writes as well");
  const std::string taps =
      std::string(kGood) + "taps:\n  - {port: sum, file: a/b.txt}\n  - {port: twice, file: ";
  EXPECT_NE(refusal(taps + "a/b.txt/*.txt}\n").find("taps[1]: writes a/b.txt/*.txt"), std::string::npos);
  EXPECT_NE(refusal(taps + "a/*.txt}\n").find("which taps[0] writes as well (a/b.txt)"), std::string::npos);
  EXPECT_EQ(refusal(taps + "a/n*.txt}\n"), "accepted");
}

TEST_F(GraphFile, TapsAreNodesBehindAllStages) {
  const std::string text = std::string(kGood) +
                           "taps:\n  - {port: twice, file: t/*.txt}\n"
                           "  - port: sum.total\n    file: total2.txt\n";
  const auto graph = parse(text);
  ASSERT_TRUE(graph) << graph.error().message;
  EXPECT_EQ(graph->stage_count(), 4U);
  ASSERT_EQ(graph->nodes.size(), 6U);
  EXPECT_EQ(graph->nodes[4].name, "tap:twice.number");
  EXPECT_EQ(graph->nodes[5].name, "tap:sum.total");
  EXPECT_EQ(graph->nodes[5].inputs[0]->node, 2U);
  const auto again = parse(to_yaml(*graph));
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(to_yaml(*again), to_yaml(*graph));
}

TEST_F(GraphFile, ATapMustNameAPortThatCanBeWritten) {
  const std::string taps = std::string(kGood) + "taps:\n  - ";
  for (const auto& [tap, told] : std::map<std::string, std::string>{
           {"{port: sun, file: a.txt}",
            "g.yaml:11:12: taps[0].port: there is no stage 'sun'; did you mean sum?"},
           {"{port: sum.totl, file: a.txt}", "taps[0].port: 'sum' has no port 'totl'; did you mean total?"},
           {"{port: collect, file: a.txt}", "taps[0].port: 'collect' gives nothing that could be written"},
           {"{file: a.txt}", "g.yaml:11:5: taps[0]: must name a port"},
           {"sum", "taps[0]: must name a port"},
           {"{port: sum, file: a.txt, colour: red}", "g.yaml:11:30: taps[0].colour: unknown key"}}) {
    expect_reported(taps + tap + "\n", told);
  }
  expect_reported(std::string(kGood) + "taps: {port: sum}\n", "g.yaml:10:7: taps: must be a list");
}

TEST_F(GraphFile, DotShowsStagesPortsAndTaps) {
  const auto graph = parse(std::string(kGood) + "taps: [{port: sum, file: \"t.txt\"}]\n");
  ASSERT_TRUE(graph) << graph.error().message;
  const std::string dot = to_dot(*graph);
  for (const char* line : {"\"twice\" [label=\"twice\\n(scale)\"];", "\"sum\" [label=\"sum\"];",
                           "\"count\" -> \"twice\" [label=\"number\"];",
                           "\"sum\" -> \"collect\" [label=\"total\", style=dashed];",
                           "\"sum\" -> \"tap:sum.total\" [label=\"total\", style=dashed];",
                           "\"tap:sum.total\" [label=\"t.txt\", shape=note"}) {
    EXPECT_NE(dot.find(line), std::string::npos) << line << "\nnot in\n" << dot;
  }
}

TEST(Registry, ANameIsTakenOnce) {
  toys::Bench bench;
  StageRegistry registry;
  toys::register_toys(registry, bench);
  EXPECT_THROW(toys::register_toys(registry, bench), std::logic_error);
}

}  // namespace
}  // namespace plumbline::pipeline
