// SPDX-License-Identifier: BSD-3-Clause
// A variable of the shell that is not set, in quotes: every option and every argument refuses it by its name.
#include <regex>
#include <set>
#include <vector>

#include "program.hpp"

namespace plumbline::integration {
namespace {

class EmptyValues : public ProgramTest {
 protected:
  void expect_refused(const std::string& command, const std::string& name) const {
    const Outcome o = run(command);
    EXPECT_EQ(o.code, 2) << command << "\n" << o;
    EXPECT_TRUE(o.told("plumbline: error: " + name + ": is empty; give a value")) << command << "\n" << o;
  }
};

/// Names of the options with a value that a command's help lists.
std::set<std::string> options_in(const std::string& help) {
  static const std::regex line(R"(^ +(?:-\w,)?(--[a-z-]+) (?!(?:Excludes|Needs):)[^a-z ])");
  std::set<std::string> names;
  std::istringstream lines(help);
  for (std::string text; std::getline(lines, text);) {
    std::smatch found;
    if (std::regex_search(text, found, line)) names.insert(found[1]);
  }
  return names;
}

TEST_F(EmptyValues, EveryOptionRefusesThem) {
  std::size_t tried = 0;
  for (const char* command : {"robot", "export", "view"}) {  // with options of every kind
    const std::set<std::string> names = options_in(run(std::string(command) + " --help").out);
    EXPECT_GE(names.count("--threads"), 1U) << command;
    for (const std::string& name : names) {
      expect_refused(std::string(command) + " " + name + " ''", name);
      ++tried;
    }
  }
  EXPECT_GT(tried, 40U);

  for (const char* command :
       {"map --camera", "fuse --anchor", "hub --security", "hub --http-token", "keys create --robots",
        "calibrate --output", "convert --format", "info --camera", "render --robot", "report --truth",
        "evaluate trajectory --plot", "evaluate trajectory --frames", "evaluate cloud --output",
        "synth --events", "filter --plugin", "play --camera", "man --output", "pipelines check --set"}) {
    const std::string words = command;
    expect_refused(words + " ''", words.substr(words.rfind(' ') + 1));
  }
}

TEST_F(EmptyValues, ArgumentsRefuseThem) {
  const std::vector<std::pair<std::string, std::string>> commands = {
      {"info ''", "INPUT"},
      {"map '' -o x", "INPUT"},
      {"map a '' -o x", "INPUT"},
      {"robot '' --name r", "INPUT"},
      {"render '' -o x.png", "INPUT"},
      {"view ''", "OUT"},
      {"view a ''", "OTHER"},
      {"report ''", "OUT"},
      {"report a ''", "OTHER"},
      {"export ''", "MAP"},
      {"fuse a '' -o x", "MAP"},
      {"localize '' a -o x", "MAP"},
      {"convert '' x", "INPUT"},
      {"convert a ''", "OUT"},
      {"filter '' a.ply b.ply", "CHAIN"},
      {"filter map a.ply ''", "FILES"},
      {"synth '' -o x", "SCENE"},
      {"evaluate cloud ''", "CLOUD"},
      {"evaluate trajectory a ''", "EST... GT"},
      {"play '' ros2://7", "INPUT"},
      {"calibrate ''", "RECORDING"},
      {"pipelines check ''", "PIPELINE"}};
  for (const auto& [command, name] : commands) expect_refused(command, name);
}

TEST_F(EmptyValues, AnEqualSignDoesNotTakeTheNextWord) {
  expect_refused("robot --security= wall --name r", "--security");
  expect_refused("view --http-token= a", "--http-token");
  expect_refused("map wall -o x --camera=", "--camera");
  const Outcome set = run("pipelines check rgbd --set output.views=");
  EXPECT_EQ(set.code, 0) << set;
  const Outcome voxel = run("pipelines check rgbd --set fuse.voxel=''");
  EXPECT_EQ(voxel.code, 2) << voxel;
  EXPECT_TRUE(voxel.told("--set fuse.voxel: is empty; give a value or leave it out")) << voxel;
}

TEST_F(EmptyValues, WhatTakesThemSaysSo) {
  EXPECT_NE(run("pipelines describe output").out.find("empty: none (allowed: text, may be empty"),
            std::string::npos);
  const Outcome completed = run("complete --line '' --word ''");
  EXPECT_EQ(completed.code, 0) << completed;
}

}  // namespace
}  // namespace plumbline::integration
