// SPDX-License-Identifier: BSD-3-Clause
#include "clouds/columns_text.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <iterator>

namespace plumbline::exports {

/// Names of the columns that put_text_rows() writes.
std::vector<std::string> text_columns(const cloud::CloudFile& file) {
  std::vector<std::string> names{"x", "y", "z", "red", "green", "blue"};
  if (file.has_normals) names.insert(names.end(), {"nx", "ny", "nz"});
  if (!file.columns.confidence.empty()) names.emplace_back("confidence");
  if (!file.columns.observations.empty()) names.emplace_back("observations");
  if (!file.columns.robot.empty()) names.emplace_back("robot");
  for (const auto& other : file.columns.others) names.push_back(other.name);
  return names;
}

/// A row of text for each point, in coordinates without a shift.
void put_text_rows(core::OutputFile& out, const cloud::CloudFile& file, char between) {
  std::string row;
  const auto put = [&](auto value, const char* form) {
    row += between;
    fmt::format_to(std::back_inserter(row), fmt::runtime(form), value);
  };

  // Columns in the order of text_columns()
  for (std::size_t i = 0; i < file.cloud->size(); ++i) {
    const cloud::Point& p = (*file.cloud)[i];
    row.clear();
    for (int k = 0; k < 3; ++k) put(static_cast<double>(p.data[k]) + file.shift[k], "{:.5f}");

    for (const std::uint8_t channel : {p.r, p.g, p.b}) put(static_cast<int>(channel), "{}");

    // A normal that is not known is zero
    if (file.has_normals) {
      const bool known = p.getNormalVector3fMap().allFinite();
      for (int k = 0; k < 3; ++k) put(known ? p.normal[k] : 0.0F, "{:.4f}");
    }

    if (!file.columns.confidence.empty()) put(file.columns.confidence[i], "{:.4g}");
    if (!file.columns.observations.empty()) put(file.columns.observations[i], "{}");
    if (!file.columns.robot.empty()) put(static_cast<int>(file.columns.robot[i]), "{}");

    // Further columns; the row's first separator is left out
    for (const auto& other : file.columns.others) put(other.values[i], "{:.4g}");
    row += '\n';
    out.write(row.data() + 1, row.size() - 1);
  }
}

}  // namespace plumbline::exports
