// SPDX-License-Identifier: BSD-3-Clause
// Check that no two stages write the same file.
#include <fmt/format.h>

#include <algorithm>

#include "graph/graph_parts.hpp"

namespace plumbline::pipeline {
namespace {

struct Writer {
  std::string name;  ///< stage, as shown in messages
  std::string file;  ///< normalised; '*' stands for a number
};

/// Files that every run writes besides those of its stages (map_recording.cpp).
const std::vector<std::string> kFilesOfTheRun{"config.yaml", "summary.json", "timing.csv"};

bool starts_with(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}
bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// True if the two patterns could name the same file, or one the folder of the other.
bool clash(const std::string& a, const std::string& b) {
  const std::size_t star_a = a.find('*');
  const std::size_t star_b = b.find('*');
  if (star_a == std::string::npos && star_b == std::string::npos) {
    return a == b || starts_with(a, b + "/") || starts_with(b, a + "/");
  }

  const std::string head_a = a.substr(0, star_a);
  const std::string head_b = b.substr(0, star_b);

  // One is a file where the other needs a folder.
  if (star_b != std::string::npos && starts_with(head_b, a + "/")) return true;
  if (star_a != std::string::npos && starts_with(head_a, b + "/")) return true;

  const std::string tail_a = star_a == std::string::npos ? a : a.substr(star_a + 1);
  const std::string tail_b = star_b == std::string::npos ? b : b.substr(star_b + 1);
  return (starts_with(head_a, head_b) || starts_with(head_b, head_a)) &&
         (ends_with(tail_a, tail_b) || ends_with(tail_b, tail_a)) &&
         std::count(a.begin(), a.end(), '/') == std::count(b.begin(), b.end(), '/');
}

}  // namespace

void check_files(const StageSpecs& specs, core::ConfigProblems& problems) {
  std::vector<Writer> writers;
  for (const std::string& file : kFilesOfTheRun) writers.push_back({"the run itself", file});
  for (const StageSpec& spec : specs) {
    if (!spec.node.stage) continue;

    // The files of one stage may overlap, as a folder and what is in it do; only other stages are rivals.
    const std::size_t others = writers.size();

    for (const std::string& file : spec.node.stage->files()) {
      // Without a normal form "a/../map.ply" and "map.ply" would pass as two files.
      const std::string normal = std::filesystem::path(file).lexically_normal().generic_string();
      const auto taken = std::find_if(writers.begin(), writers.begin() + static_cast<std::ptrdiff_t>(others),
                                      [&](const Writer& writer) { return clash(writer.file, normal); });
      if (taken != writers.begin() + static_cast<std::ptrdiff_t>(others)) {
        problems.push_back({spec.mark, spec.path,
                            fmt::format("writes {}, which {} writes as well{}", file, taken->name,
                                        taken->file == normal ? "" : fmt::format(" ({})", taken->file))});
        break;  // one message is enough: two stages of a type write all the same files
      }

      writers.push_back({spec.path, normal});
    }
  }
}

}  // namespace plumbline::pipeline
