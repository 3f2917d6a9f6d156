// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A map as the scene of a page that turns it in the browser (plumbline/viewer/page.hpp).
#include <array>
#include <string>
#include <vector>

#include "plumbline/exports/export.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/viewer/scene.hpp"

namespace plumbline::exports {

/// Mark by which a page that holds only the viewer is recognised.
inline constexpr const char* kViewGenerator = "plumbline view";

/// A floor plan for a page.
struct PlanPage {
  struct Table {
    std::string title;
    std::vector<std::string> columns;
    std::vector<std::vector<std::string>> rows;
  };
  std::string svg;            ///< in a round scale, at most as wide as A4; empty: no plan was found
  std::vector<Table> tables;  ///< rooms, openings
};

struct MapView {
  viewer::Scene scene;
  PlanPage plan;
  std::vector<std::string> notes;  ///< whole sentences on missing parts of the scene, with reasons
  /// From the own frames of the map, or the two, into that of the scene.
  std::array<geometry::Rigid3, 2> world_from_map = {};
  geometry::Rigid3 first_from_second;  ///< of two: from the frame of the second one's results
};

/// All that the map has to show: cloud with its layers, paths, keyframes with small pictures where the
/// request can open recordings, lines, loops, plan. Of the options of `request`, the selection, `points`,
/// `voxel_m` and `cut_m` count. Errors (kInput): there is no map, or no cloud in it.
core::Result<MapView> view_of(const ExportRequest& request, const core::Executor& executor, core::Log& log,
                              const ExportProgress& progress);

/// The same with the cloud of a second map over it, moved into the first one's frame by cameras of the same
/// stamp, else by places that both show, or of mere clouds by ICP; the scene says how and how well. Each has
/// its distance to the other one as a layer. `by_cameras`: false of maps of different days. Errors:
/// kUntrustworthy: nothing shows how the two lie; kInput of either.
core::Result<MapView> view_of_two(const ExportRequest& first, const ExportRequest& second,
                                  const core::Executor& executor, core::Log& log,
                                  const ExportProgress& progress, bool by_cameras = true);

}  // namespace plumbline::exports
