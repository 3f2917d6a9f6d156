// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Interface of a cloud filter, and the list of those that exist. A filter is a class with declared options,
// one registration (a FilterInfo) and its texts for the reference page docs/reference/filters.md, which is
// made from these.
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/options.hpp"

namespace plumbline::cloud {

struct CloudColumns;
struct CloudFrame;

/// Additional knowledge that a filter may use.
struct FilterContext {
  /// Position of the sensor in the cloud's frame; without it the cloud's own sensor_origin_.
  std::optional<Eigen::Vector3f> viewpoint;
  /// Offset that was subtracted from the positions while reading (CloudFile::shift): options in metres refer
  /// to positions with it.
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  /// Distance of neighbouring points, metres, if it is known (the voxel of a fused cloud); 0: unknown.
  double spacing_m = 0.0;
  /// The frame of the input, as far as it is known; a filter that moves points changes it. Null:
  /// not known and not needed.
  CloudFrame* frame = nullptr;
  std::uint32_t seed = 0;  ///< seed of random choices
  /// Threads for the filters that can use several; without it one. Results do not depend on it.
  const core::Executor* executor = nullptr;
  /// Number of this run among many ("12"): part of the names of files that filters write. Empty: the only
  /// one.
  std::string run;
  /// Columns of the input's points beside the Point (confidence ...); null: there are none.
  const CloudColumns* columns = nullptr;
  /// If not null, a filter that makes points of several, or takes some from elsewhere, puts the columns of
  /// its output here. Others leave it alone: the chain follows the points by itself (carry_columns).
  CloudColumns* made_columns = nullptr;
};

class Filter {
 public:
  virtual ~Filter() = default;
  /// Binds the options of this very filter.
  virtual void declare(core::OptionTable& table) = 0;
  /// Problem with the options taken together, "" if there is none.
  [[nodiscard]] virtual std::string check() const { return ""; }
  /// Problem that keeps the filter from running, found before the chain begins: missing files.
  [[nodiscard]] virtual core::Result<void> ready(const FilterContext& /*context*/) const { return {}; }
  /// The file that it writes, "" if none: no two filters may write the same.
  [[nodiscard]] virtual std::string writes() const { return ""; }
  /// Distance within which other points decide about a point, metres: so wide a margin around a part of the
  /// cloud gives the part the points that the whole would. None: the whole cloud decides.
  [[nodiscard]] virtual std::optional<double> reach_m() const { return std::nullopt; }
  /// The input is never changed; returning it as it came is not allowed. Filters that only choose points keep
  /// an organised cloud organised (rejected points become NaN). Const and free of hidden state: one filter
  /// may run on several threads. Errors: kUsage when the options do not fit this cloud (message without the
  /// filter's name).
  [[nodiscard]] virtual core::Result<CloudPtr> apply(const CloudConstPtr& input,
                                                     const FilterContext& context) const = 0;
};

struct FilterInfo {
  std::string type;     ///< as in `type: voxel_grid`
  std::string summary;  ///< one line
  std::string details;  ///< a paragraph for the reference page
  std::string example;  ///< YAML of one list entry
  std::function<std::unique_ptr<Filter>()> make;
};

class FilterRegistry {
 public:
  /// Throws std::invalid_argument on a type that is there already.
  void add(FilterInfo info);
  [[nodiscard]] const FilterInfo* find(const std::string& type) const;
  [[nodiscard]] const std::vector<FilterInfo>& filters() const& { return filters_; }  ///< sorted by type
  const std::vector<FilterInfo>& filters() const&& = delete;
  [[nodiscard]] std::vector<std::string> types() const;

 private:
  std::vector<FilterInfo> filters_;
};

/// List all filters of this library.
FilterRegistry builtin_filters();

/// The reference page of a registry's filters as Markdown (docs/reference/filters.md).
std::string filters_reference(const FilterRegistry& registry);

}  // namespace plumbline::cloud
