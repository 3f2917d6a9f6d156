// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "plumbline/core/config.hpp"

namespace plumbline::core {
namespace {

using Kind = ConfigNode::Kind;

std::string refusal(const std::string& text) {
  const auto result = parse_yaml(text, "f.yaml");
  return result ? "accepted" : result.error().message;
}

TEST(Config, KeepsOrderAndPlacesOfKeysAndValues) {
  const auto root = parse_yaml("zeta: 1\nalpha:\n  - \"two\"\n  - [3, 4]\nempty:\n", "f.yaml");
  ASSERT_TRUE(root) << root.error().message;
  ASSERT_EQ(root->kind, Kind::kMap);
  ASSERT_EQ(root->entries.size(), 3U);
  EXPECT_EQ(root->entries[0].first, "zeta");
  EXPECT_EQ(root->key_marks[1].line, 2);
  EXPECT_EQ(root->key_marks[1].column, 1);
  const ConfigNode* alpha = root->find("alpha");
  ASSERT_NE(alpha, nullptr);
  ASSERT_EQ(alpha->items.size(), 2U);
  EXPECT_TRUE(alpha->items[0].quoted);
  EXPECT_EQ(alpha->items[0].scalar, "two");
  EXPECT_EQ(alpha->items[0].mark.line, 3);
  EXPECT_EQ(alpha->items[0].mark.column, 5);
  EXPECT_FALSE(alpha->items[1].items[0].quoted);
  EXPECT_EQ(root->find("empty")->kind, Kind::kNull);
  EXPECT_EQ(root->find("missing"), nullptr);
}

TEST(Config, EmptyTextIsNull) {
  const auto root = parse_yaml("# only a comment\n", "f.yaml");
  ASSERT_TRUE(root);
  EXPECT_EQ(root->kind, Kind::kNull);
}

TEST(Config, RefusesDuplicateKeysAllAtOnce) {
  const std::string message = refusal("a: 1\nb:\n  c: 1\n  c: 2\na: 3\n");
  EXPECT_EQ(message,
            "f.yaml:4:3: b.c: the key is given twice (first in line 3)\n"
            "f.yaml:5:1: a: the key is given twice (first in line 1)");
}

TEST(Config, RefusesWhatFollowsTheDocument) {
  EXPECT_NE(refusal("a: 1\n---\nb: 2\n").find("f.yaml:2:1: text after the end"), std::string::npos)
      << refusal("a: 1\n---\nb: 2\n");
  EXPECT_NE(refusal("{a: 1} rubbish\n").find("f.yaml:1:"), std::string::npos);
  EXPECT_NE(refusal("a: 1\n...\nrubbish\n").find("f.yaml:3:1"), std::string::npos);
}

TEST(Config, RefusesBrokenText) {
  EXPECT_NE(refusal("a: [1, 2\nb: 3\n").find("f.yaml:2:"), std::string::npos) << refusal("a: [1, 2\nb: 3\n");
  EXPECT_NE(refusal("a: *nowhere\n").find("f.yaml:1:"), std::string::npos);
  EXPECT_NE(refusal(std::string("a: 1\n\x04 b: 2\n")).find("f.yaml:2:1: control character"),
            std::string::npos);
  EXPECT_NE(refusal("[1, 2]: x\n").find("a key must be"), std::string::npos);
  EXPECT_NE(refusal("~: x\n").find("a key must be"), std::string::npos);
  EXPECT_NE(refusal("a: !thing 3\n").find("tag"), std::string::npos);
  EXPECT_NE(refusal("a: &x [*x]\n").find("f.yaml:1:8"), std::string::npos) << refusal("a: &x [*x]\n");
}

TEST(Config, AliasesAreExpandedAndCounted) {
  const auto fine = parse_yaml("a: &x {k: 5}\nb: *x\n", "f.yaml");
  ASSERT_TRUE(fine) << fine.error().message;
  EXPECT_EQ(fine->find("b")->find("k")->scalar, "5");
  EXPECT_EQ(fine->find("b")->mark.line, 2);

  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string p = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + p;
    for (int k = 0; k < 9; ++k) bomb += ", " + p;
    bomb += "]\n";
  }
  EXPECT_NE(refusal(bomb).find("too many values after alias expansion"), std::string::npos) << refusal(bomb);
}

TEST(Config, RefusesDeepTreesAndLongFiles) {
  EXPECT_EQ(refusal(std::string(20, '[') + std::string(20, ']')), "accepted");
  EXPECT_NE(refusal(std::string(21, '[') + std::string(21, ']')).find("nested too deeply"),
            std::string::npos);
  EXPECT_NE(refusal(std::string(5000, '[')), "accepted");
  EXPECT_NE(refusal("a: " + std::string(1'000'000, 'x')).find("over 1 MB"), std::string::npos);
}

TEST(Config, ReadingNamesTheFile) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "plumbline_config";
  std::filesystem::create_directories(folder);
  const auto missing = read_yaml(folder / "missing.yaml");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::kUsage);
  EXPECT_NE(missing.error().message.find("missing.yaml: no such file"), std::string::npos);
  EXPECT_NE(read_yaml(folder).error().message.find("is a folder"), std::string::npos);
  std::ofstream(folder / "ok.yaml") << "a: 1\n";
  ASSERT_TRUE(read_yaml(folder / "ok.yaml"));
  EXPECT_FALSE(read_yaml("/dev/zero"));
  std::filesystem::remove_all(folder);
}

TEST(Config, ATreeIsGivenBesideItsProblems) {
  ConfigProblems problems;
  const auto tree = parse_yaml("a: 1\na: 2\nb: !x 3\n", "f.yaml", problems);
  ASSERT_TRUE(tree);
  EXPECT_EQ(tree->find("a")->scalar, "1");
  EXPECT_EQ(tree->find("b")->scalar, "3");
  EXPECT_EQ(problems.size(), 2U);
  EXPECT_FALSE(parse_yaml("a: [", "f.yaml", problems));
  EXPECT_EQ(problems.size(), 3U);
  EXPECT_FALSE(read_yaml("/nowhere/f.yaml", problems));
  EXPECT_EQ(problems.back().what, "no such file");
}

TEST(Config, FlowTextReadsBackAsTheSameTree) {
  const char* const text =
      "{a: 5 mm, b: [on, -3, +0.5, .5, -1e-3], c: {}, d: \"a: b # \\\"q\\\\\", e: ~, f: \"\", g: \"- x\", h: "
      "\"null\", "
      "i: \"%x\", j: 30 %, k: \" x\", l: filters/map.yaml, m: \"1\\n2\"}";
  const auto tree = parse_yaml(text, "f.yaml");
  ASSERT_TRUE(tree) << tree.error().message;
  EXPECT_EQ(to_flow_yaml(*tree), text);
  ConfigNode odd;
  odd.kind = Kind::kScalar;
  for (const char* words : {"- x", "-", "null", "NULL", "~", "a b ", "# no", "&a", "100 %", "a\tb"}) {
    odd.scalar = words;
    const auto back = parse_yaml(to_flow_yaml(odd), "f.yaml");
    ASSERT_TRUE(back) << words;
    EXPECT_EQ(back->kind, Kind::kScalar) << words;
    EXPECT_EQ(back->scalar, words);
  }
}

TEST(Config, ProblemsAreToldInFileOrder) {
  const ConfigProblems problems{{{"b.yaml", 9, 1}, "x", "late"},
                                {{"--set", 0, 0}, "track.points", "wrong"},
                                {{"b.yaml", 2, 7}, "", "early"}};
  EXPECT_EQ(to_string(problems), "b.yaml:2:7: early\nb.yaml:9:1: x: late\n--set track.points: wrong");
  EXPECT_EQ(to_error(problems).kind, ErrorKind::kUsage);
}

TEST(Config, SuggestsOnlyNearWords) {
  const std::vector<std::string> words{"voxel", "max_depth", "points", "lines"};
  EXPECT_EQ(did_you_mean("voxl", words), "voxel");
  EXPECT_EQ(did_you_mean("vxoel", words), "voxel");
  EXPECT_EQ(did_you_mean("Max-Depth", words), "max_depth");
  EXPECT_EQ(did_you_mean("banana", words), "");
  EXPECT_EQ(did_you_mean("", words), "");
  EXPECT_EQ(did_you_mean("x", {"y"}), "");
}

}  // namespace
}  // namespace plumbline::core
