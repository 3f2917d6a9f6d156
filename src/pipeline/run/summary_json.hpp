// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// summary.json by its parts.
#include <cmath>
#include <nlohmann/json.hpp>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/pipeline/summary.hpp"

namespace plumbline::pipeline {

using Json = nlohmann::ordered_json;

/// Numbers are for people: 4 decimals are more than any of them is good for.
inline double rounded(double value) { return std::round(value * 1e4) / 1e4; }

/// The 4 x 4 matrix, row by row.
inline Json rows(const geometry::Rigid3& transform) {
  Json matrix = Json::array();
  const Eigen::Matrix4d values = transform.isometry().matrix();
  for (int row = 0; row < 4; ++row) {
    matrix.push_back({values(row, 0), values(row, 1), values(row, 2), values(row, 3)});
  }
  return matrix;
}

Json cameras_of(const RunSummary& summary);
Json merge_of(const RunSummary::Merge& merge);
Json merges_of(const RunSummary& summary);
Json meetings_of(const RunSummary& summary);

}  // namespace plumbline::pipeline
