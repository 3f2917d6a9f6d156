// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Checks and cleans the input before it is measured.
#include <cstdint>
#include <memory>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/evaluate/cloud.hpp"
#include "surfaces/point_index.hpp"

namespace plumbline::evaluate {

core::Result<void> check(const CloudOptions& options);
core::Result<void> check(const Reference& reference);

/// Finite points of a cloud; normals unit or zero, all left out if none is usable.
struct PreparedCloud {
  std::unique_ptr<SurfaceSamples> samples;
  std::unique_ptr<PointIndex> index;  ///< index of samples->points
  std::vector<std::uint32_t> source;  ///< number of each point in the cloud as given
  Density density;
};
/// Fills in the report's counts, density and warnings.
core::Result<PreparedCloud> prepare(const SurfaceSamples& cloud, const core::Executor& executor,
                                    CloudReport& report);

/// `given` with the unknown ones estimated from neighbouring points.
std::vector<Eigen::Vector3f> known_normals(const std::vector<Eigen::Vector3f>& given, const PointIndex& index,
                                           const core::Executor& executor);

double surface_area(const TriangleMesh& mesh);

}  // namespace plumbline::evaluate
