// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Comparison of the surfaces of a map with those of a later visit (docs/method/another_visit.md).
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/fusion/cell_map.hpp"
#include "plumbline/cloud/fusion/dense_fusion.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::pipeline {

/// A view of the map or of the visit, with the pose of its camera in the common frame.
struct VisitedView {
  geometry::Rigid3 world_from_camera;
  sensor::Pinhole camera;
  bool of_visit = false;
};

struct VisitChanges {
  cloud::CellMap<std::uint8_t> gone;  ///< cells whose surface the visit looked through
  /// By view of the map, for each point of its cloud: 1 if it must go, because its surface is gone or because
  /// something new stands before it. Empty: all stay.
  std::vector<std::vector<std::uint8_t>> removed;
  /// By view of the visit: new cells that it shows, ascending, and their share of all its cells.
  std::vector<std::vector<std::uint32_t>> shows;
  std::vector<double> share_new;
  std::size_t gone_points = 0;  ///< of the map's views
  std::size_t new_cells = 0;

  [[nodiscard]] bool is_gone(const Eigen::Vector3d& position) const;
};

/// Edge of the cells in which surfaces are compared, metres.
constexpr double kVisitCell_m = 0.03;

/// Compares the views of a map with those of a visit. `read`: the cloud of a view, always with the same
/// points. The same for any number of threads. Errors are those of `read`.
core::Result<VisitChanges> find_changes(const std::vector<VisitedView>& views, const cloud::ReadView& read,
                                        const core::Executor& executor);

}  // namespace plumbline::pipeline
