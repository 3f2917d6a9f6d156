// SPDX-License-Identifier: BSD-3-Clause
// Text of others on terminals, in tables and as names of folders.
#include <gtest/gtest.h>

#include "plumbline/core/config.hpp"
#include "plumbline/core/csv.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::core {
namespace {

TEST(Printable, EscapesWhatATerminalObeys) {
  EXPECT_EQ(printable("kitchen, 2 \xc3\xa4 \xe2\x82\xac \xf0\x9f\x98\x80"),
            "kitchen, 2 \xc3\xa4 \xe2\x82\xac \xf0\x9f\x98\x80");
  EXPECT_EQ(printable("\x1b[2J\x07"), "\\x1b[2J\\x07");
  EXPECT_EQ(printable("a\nb\tc\r\x7f"), "a\\nb\\tc\\x0d\\x7f");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\x9b31m")
      << "C1: the same as ESC [";
  EXPECT_EQ(printable("a\nb\tc\r", Lines::kKept), "a\nb\tc\\x0d");
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
}

TEST(Printable, IsValidUtf8) {
  const std::string odd = "\xef\xbf\xbd";
  EXPECT_EQ(printable("\xff"), odd);
  EXPECT_EQ(printable("a\xe9"
                      "b"),
            "a" + odd + "b")
      << "Latin-1";
  EXPECT_EQ(printable("\xe2\x82"), odd + odd) << "cut off";
  EXPECT_EQ(printable("\xc0\xaf"), odd + odd) << "longer than needed";
  EXPECT_EQ(printable("\xed\xa0\x80"), odd + odd + odd) << "half of a pair";
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), odd + odd + odd + odd) << "beyond the last";
}

TEST(FolderName, IsOneFolder) {
  EXPECT_EQ(folder_name("robot 1"), "robot 1");
  EXPECT_EQ(folder_name("../x"), ".._x");
  EXPECT_EQ(folder_name(".."), "_");
  EXPECT_EQ(folder_name("."), "_");
  EXPECT_EQ(folder_name("a\nb"), "a\\nb");
}

TEST(ListOfProblems, HasALineForEachWhateverNamesHold) {
  const ConfigProblems two = {{{"a\n.yaml", 1, 2}, "k", "is \x1b[2J"}, {{"a\n.yaml", 3, 4}, "l", "b\nc"}};
  const Error error = to_error(two);
  EXPECT_EQ(error.message, "a\\n.yaml:1:2: k: is \\x1b[2J\na\\n.yaml:3:4: l: b\\nc");
  EXPECT_TRUE(error.listed);
}

/// All fields of a table as texts, row after row.
std::vector<std::vector<std::string>> rows_of(const std::string& table) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t at = 0; at < table.size();) {
    rows.emplace_back();
    for (bool last = false; !last;) {
      const CsvField field = next_csv_field(table, at);
      rows.back().push_back(csv_text(field.field));
      last = field.last;
    }
  }
  return rows;
}

TEST(Csv, TextsAreQuotedAndNoFormulas) {
  EXPECT_EQ(csv_field("kitchen"), "kitchen");
  EXPECT_EQ(csv_field("kitchen, upstairs"), "\"kitchen, upstairs\"");
  EXPECT_EQ(csv_field("a \"b\""), "\"a \"\"b\"\"\"");
  EXPECT_EQ(csv_field("a\nb"), "\"a\nb\"");
  EXPECT_EQ(csv_field("=HYPERLINK(\"x\",1)"), "\"'=HYPERLINK(\"\"x\"\",1)\"");
  for (const char* formula : {"=1", "+1", "-1", "@x", "\tx", "'x"})
    EXPECT_EQ(csv_field(formula).front(), '\'') << formula;
  EXPECT_EQ(csv_field("a=1"), "a=1");
  EXPECT_EQ(csv_field(""), "");
}

TEST(Csv, IsReadBackAsItWas) {
  const std::vector<std::string> names = {"kitchen", "a,b", "\"",  "\"\"", ",", "a\nb", "a\r\nb",
                                          "=1",      "'",   "''=", "-",    "",  "\xff"};
  std::string table;
  for (const std::string& name : names) table += csv_field(name) + ",1.5,-2\n";
  const auto rows = rows_of(table);
  ASSERT_EQ(rows.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i)
    EXPECT_EQ(rows[i], (std::vector<std::string>{names[i], "1.5", "-2"}));
}

TEST(Csv, OfOtherPrograms) {
  using Rows = std::vector<std::vector<std::string>>;
  EXPECT_EQ(rows_of("a,b\r\n1,2"), (Rows{{"a", "b"}, {"1", "2"}}));
  EXPECT_EQ(rows_of("a,\n,\n"), (Rows{{"a", ""}, {"", ""}}));
  EXPECT_EQ(rows_of("\"a,b"), (Rows{{"a,b"}})) << "an end that is missing";
}

}  // namespace
}  // namespace plumbline::core
