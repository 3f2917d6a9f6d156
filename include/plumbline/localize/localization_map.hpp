// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A finished map that cameras are located in. It is read once and never changed, in memory or on disk.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::localize {

struct LocalizationMap {
  maps::Map map;                        ///< of all robots that met
  std::vector<maps::RobotInfo> robots;  ///< robots of the map's ids, with their cameras
  geometry::Rigid3 output_from_map;     ///< leads to the frame of the map's results
  bool upright = false;                 ///< z is up in that frame
};

/// Reads a result folder, a fused map or a map.db; several programs may do so at once, also from a read-only
/// medium. Errors (kInput): no map.db, damaged, of a run that has not ended, without keyframes.
core::Result<LocalizationMap> open_localization_map(const std::filesystem::path& input);

/// The camera as the map's run found it, if `given` is the camera that one of its robots began with: its
/// landmarks lie where that camera sees them. None: another camera, or the run kept the given one.
std::optional<sensor::Camera> refined_in(const LocalizationMap& map, const sensor::Camera& given);

}  // namespace plumbline::localize
