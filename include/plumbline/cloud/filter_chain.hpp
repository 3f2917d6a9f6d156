// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Filter chains are files:
//
//   chain: keyframe
//   filters:
//     - type: range
//       max: 3.5 m
//     - type: voxel_grid
//       leaf: 1 cm
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "plumbline/cloud/filter.hpp"
#include "plumbline/core/config.hpp"

namespace plumbline::cloud {

/// What one filter did. Points are those with finite coordinates.
struct FilterReport {
  std::string type;
  std::size_t points_in = 0;
  std::size_t points_out = 0;
  double ms = 0.0;
};

/// Filters in the order they are applied. Cheap to copy; const use from several threads is safe.
class FilterChain {
 public:
  /// All problems of the file are told at once as file:line:column (kUsage).
  static core::Result<FilterChain> load(const std::filesystem::path& file, const FilterRegistry& registry);
  /// The same from a parsed tree, e.g. a chain inside a pipeline; `path` is the dotted path of `node`.
  static FilterChain parse(const core::ConfigNode& node, const std::string& path,
                           const FilterRegistry& registry, core::ConfigProblems& problems);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::size_t size() const { return filters_.size(); }
  /// The chain with every option spelt out, as YAML that `load` accepts.
  [[nodiscard]] std::string to_yaml() const;

  /// Runs the chain; an empty chain gives a copy. Errors name chain, place and filter. `reports` (may be
  /// null) gets one entry per filter run.
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context = {},
                               std::vector<FilterReport>* reports = nullptr) const;

 private:
  struct Step {
    std::string type;
    std::shared_ptr<const Filter> filter;
    std::string yaml;
  };
  std::string name_;
  std::vector<Step> filters_;
};

/// "filter  points in  points out  ms" as an aligned text table.
std::string to_table(const std::vector<FilterReport>& reports);

}  // namespace plumbline::cloud
