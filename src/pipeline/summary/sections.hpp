// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Sections of summary.json. Each stage fills in its own (Stage::report); parts that several stages share are
// here.
#include <cstddef>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/numbers.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/pipeline/data.hpp"

namespace plumbline::pipeline {

using Json = nlohmann::ordered_json;

/// All sections, in their order, as of a run in which nothing happened.
Json empty_sections();

/// Rounds to 4 decimals, more than any reported number is accurate to.
double rounded(double value);

/// The 4 x 4 matrix, row by row.
Json rows(const geometry::Rigid3& transform);

/// Median and 90th percentile of standard deviations; NaN: not known.
struct Sigma {
  double median = std::numeric_limits<double>::quiet_NaN();
  double p90 = std::numeric_limits<double>::quiet_NaN();
};
/// Median and 90th percentile of the values that are known.
template <typename T>
Sigma sigma_of(const std::vector<T>& values) {
  return {static_cast<double>(core::quantile(values, 0.5)), static_cast<double>(core::quantile(values, 0.9))};
}
/// null: not known.
Json section_of(const Sigma& sigma);

/// Adds to a number of a section.
void add(Json& number, std::size_t more);

/// The section `frames`.
struct FrameCounts {
  std::size_t available = 0;
  std::size_t read = 0, resumed = 0, unreadable = 0, missing = 0;
  std::size_t odometry = 0;  ///< with a pose of the recorder's own
  std::size_t tracked = 0, lost = 0, blind = 0, longest_loss = 0;
  std::optional<std::size_t> bridged;          ///< none: without sensors of the body
  std::map<std::string, std::size_t> lost_by;  ///< numbers of lost frames by reason
  double period_s = 0.0;

  FrameCounts() = default;
  explicit FrameCounts(const Json& summary);
  void write(Json& summary) const;
  /// Counts what became of the frames that were read.
  void count(const std::vector<FrameRow>& rows);
  [[nodiscard]] double tracked_percent() const;
};

/// Points that filters left out, by the filter's type.
Json left_out_section(const std::vector<std::pair<std::string, std::size_t>>& left_out);

/// Sentence on measured points that are missing in the cloud; empty if there are hardly any.
std::string left_out_text(const Json& cloud);
/// Sentence on points that the merged cloud's filters removed; empty if none.
std::string left_out_of_map_text(const Json& cloud);

/// Adds a doubt if more frames have no pose than would be trusted.
void doubt_lost_frames(const Json& summary, std::vector<Doubt>& reasons);
/// Adds a doubt if a cloud was to be made and is empty.
void doubt_empty_cloud(const Json& summary, std::vector<Doubt>& reasons);

}  // namespace plumbline::pipeline
