// SPDX-License-Identifier: BSD-3-Clause
// Clouds as text: x y z and, when there, colour and normal.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>

#include "io/byte_reader.hpp"
#include "io/cloud_table.hpp"
#include "io/scalar.hpp"
#include "plumbline/core/numbers.hpp"

namespace plumbline::cloud {
namespace {

// Words between separators; empty ones are left out.
std::vector<std::string> split(const std::string& line, std::string_view separators = " \t,;") {
  std::vector<std::string> words;
  std::string word;
  for (const char c : line + " ") {
    const bool separator = separators.find(c) != std::string_view::npos;
    if (!separator) word.push_back(c);
    if (separator && !word.empty()) words.push_back(std::exchange(word, {}));
  }
  return words;
}

/// Numbers of all points, row after row.
struct TextTable {
  std::vector<std::string> names;  ///< column names of a header line
  std::size_t columns = 0;
  std::vector<double> values;
};

std::string read_table(ByteReader& reader, TextTable& table) {
  std::string line;
  std::size_t number = 0;
  while (reader.line(line, 4096)) {
    ++number;
    if (line.compare(0, 2, "//") == 0) line.erase(0, 2);  // CloudCompare's header lines
    auto words = split(line);
    if (words.empty() || words[0][0] == '#') continue;
    if (core::has_decimal_comma(split(line, " \t;")))
      return fmt::format("line {}: decimal comma; write numbers with a point", number);

    // The first line may name the columns
    const bool first = table.columns == 0;
    if (first && !parse_number(words[0])) {
      if (!table.names.empty()) return fmt::format("line {}: '{}' is not a number", number, words[0]);
      table.names = words;
      continue;
    }

    if (first && table.names.empty() && words.size() == 1)
      continue;  // .pts files begin with the number of points
    if (first) table.columns = words.size();

    // Every line must have the same columns
    if (words.size() != table.columns) {
      return fmt::format("line {}: {} columns, the lines before have {}", number, words.size(),
                         table.columns);
    }

    for (const auto& word : words) {
      const auto value = parse_number(word);
      if (!value) return fmt::format("line {}: '{}' is not a number", number, word);
      table.values.push_back(*value);
    }
  }

  if (reader.remaining() > 0) return fmt::format("line {}: longer than 4096 characters", number + 1);
  return table.columns == 0 ? "holds no points" : "";
}

/// True if each row is a stamp, a position and a quaternion of unit length.
bool is_path(const TextTable& table) {
  if (table.columns != 8 || table.names.size() == table.columns) return false;
  for (std::size_t i = 0; i < table.values.size(); i += table.columns) {
    double squared = 0.0;
    for (std::size_t c = 4; c < 8; ++c) squared += table.values[i + c] * table.values[i + c];
    if (!(std::abs(squared - 1.0) < 1e-3)) return false;
  }
  return true;
}

// True if three columns hold only whole numbers from 0 to 255.
bool looks_like_color(const TextTable& table, std::size_t from) {
  for (std::size_t i = 0; i < table.values.size(); i += table.columns) {
    for (std::size_t c = from; c < from + 3; ++c) {
      const double value = table.values[i + c];
      if (!(value >= 0.0 && value <= 255.0) || value != std::floor(value)) return false;
    }
  }
  return true;
}

std::vector<Meaning> meanings_of(const TextTable& table) {
  std::vector<Meaning> meanings(table.columns, Meaning::kNone);
  if (table.names.size() == table.columns) {
    for (std::size_t c = 0; c < table.columns; ++c) meanings[c] = meaning_of(table.names[c]);
    return meanings;
  }

  const auto name = [&meanings](std::size_t from, std::initializer_list<Meaning> what) {
    std::copy(what.begin(), what.end(), meanings.begin() + static_cast<std::ptrdiff_t>(from));
  };

  if (table.columns < 3) return meanings;
  name(0, {Meaning::kX, Meaning::kY, Meaning::kZ});

  // x y z intensity r g b is what laser scanners write (.pts).
  std::size_t next = table.columns == 7 ? 4 : 3;
  if (table.columns < next + 3) return meanings;

  if (looks_like_color(table, next)) {
    name(next, {Meaning::kRed, Meaning::kGreen, Meaning::kBlue});
    next += 3;
  }

  if (table.columns >= next + 3) name(next, {Meaning::kNormalX, Meaning::kNormalY, Meaning::kNormalZ});
  return meanings;
}

}  // namespace

core::Result<CloudFile> read_text_cloud(const std::filesystem::path& file, LargeCoordinates large) {
  const auto error = [&file](const std::string& what) {
    return core::input_error(file.string() + ": " + what);
  };

  ByteReader reader(file);
  if (!reader.open()) return error("cannot be read");

  TextTable table;
  const std::string problem = read_table(reader, table);
  if (!problem.empty()) return error(problem);

  // A trajectory would pass as a cloud
  if (is_path(table)) {
    return error(
        "is a path, not a cloud (a stamp, a position and a quaternion in each line); name a cloud or the "
        "result folder");
  }

  // Meaning of the columns, by name or by their values
  const auto meanings = meanings_of(table);
  table.names.resize(table.columns);
  CloudBuilder builder(meanings, table.names, table.values.size() / table.columns);
  if (!builder.has_position()) return error("has no x, y and z; three columns at least are needed");

  // Digits that floats would lose
  if (large == LargeCoordinates::kShifted) {
    for (const Meaning meaning : meanings) builder.keep_digits(meaning);
  }

  for (std::size_t i = 0; i < table.values.size(); ++i) {
    const std::size_t c = i % table.columns;
    builder.set(i / table.columns, meanings[c], c, table.values[i]);
  }

  return builder.finish();
}

}  // namespace plumbline::cloud
