// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "plumbline/core/option_schema.hpp"
#include "plumbline/core/options.hpp"

namespace plumbline::core {
namespace {

enum class Kernel { kHuber, kNone };

struct Sample {
  bool lines = true;
  int count = 1000;
  int window_px = 31;
  double leaf_m = 0.01;
  double angle_rad = 0.1;
  double wait_s = 0.5;
  double share = 0.5;
  double turn_rate = 1.0;
  std::string name = "a name";
  std::string view = "iso";
  Kernel kernel = Kernel::kHuber;
  std::vector<double> box{0.0, 1.0};
  ConfigNode steps{ConfigNode::Kind::kSequence, {}, {}, false, {}, {}, {}};

  OptionTable table() {
    OptionTable t;
    t.boolean("lines", lines, "Use lines")
        .integer("count", count, {50, 10000}, "", "Points per frame")
        .integer("window", window_px, {3, 99}, "px", "Window")
        .number("leaf", leaf_m, {0.001, 1.0}, "m", "Leaf")
        .number("angle", angle_rad, {0.0, 3.2}, "rad", "Angle")
        .number("wait", wait_s, {0.0}, "s", "Wait")
        .number("share", share, {0.0, 1.0}, "ratio", "Share")
        .text("name", name, "Name")
        .choice("view", view, {"iso", "top", "front"}, "View")
        .choice("kernel", kernel, {{"huber", Kernel::kHuber}, {"none", Kernel::kNone}}, "Kernel")
        .numbers("box", box, 2, {-5.0, 5.0}, "m", "Box")
        .number("turn_rate", turn_rate, {0.0, 10.0}, "rad/s", "Rad | s")
        .text_or_list("steps", steps, "steps", "What to do");
    return t;
  }
};

/// Problems of reading `text` into `sample`, as the user sees them; "" = none.
std::string read(Sample& sample, const std::string& text, const std::vector<std::string>& reserved = {}) {
  const auto node = parse_yaml(text, "f.yaml");
  if (!node) return node.error().message;
  ConfigProblems problems;
  sample.table().set_all(*node, "stages.s", problems, reserved);
  return to_string(problems);
}

TEST(Options, ReadsValuesWithUnits) {
  Sample s;
  EXPECT_EQ(
      read(s,
           "lines: off\ncount: 200\nwindow: 21 px\nleaf: 5 mm\nangle: 180deg\nwait: 250 ms\nshare: 30 %\n"
           "name: 12\nview: top\nkernel: none\nbox: [-5 cm, 2]\n"),
      "");
  EXPECT_FALSE(s.lines);
  EXPECT_EQ(s.count, 200);
  EXPECT_EQ(s.window_px, 21);
  EXPECT_EQ(s.leaf_m, 0.005);  // exactly
  EXPECT_DOUBLE_EQ(s.angle_rad, 3.14159265358979323846);
  EXPECT_EQ(s.wait_s, 0.25);
  EXPECT_EQ(s.share, 0.3);
  EXPECT_EQ(s.name, "12");
  EXPECT_EQ(s.view, "top");
  EXPECT_EQ(s.kernel, Kernel::kNone);
  EXPECT_EQ(s.box, (std::vector<double>{-0.05, 2.0}));
}

TEST(Options, EveryProblemIsToldWithPlaceAndRemedy) {
  Sample s;
  const std::string told =
      read(s, "lines: 3\ncout: 5\ncount: 2.5e1\nleaf: 5 deg\nangle: wide\nview: tpo\nbox: [1]\n");
  EXPECT_NE(told.find("f.yaml:1:8: stages.s.lines: '3' is neither on nor off (allowed: on, off)"),
            std::string::npos);
  EXPECT_NE(told.find("f.yaml:2:1: stages.s.cout: unknown key"), std::string::npos) << told;
  EXPECT_NE(told.find("did you mean count?"), std::string::npos);
  EXPECT_NE(told.find("f.yaml:3:8: stages.s.count: 2.5e1 is out of range (allowed: 50 to 10000)"),
            std::string::npos);
  EXPECT_NE(
      told.find("stages.s.leaf: '5 deg': the unit 'deg' does not fit (allowed: a number in m, cm, mm, um)"),
      std::string::npos);
  EXPECT_NE(told.find("stages.s.angle: 'wide' is not a number in rad, deg"), std::string::npos);
  EXPECT_NE(told.find("'tpo' is not one of the choices; did you mean top? (allowed: iso, top, front)"),
            std::string::npos);
  EXPECT_NE(told.find("stages.s.box: has 1 numbers (allowed: 2)"), std::string::npos);
  EXPECT_EQ(s.count, 1000);  // nothing was changed
  EXPECT_EQ(s.box.size(), 2U);
  EXPECT_NE(read(s, "leaf: 0,5cm\n").find("'0,5cm': decimal comma; write numbers with a point"),
            std::string::npos);
}

TEST(Options, RefusesWhatOnlyLooksLikeANumber) {
  for (const char* value :
       {"nan", "inf", "-inf", "\"5\"", "0x5", "1e999", "[1]", "{a: 1}", "~", "5 5", "", "--5", "+-5"}) {
    Sample s;
    EXPECT_NE(read(s, std::string("leaf: ") + value + "\n"), "") << value;
    EXPECT_EQ(s.leaf_m, 0.01) << value;
  }
  Sample s;
  EXPECT_NE(read(s, "count: 99.5\n").find("not a whole number"), std::string::npos);
  EXPECT_EQ(read(s, "turn_rate: 90 deg/s\nwait: 1 min\n"), "");
  EXPECT_DOUBLE_EQ(s.turn_rate, 3.14159265358979323846 / 2.0);
  EXPECT_EQ(s.wait_s, 60.0);
  EXPECT_NE(read(s, "wait: -1\n").find("at least 0 s"), std::string::npos);
  EXPECT_NE(read(s, "- 1\n").find("not a map"), std::string::npos);
  EXPECT_EQ(read(s, ""), "");
  EXPECT_EQ(read(s, "type: x\n", {"type"}), "");
}

TEST(Options, EmptyValuesAreRefusedUnlessTheyAreDeclared) {
  Sample s;
  for (const char* key : {"lines", "count", "leaf", "name", "view", "kernel", "steps"}) {
    const std::string wrong = read(s, std::string(key) + ": ''");
    EXPECT_NE(wrong.find("stages.s." + std::string(key) + ": is empty; give a value or leave it out"),
              std::string::npos)
        << wrong;
  }
  EXPECT_EQ(s.name, "a name");

  std::string views = "iso";
  OptionTable table;
  table.text("views", views, "Views; empty: none", EmptyValue::kAllowed);
  ConfigNode empty;
  empty.kind = ConfigNode::Kind::kScalar;
  ConfigProblems problems;
  table.set("views", empty, "", problems);
  EXPECT_TRUE(problems.empty());
  EXPECT_EQ(views, "");
  EXPECT_EQ(allowed_text(table.specs().front()), "text, may be empty");
  EXPECT_FALSE(option_schema(table.specs().front()).contains("minLength"));
  EXPECT_EQ(option_schema(s.table().specs()[7])["minLength"], 1);
}

TEST(Options, PrintedValuesReadBackTheSame) {
  Sample s;
  s.leaf_m = 1.0 / 3.0;
  s.name = "off: \"#1\"";
  s.kernel = Kernel::kNone;
  s.box = {-0.1, 1e-7};
  const OptionTable table = s.table();
  std::string text;
  for (const OptionSpec& spec : table.specs()) text += spec.key + ": " + table.value(spec.key) + "\n";
  Sample back;
  EXPECT_EQ(read(back, text), "") << text;
  EXPECT_EQ(back.leaf_m, s.leaf_m);
  EXPECT_EQ(back.name, s.name);
  EXPECT_EQ(back.kernel, s.kernel);
  EXPECT_EQ(back.box, s.box);
  EXPECT_EQ(back.window_px, s.window_px);
}

TEST(Options, SpecsCarryTheDefaults) {
  Sample s;
  const OptionTable table = s.table();
  EXPECT_EQ(table.specs()[3].default_value, "0.01 m");
  EXPECT_EQ(table.specs()[9].choices, (std::vector<std::string>{"huber", "none"}));
  s.leaf_m = 0.5;
  EXPECT_EQ(table.specs()[3].default_value, "0.01 m");
  EXPECT_EQ(table.value("leaf"), "0.5 m");
  EXPECT_THROW((void)table.value("nothing"), std::logic_error);
}

TEST(Options, AFileOrAListIsKeptAsItStands) {
  Sample s;
  EXPECT_EQ(read(s, "steps: [{type: range, max: 3 m}, {name: \"a: b\"}]\n"), "");
  ASSERT_EQ(s.steps.kind, ConfigNode::Kind::kSequence);
  EXPECT_EQ(s.steps.items[1].find("name")->mark.column, 41);
  EXPECT_EQ(s.table().value("steps"), "[{type: range, max: 3 m}, {name: \"a: b\"}]");
  EXPECT_EQ(read(s, "steps: some/file.yaml\n"), "");
  EXPECT_EQ(s.table().value("steps"), "some/file.yaml");
  EXPECT_NE(read(s, "steps: {a: 1}\n").find("a map is neither a file nor a list of steps"),
            std::string::npos);
}

TEST(Options, ForgottenGroupsAreSuggested) {
  EXPECT_EQ(did_you_mean("max_rotation", {"keyframe.max_rotation", "points"}), "keyframe.max_rotation");
  EXPECT_EQ(hint("voxl", {"voxel", "filters"}), "; did you mean voxel? (allowed: voxel, filters)");
  EXPECT_EQ(hint("banana", {"voxel"}), " (allowed: voxel)");
  EXPECT_EQ(hint("banana", {}), " (allowed: nothing)");
  std::vector<std::string> many{"voxel"};
  for (char c = 'a'; c <= 'z'; ++c) many.push_back(std::string("filter_") + c);
  EXPECT_EQ(hint("voxl", many), "; did you mean voxel?");
  EXPECT_NE(hint("banana", many).find("filter_z"), std::string::npos) << "without a guess all are named";
  for (std::string& name : many) name.insert(0, name == "voxel" ? "" : "chain.");
  EXPECT_EQ(hint("banana", many), " (allowed: voxel, chain.*)") << "by group";
}

TEST(Options, SchemaOfEveryType) {
  Sample s;
  const OptionTable table = s.table();
  const nlohmann::ordered_json schema = options_schema(table.specs());
  ASSERT_EQ(schema.size(), table.specs().size());
  EXPECT_EQ(schema["lines"]["enum"],
            nlohmann::ordered_json::parse(R"([true, false, "on", "off", "yes", "no"])"));
  EXPECT_EQ(schema["count"]["anyOf"][0],
            nlohmann::ordered_json::parse(R"({"type": "integer", "minimum": 50, "maximum": 10000})"));
  EXPECT_EQ(schema["wait"]["anyOf"][0], nlohmann::ordered_json::parse(R"({"type": "number", "minimum": 0})"));
  EXPECT_EQ(schema["leaf"]["anyOf"][1]["pattern"],
            "^[+-]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][+-]?[0-9]+)?( *(m|cm|mm|um))?$");
  EXPECT_EQ(schema["kernel"]["enum"], nlohmann::ordered_json::parse(R"(["huber", "none"])"));
  EXPECT_EQ(schema["box"]["minItems"], 2);
  EXPECT_EQ(schema["steps"]["anyOf"][1]["$ref"], "#/definitions/steps");
  EXPECT_EQ(schema["leaf"]["description"], "Leaf (0.001 m to 1 m; default: 0.01 m)");
}

TEST(Options, TableOfEveryType) {
  Sample s;
  const std::string page = options_as_markdown(s.table().specs());
  for (const char* row :
       {"| `lines` | on | on, off | Use lines |", "| `leaf` | 0.01 m | 0.001 m to 1 m | Leaf |",
        "| `box` | [0 m, 1 m] | 2 numbers, -5 m to 5 m | Box |", "| `wait` | 0.5 s | at least 0 s | Wait |",
        "| `turn_rate` | 1 rad/s | 0 rad/s to 10 rad/s | Rad \\| s |",
        "| `steps` | [] | file, or list of steps | What to do |"}) {
    EXPECT_NE(page.find(row), std::string::npos) << row << "\nnot in\n" << page;
  }
  EXPECT_EQ(options_as_markdown({}), "");
}

TEST(Options, TheSameKeyTwiceIsABug) {
  Sample s;
  OptionTable table = s.table();
  EXPECT_THROW(table.boolean("leaf", s.lines, "again"), std::logic_error);
}

}  // namespace
}  // namespace plumbline::core
