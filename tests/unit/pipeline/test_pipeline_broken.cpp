// SPDX-License-Identifier: BSD-3-Clause
// Every file of tests/pipelines/broken is refused, each with the place and the key that its first lines name:
//   # expect: LINE:COLUMN: path.to.key: words that must stand in the message
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/pipeline/graph.hpp"

namespace plumbline::pipeline {
namespace {

namespace fs = std::filesystem;

const fs::path kBroken = fs::path(PLUMBLINE_SOURCE_DIR) / "tests" / "pipelines" / "broken";
const fs::path kShippedPipelines = fs::path(PLUMBLINE_SOURCE_DIR) / "pipelines";

/// Refused by a schema already: shapes, keys, types, ranges. What needs the whole graph or the text itself:
/// graph.
std::vector<fs::path> files(const std::string& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(kBroken / folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

bool is_chain(const fs::path& file) { return file.filename().string().rfind("chain_", 0) == 0; }

core::Result<void> load(const fs::path& file) {
  StageRegistry registry;
  register_stages(registry);
  core::Error error;
  if (is_chain(file)) {
    const auto chain = cloud::FilterChain::load(file, registry.filters());
    if (chain) return {};
    error = chain.error();
  } else {
    const auto graph = load_graph(file, registry, kShippedPipelines);
    if (graph) return {};
    error = graph.error();
  }
  return tl::unexpected<core::Error>(error);
}

std::vector<std::string> expectations(const fs::path& file) {
  const std::string mark = "# expect: ";
  std::vector<std::string> expected;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (line.rfind(mark, 0) == 0) expected.push_back(line.substr(mark.size()));
  }
  return expected;
}

class Broken : public testing::TestWithParam<fs::path> {};

TEST_P(Broken, IsRefusedWithPlaceAndKey) {
  const auto loaded = load(GetParam());
  ASSERT_FALSE(loaded) << "accepted";
  EXPECT_EQ(loaded.error().kind, core::ErrorKind::kUsage);
  const std::vector<std::string> expected = expectations(GetParam());
  ASSERT_FALSE(expected.empty()) << "says nothing of what is expected:\n" << loaded.error().message;
  std::vector<std::string> lines;
  std::istringstream message(loaded.error().message);
  for (std::string line; std::getline(message, line);) lines.push_back(line);
  // All that is told is meant: nothing may follow from the mistake that is none itself.
  EXPECT_EQ(lines.size(), expected.size()) << loaded.error().message;
  for (const std::string& e : expected) {
    const auto told = std::find_if(lines.begin(), lines.end(), [&](const std::string& line) {
      return line.find(GetParam().filename().string() + ":" + e) != std::string::npos;
    });
    EXPECT_NE(told, lines.end()) << e << "\nnot in\n" << loaded.error().message;
  }
}

std::string name_of(const testing::TestParamInfo<fs::path>& info) { return info.param.stem().string(); }
INSTANTIATE_TEST_SUITE_P(Schema, Broken, testing::ValuesIn(files("schema")), name_of);
INSTANTIATE_TEST_SUITE_P(Graph, Broken, testing::ValuesIn(files("graph")), name_of);

TEST(BrokenFiles, AreManyOfBothKinds) {
  EXPECT_GE(files("schema").size(), 40U);
  EXPECT_GE(files("graph").size(), 20U);
}

TEST(BrokenFiles, OverAMegabyteIsRefusedUnread) {
  const fs::path file = fs::path(testing::TempDir()) / "plumbline_large.yaml";
  std::ofstream(file) << "description: " << std::string(1'000'000, 'x') << "\nstages: {read: {type: read}}\n";
  const auto loaded = load(file);
  ASSERT_FALSE(loaded);
  EXPECT_NE(loaded.error().message.find("plumbline_large.yaml: the file is over 1 MB"), std::string::npos);
  fs::remove(file);
}

}  // namespace
}  // namespace plumbline::pipeline
