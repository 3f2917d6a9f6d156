// SPDX-License-Identifier: BSD-3-Clause
// What dense fusion asks for, and what it wants to know of a view before it is laid down.
#include "plumbline/cloud/dense_fusion.hpp"
#include "plumbline/cloud/exposure.hpp"
#include "plumbline/cloud/free_space.hpp"
#include "plumbline/cloud/view_points.hpp"

namespace plumbline::cloud {

void DenseFusionOptions::declare(core::OptionTable& table) {
  voxels.declare(table);
  table.integer("min_observations", min_observations, {1, 1000}, "",
                "Keyframes that must have seen a voxel for it to stay");
  table.boolean("settle", settle,
                "Lay the points of flat pieces of surface on their common plane: thin walls");
  table.boolean("free_space", free_space, "Remove what other keyframes look through: people, flying pixels");
  table.boolean("exposure", exposure, "Even out colours between keyframes");
  table.integer("min_support", min_support, {0, 1000}, "",
                "Points with fewer others around that face the same way are dust and go; 0: none");
  table.number(
      "tile_mb", tile_mb, {16.0, 100000.0}, "",
      "Memory that one tile of the map may take, MB; as many as may take six times that are filled together");
}

ViewSummary summarise_view(const ViewPoints& points, const sensor::Pinhole& camera,
                           const DenseFusionOptions& options) {
  ViewSummary summary;
  summary.look = is_look(points, camera);
  if (!summary.look) summary.spots = color_spots(points);
  if (options.free_space) summary.raster = depth_raster(points, camera);
  return summary;
}

ViewSummary summarise_view(const Cloud& camera_cloud, const sensor::Pinhole& camera,
                           const DenseFusionOptions& options) {
  ViewPoints points;
  take_points(camera_cloud, points);
  return summarise_view(points, camera, options);
}

}  // namespace plumbline::cloud
