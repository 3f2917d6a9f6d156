// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Runs single filters on small clouds.
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "test_cloud_worlds.hpp"

namespace plumbline::cloud::worlds {

inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Runs one filter written as YAML list entry.
inline core::Result<CloudPtr> run(const std::string& entry, const CloudConstPtr& input,
                                  const FilterContext& context = {}) {
  core::ConfigProblems problems;
  const auto node = core::parse_yaml("chain: test\nfilters:\n  - " + entry, "test.yaml");
  if (!node) return tl::unexpected<core::Error>(node.error());
  const auto chain = FilterChain::parse(*node, "", builtin_filters(), problems);
  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));
  return chain.apply(input, context);
}

inline CloudPtr must(const std::string& entry, const CloudConstPtr& input,
                     const FilterContext& context = {}) {
  auto result = run(entry, input, context);
  EXPECT_TRUE(result) << (result ? "" : result.error().message);
  return result ? *result : std::make_shared<Cloud>();
}

inline CloudPtr list(const std::vector<Point>& points) {
  auto cloud = std::make_shared<Cloud>();
  for (const Point& p : points) cloud->push_back(p);
  return cloud;
}

/// Points of a square plane in z = 1, `n` x `n`, `step` metres apart.
inline CloudPtr square(int n, float step) {
  auto cloud = std::make_shared<Cloud>();
  for (int i = 0; i < n * n; ++i) {
    cloud->push_back(point(static_cast<float>(i % n) * step, static_cast<float>(i / n) * step, 1.0F));
  }
  return cloud;
}

/// `count` points around 0, one metre standard deviation.
inline CloudPtr gauss_ball(int count) {
  std::mt19937 random(3);
  std::normal_distribution<float> gauss(0.0F, 1.0F);
  auto cloud = std::make_shared<Cloud>();
  for (int i = 0; i < count; ++i) {
    const float x = gauss(random);
    const float y = gauss(random);
    cloud->push_back(point(x, y, gauss(random)));
  }
  return cloud;
}

inline std::string temporary(const std::string& name) {
  return (std::filesystem::path(testing::TempDir()) / ("plumbline_filters_" + name)).string();
}

/// The filter with its defaults, and what it cannot do without.
inline std::string least_entry(const std::string& type) {
  if (type == "merge") {
    EXPECT_TRUE(write_ply(temporary("empty.ply"), Cloud()));
    return "{type: merge, file: " + temporary("empty.ply") + "}";
  }
  if (type == "tee") return "{type: tee, file: " + temporary("tee.ply") + "}";
  return "{type: " + type + "}";
}

}  // namespace plumbline::cloud::worlds
