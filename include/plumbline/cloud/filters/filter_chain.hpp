// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Filter chains are files:
//
//   chain: keyframe
//   filters:
//     - type: pass_through
//       max: 3.5
//     - type: voxel_grid
//       leaf: 1 cm
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "plumbline/cloud/filters/filter.hpp"
#include "plumbline/cloud/fusion/voxel_map.hpp"
#include "plumbline/core/config.hpp"

namespace plumbline::cloud {

/// Counts of one filter. Points are those with finite coordinates.
struct FilterReport {
  std::string type;
  std::size_t points_in = 0;
  std::size_t points_out = 0;
  double ms = 0.0;
};

/// Progress of a chain: filters done, filters in all, and the one that runs now ("" at the end).
using ChainProgress = std::function<void(std::size_t done, std::size_t total, const std::string& type)>;

/// Filters in the order they are applied. Cheap to copy; const use from several threads is safe.
class FilterChain {
 public:
  /// All problems of the file are reported at once as file:line:column (kUsage).
  static core::Result<FilterChain> load(const std::filesystem::path& file, const FilterRegistry& registry);
  /// The same from a parsed tree, e.g. a chain inside a pipeline; `path` is the dotted path of `node`.
  static FilterChain parse(const core::ConfigNode& node, const std::string& path,
                           const FilterRegistry& registry, core::ConfigProblems& problems);
  /// The same from the list of filters alone; the last word of `path` names the chain.
  static FilterChain parse_list(const core::ConfigNode& list, const std::string& path,
                                const FilterRegistry& registry, core::ConfigProblems& problems);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::size_t size() const { return filters_.size(); }
  [[nodiscard]] std::vector<std::string> types() const;  ///< types of the filters, in their order
  /// The chain with every option spelt out, as YAML that `load` accepts.
  [[nodiscard]] std::string to_yaml() const;

  /// Problem that keeps the chain from running, such as a missing file of merge; nothing is read or written
  /// yet.
  [[nodiscard]] core::Result<void> ready(const FilterContext& context = {}) const;
  /// Filter::reach_m() of all filters together. Errors (kUsage) name a filter that needs the whole cloud.
  [[nodiscard]] core::Result<double> reach_m() const;
  /// The files that its filters write (tee), in their order.
  [[nodiscard]] std::vector<std::string> writes() const;

  /// Runs the chain when it is ready; an empty chain gives a copy. Errors name chain, position and filter.
  /// Every filter's input is released once it is used: if `input` is moved in, no more than two clouds exist
  /// at a time. Columns: `context.columns` are those of the input, `context.made_columns` gets those of the
  /// result. `reports` (may be null) gets one entry per filter run; `progress` is called before each filter
  /// and at the end.
  core::Result<CloudPtr> apply(CloudConstPtr input, const FilterContext& context = {},
                               std::vector<FilterReport>* reports = nullptr,
                               const ChainProgress& progress = {}) const;
  /// The same for a fused cloud and its columns; an empty chain returns both unchanged.
  core::Result<FusedCloud> apply(FusedCloud fused, double spacing_m, const core::Executor& executor,
                                 std::vector<FilterReport>* reports = nullptr) const;

 private:
  [[nodiscard]] core::Error at(std::size_t step, const core::Error& error) const;
  core::Result<FusedCloud> run(CloudConstPtr input, CloudColumns columns, FilterContext context,
                               std::vector<FilterReport>* reports, const ChainProgress& progress) const;

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
