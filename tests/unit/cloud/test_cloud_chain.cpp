// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "test_cloud_worlds.hpp"

namespace plumbline::cloud {
namespace {

std::filesystem::path source(const std::string& path) {
  return std::filesystem::path(PLUMBLINE_SOURCE_DIR) / path;
}

core::Result<FilterChain> load(const std::string& text) {
  const auto file = std::filesystem::path(testing::TempDir()) / "plumbline_chain.yaml";
  std::ofstream(file) << text;
  return FilterChain::load(file, builtin_filters());
}

TEST(FilterChain, AllProblemsAreToldAtOnceWithTheirPlace) {
  const auto chain = load(
      "chain: broken\n"
      "filtres: []\n"
      "filters:\n"
      "  - type: voxel_gird\n"
      "  - type: pass_through\n"
      "    mx: 3\n"
      "    min: 5 kg\n"
      "  - type: voxel_grid\n"
      "    leaf: -1 m\n"
      "  - leaf: 1 cm\n"
      "  - just a word\n"
      "  - {type: pass_through, min: 3, max: 2}\n");
  ASSERT_FALSE(chain);
  EXPECT_EQ(chain.error().kind, core::ErrorKind::kUsage);
  const std::string& m = chain.error().message;
  for (const std::string words :
       {"plumbline_chain.yaml:2:1: filtres: unknown key", "did you mean filters?",
        ":4:11: filters[0].type: 'voxel_gird'", "did you mean voxel_grid?",
        ":6:5: filters[1].mx: unknown key", "did you mean max?",
        ":7:10: filters[1].min:", ":9:11: filters[2].leaf: -1", ":10:5: filters[3]: has no type",
        ":11:5: filters[4]: is not a filter", ":12:5: filters[5]: min (3) must be less than max (2)"}) {
    EXPECT_NE(m.find(words), std::string::npos) << words << "\nis not in\n" << m;
  }
}

TEST(FilterChain, NotAChain) {
  for (const std::string text : {"", "filters: []\n", "chain: a\n", "- 1\n", "chain: a\nfilters: 3\n",
                                 "chain: a b\nfilters: []\n", "chain: [\n"}) {
    EXPECT_FALSE(load(text)) << text;
  }
  EXPECT_FALSE(FilterChain::load("/no/such/chain.yaml", builtin_filters()));
}

TEST(FilterChain, SpelledOutChainReadsBackTheSame) {
  const auto chain = load(
      "chain: a\nfilters:\n  - {type: radius_outlier, radius: 250 cm}\n  - type: crop_box\n  - type: "
      "pass_through\n");
  ASSERT_TRUE(chain) << chain.error().message;
  const auto again = load(chain->to_yaml());
  ASSERT_TRUE(again) << again.error().message << "\n" << chain->to_yaml();
  EXPECT_EQ(again->to_yaml(), chain->to_yaml());
  EXPECT_EQ(again->size(), 3U);
  EXPECT_NE(chain->to_yaml().find("radius: 2.5 m"), std::string::npos) << chain->to_yaml();
}

TEST(FilterChain, ReportsCountPointsThatAreThere) {
  const auto chain =
      load("chain: a\nfilters:\n  - {type: pass_through, max: 2}\n  - {type: voxel_grid, leaf: 10 m}\n");
  ASSERT_TRUE(chain);
  auto cloud = std::make_shared<Cloud>(2, 2, worlds::point(0, 0, 1));
  (*cloud)(0, 0).z = 5.0F;
  (*cloud)(1, 0).x = std::numeric_limits<float>::quiet_NaN();
  std::vector<FilterReport> reports;
  const auto output = chain->apply(cloud, {}, &reports);
  ASSERT_TRUE(output);
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_EQ(reports[0].points_in, 3U);
  EXPECT_EQ(reports[0].points_out, 2U);
  EXPECT_EQ(reports[1].type, "voxel_grid");
  EXPECT_EQ(reports[1].points_out, 1U);
  EXPECT_NE(to_table(reports).find("voxel_grid"), std::string::npos);
  const auto empty = load("chain: nothing\nfilters: []\n");
  ASSERT_TRUE(empty) << empty.error().message;
  EXPECT_EQ((*empty->apply(cloud))->size(), 4U);
}

TEST(FilterChain, ShippedChainsLoadAndRunOnAKeyframe) {
  const auto registry = builtin_filters();
  std::size_t chains = 0;
  for (const auto& entry : std::filesystem::directory_iterator(source("pipelines/filters"))) {
    if (entry.path().extension() != ".yaml") continue;
    ++chains;
    const auto chain = FilterChain::load(entry.path(), registry);
    ASSERT_TRUE(chain) << chain.error().message;
    EXPECT_EQ(chain->name(), entry.path().stem().string());
    sensor::Pinhole small{160, 120, 131.0, 131.0, 79.5, 59.5};
    const auto frame = worlds::frame_of(worlds::plane_depth({0, 0, 1}, 1.0, 1.0, 1, small));
    const auto output = chain->apply(organised_cloud(frame, small));
    ASSERT_TRUE(output) << output.error().message;
    EXPECT_GT((*output)->size(), 3000U) << entry.path();
  }
  EXPECT_GE(chains, 2U);
}

TEST(FilterRegistry, RefusesTheSameTypeTwice) {
  auto registry = builtin_filters();
  EXPECT_THROW(registry.add(FilterInfo(*registry.find("crop_box"))), std::invalid_argument);
  EXPECT_EQ(registry.find("crop"), nullptr);
  EXPECT_TRUE(std::is_sorted(registry.filters().begin(), registry.filters().end(),
                             [](const auto& a, const auto& b) { return a.type < b.type; }));
}

TEST(FilterRegistry, ExamplesOfTheReferenceLoad) {
  const auto registry = builtin_filters();
  for (const auto& info : registry.filters()) {
    std::string indented = "  " + info.example;
    for (std::size_t at = indented.find('\n'); at + 1 < indented.size(); at = indented.find('\n', at + 1)) {
      indented.insert(at + 1, "  ");
    }
    const auto chain = load("chain: example\nfilters:\n" + indented);
    EXPECT_TRUE(chain) << info.type << ": " << (chain ? "" : chain.error().message);
    EXPECT_FALSE(info.summary.empty() || info.details.empty()) << info.type;
  }
}

TEST(FilterRegistry, ReferencePageIsUpToDate) {
  const std::string made = filters_reference(builtin_filters());
  EXPECT_TRUE(made == worlds::slurp(source("docs/reference/filters.md")))
      << "docs/reference/filters.md is not what the filters declare; run: plumbline filters describe > "
         "docs/reference/filters.md";
}

}  // namespace
}  // namespace plumbline::cloud
