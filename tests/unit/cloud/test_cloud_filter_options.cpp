// SPDX-License-Identifier: BSD-3-Clause
// What holds for every filter and every option: limits, example chain, picture.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "test_cloud_filter_run.hpp"

namespace plumbline::cloud {
namespace {

namespace fs = std::filesystem;

struct Case {
  std::string type;
  core::OptionSpec option;
};

std::vector<Case> all_options() {
  std::vector<Case> cases;
  const FilterRegistry registry = builtin_filters();
  for (const FilterInfo& info : registry.filters()) {
    const auto filter = info.make();
    core::OptionTable table;
    filter->declare(table);
    for (const core::OptionSpec& option : table.specs()) cases.push_back({info.type, option});
  }
  return cases;
}

/// The problems of one option given this value, as told for line 4 of a chain's file.
std::string problems_of(const Case& c, const std::string& value) {
  const auto node = core::parse_yaml(
      fmt::format("chain: test\nfilters:\n  - type: {}\n    {}: {}\n", c.type, c.option.key, value),
      "t.yaml");
  if (!node) return node.error().message;
  core::ConfigProblems problems;
  const auto chain = FilterChain::parse(*node, "", builtin_filters(), problems);
  core::ConfigProblems of_option;
  for (const auto& problem : problems) {
    if (problem.path == "filters[0]." + c.option.key) of_option.push_back(problem);
  }
  return core::to_string(of_option);
}

std::string repeated(const std::string& item, std::size_t count) {
  std::string text = "[";
  for (std::size_t i = 0; i < count; ++i) text += (i == 0 ? "" : ", ") + item;
  return text + "]";
}

void expect_refused(const Case& c, const std::string& value) {
  const std::string told = problems_of(c, value);
  EXPECT_EQ(told.rfind("t.yaml:4:", 0), 0U) << c.type << "." << c.option.key << ": " << value << "\n" << told;
  EXPECT_NE(told.find("filters[0]." + c.option.key), std::string::npos) << told;
}

void expect_taken(const Case& c, const std::string& value) {
  EXPECT_EQ(problems_of(c, value), "") << c.type << "." << c.option.key << ": " << value;
}

/// `wrap`: one number as the option's value.
template <typename Wrap>
void check_limits(const Case& c, double step, const Wrap& wrap) {
  const double below = step > 0.0 ? c.option.min - step : std::nextafter(c.option.min, -1e300);
  const double above = step > 0.0 ? c.option.max + step : std::nextafter(c.option.max, 1e300);
  expect_taken(c, wrap(fmt::format("{}", c.option.min)));
  expect_taken(c, wrap(fmt::format("{}", c.option.max)));
  for (const double value : {below, above}) {
    expect_refused(c, wrap(fmt::format("{}", value)));
    const std::string told = problems_of(c, wrap(fmt::format("{}", value)));
    EXPECT_NE(told.find("allowed"), std::string::npos) << "no range in: " << told;
  }
  for (const std::string word : {"nan", "inf", "wide", "1 kg", "''"}) expect_refused(c, wrap(word));
}

TEST(FilterOptions, EveryOptionKeepsToItsLimits) {
  const auto cases = all_options();
  ASSERT_GT(cases.size(), 40U);
  for (const Case& c : cases) {
    const auto as_it_is = [](const std::string& value) { return value; };
    switch (c.option.type) {
      case core::OptionType::kBoolean:
        for (const std::string word : {"on", "off", "true", "no"}) expect_taken(c, word);
        for (const std::string word : {"maybe", "1", "[on]"}) expect_refused(c, word);
        break;
      case core::OptionType::kInteger:
        check_limits(c, 1.0, as_it_is);
        expect_refused(c, fmt::format("{}.5", static_cast<long>(c.option.min)));
        break;
      case core::OptionType::kNumber:
        check_limits(c, 0.0, as_it_is);
        break;
      case core::OptionType::kNumbers:
        check_limits(c, 0.0, [&](const std::string& item) { return repeated(item, c.option.length); });
        expect_refused(c, repeated("0", c.option.length - 1));
        expect_refused(c, repeated("0", c.option.length + 1));
        break;
      case core::OptionType::kChoice:
        for (const std::string& word : c.option.choices) expect_taken(c, word);
        for (const std::string word : {"nonsense", "''", "[a]"}) expect_refused(c, word);
        break;
      default:
        expect_refused(c, "[a, b]");
        expect_refused(c, "{a: b}");
    }
    if (!c.option.choices.empty() || c.option.type == core::OptionType::kText) continue;
    expect_taken(c, c.option.default_value);
  }
}

CloudPtr small_keyframe() {
  const sensor::Pinhole pinhole{32, 24, 26.0, 26.0, 15.5, 11.5};
  const auto depth = worlds::plane_depth({0.3, 0.5, 0.8}, 1.0, 1.0, 1, pinhole);
  return organised_cloud(worlds::frame_of(depth), pinhole);
}

TEST(FilterOptions, EveryFilterRunsAtTheLimitsOfItsOptions) {
  const CloudPtr cloud = small_keyframe();
  for (const Case& c : all_options()) {
    std::vector<std::string> values = c.option.choices;
    if (c.option.type == core::OptionType::kBoolean) values = {"on", "off"};
    if (c.option.type == core::OptionType::kInteger || c.option.type == core::OptionType::kNumber) {
      values = {fmt::format("{}", c.option.min), fmt::format("{}", c.option.max)};
    }
    if (c.option.type == core::OptionType::kNumbers) {
      values = {repeated(fmt::format("{}", c.option.min), c.option.length),
                repeated(fmt::format("{}", c.option.max), c.option.length)};
    }
    for (const std::string& value : values) {
      std::string entry = worlds::least_entry(c.type);
      entry.insert(entry.size() - 1, fmt::format(", {}: {}", c.option.key, value));
      const auto result = worlds::run(entry, cloud);
      if (!result) {
        EXPECT_EQ(result.error().kind, core::ErrorKind::kUsage) << entry << ": " << result.error().message;
      } else {
        EXPECT_EQ((*result)->size(), std::size_t{(*result)->width} * (*result)->height) << entry;
      }
    }
  }
}

TEST(FilterOptions, EveryFilterHasAnExampleChainThatRunsAndAPicture) {
  const fs::path source = PLUMBLINE_SOURCE_DIR;
  const fs::path folder = worlds::temporary("examples");
  fs::create_directories(folder);
  const fs::path before = fs::current_path();
  fs::current_path(folder);
  ASSERT_TRUE(write_ply("other.ply", *worlds::square(5, 0.1F)));
  const CloudPtr cloud =
      organised_cloud(worlds::frame_of(worlds::plane_depth({0.1, 0.2, 0.97}, 1.5, 1.0, 1,
                                                           {160, 120, 131.0, 131.0, 79.5, 59.5})),
                      {160, 120, 131.0, 131.0, 79.5, 59.5});
  const FilterRegistry registry = builtin_filters();
  for (const FilterInfo& info : registry.filters()) {
    const auto chain =
        FilterChain::load(source / "pipelines/filters/examples" / (info.type + ".yaml"), registry);
    ASSERT_TRUE(chain) << chain.error().message;
    EXPECT_EQ(chain->name(), info.type);
    EXPECT_NE(chain->to_yaml().find("- type: " + info.type + "\n"), std::string::npos) << info.type;
    const auto output = chain->apply(cloud);
    EXPECT_TRUE(output) << output.error().message;
    EXPECT_TRUE(fs::is_regular_file(source / "docs/reference/pictures" / (info.type + ".png"))) << info.type;
  }
  fs::current_path(before);
}

TEST(FilterOptions, EveryExampleChainBelongsToAFilter) {
  const fs::path source = PLUMBLINE_SOURCE_DIR;
  const FilterRegistry registry = builtin_filters();
  for (const std::string folder : {"pipelines/filters/examples", "docs/reference/pictures"}) {
    for (const auto& entry : fs::directory_iterator(source / folder)) {
      EXPECT_NE(registry.find(entry.path().stem().string()), nullptr) << entry.path();
    }
  }
}

TEST(FilterOptions, ProgressTellsEveryFilterAndTheEnd) {
  const auto node = core::parse_yaml(
      "chain: test\nfilters:\n  - type: crop_box\n  - {type: voxel_grid, leaf: 10 cm}\n", "t.yaml");
  core::ConfigProblems problems;
  const auto chain = FilterChain::parse(*node, "", builtin_filters(), problems);
  std::string told;
  ASSERT_TRUE(chain.apply(small_keyframe(), {}, nullptr, [&](auto done, auto total, const auto& type) {
    told += fmt::format("{}/{} {};", done, total, type);
  }));
  EXPECT_EQ(told, "0/2 crop_box;1/2 voxel_grid;2/2 ;");
}

}  // namespace
}  // namespace plumbline::cloud
