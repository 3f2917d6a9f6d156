// SPDX-License-Identifier: BSD-3-Clause
// Names of files and robots that are not plain: commas, quotes, ends of lines, escape sequences, formulas,
// bytes that are not UTF-8.
#include <algorithm>

#include "plumbline/core/csv.hpp"
#include "plumbline/core/text.hpp"
#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

constexpr const char* kLean =
    " -p known_poses --threads 1 --set output.pcd=off --set output.levels=0 --set fuse.voxel=40mm";
const char* const kNames[] = {"kitchen, \"upstairs\"", "=1+1", "two\nlines", "\x1b]0;title\x07\x1b[2J",
                              "caf\xe9"};

class Names : public ProgramTest {};

/// True if nothing but ends of lines and tabs would be obeyed by a terminal, and all is UTF-8.
bool plain(const std::string& text) { return core::printable(text, core::Lines::kKept) == text; }

/// The words as one of a shell.
std::string quoted(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

/// Texts of a column, of a table whose first row has its name.
std::vector<std::string> column_of(const std::string& table, const std::string& name) {
  std::vector<std::string> texts;
  std::vector<std::string> head;
  for (std::size_t at = 0; at < table.size();) {
    std::vector<std::string> row;
    for (bool last = false; !last;) {
      const core::CsvField field = core::next_csv_field(table, at);
      row.push_back(core::csv_text(field.field));
      last = field.last;
    }
    if (head.empty()) {
      head = row;
      continue;
    }
    EXPECT_EQ(row.size(), head.size());
    row.resize(head.size());
    texts.push_back(row[static_cast<std::size_t>(std::find(head.begin(), head.end(), name) - head.begin())]);
  }
  return texts;
}

TEST_F(Names, TablesHoldThemAndTerminalsDoNotObeyThem) {
  for (const std::string name : kNames) {
    fs::remove_all(path("out"));
    write_wall(path(name));
    const Outcome mapped = run("map " + quoted(name) + " -o out --set output.views=top" + kLean);
    ASSERT_EQ(mapped.code, 0) << core::printable(name) << mapped;
    EXPECT_TRUE(plain(mapped.out) && plain(mapped.err)) << mapped;
    EXPECT_FALSE(mapped.told("vtk") || mapped.told("Warning:")) << mapped;

    const std::string told = core::printable(name);
    for (const std::string& robot : column_of(slurp(path("out/keyframes.csv")), "robot"))
      EXPECT_EQ(robot, "") << "one robot with given poses has no name";
    const auto summary = read_json(path("out/summary.json"));
    EXPECT_TRUE(summary.is_object()) << told;

    for (const std::string command : {"info out", "report out"}) {
      const Outcome o = run(command);
      EXPECT_EQ(o.code, 0) << o;
      EXPECT_TRUE(plain(o.out) && plain(o.err)) << o;
    }
    fs::remove_all(path(name));
  }
}

TEST_F(Names, SeveralRobotsHaveTheirsInEveryTable) {
  for (const std::string name : {kNames[0], kNames[1]}) write_wall(path(name));
  const Outcome mapped =
      run("map " + quoted(kNames[0]) + " " + quoted(kNames[1]) + " -o out --set output.views=" + kLean);
  ASSERT_EQ(mapped.code, 0) << mapped;
  for (const char* table : {"out/keyframes.csv", "out/frames.csv"}) {
    const std::vector<std::string> robots = column_of(slurp(path(table)), "robot");
    for (const char* name : {kNames[0], kNames[1]})
      EXPECT_NE(std::count(robots.begin(), robots.end(), name), 0) << table;
    EXPECT_EQ(slurp(path(table)).find(",=1"), std::string::npos) << "a formula in " << table;
  }
}

TEST_F(Names, MessagesShowThem) {
  for (const std::string name : kNames) {
    const Outcome o = run("info " + quoted(name));
    EXPECT_EQ(o.code, 3) << o;
    EXPECT_TRUE(plain(o.err)) << o;
    EXPECT_TRUE(o.told(core::printable(name))) << o;
    EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o;
  }
  write("two\nlines.yaml", "stages: 3\n");
  EXPECT_TRUE(run("pipelines check 'two\nlines.yaml'").told("two\\nlines.yaml:1")) << "also of a pipeline";
}

}  // namespace
}  // namespace plumbline::integration
