// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A finished map brought to scale, level and world coordinates by what was measured besides it: a similarity
// first, then the map bends by its own covariance (docs/guide/control.md).
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/adjust/control.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/maps/stored_maps.hpp"

namespace plumbline::adjust {

struct AdjustRequest {
  std::vector<Control> control;
  std::filesystem::path edits;  ///< edits.yaml for the result, in the given map's frame; empty: the map's own
  std::filesystem::path tags;   ///< tags.yaml: where tags are in the world; empty: none are looked for
  int epsg = 0;                 ///< system of the points' world coordinates; 0: the site's own grid
  std::vector<double>
      datum;  ///< latitude, longitude, heading of x (degrees), height of the map's origin; empty: none
};

/// One observation after the adjustment.
struct ControlFinding {
  std::string name;
  double before_m =
      0.0;  ///< observed less the map, as it was given; of several numbers the root of the squares
  double after_m = 0.0;       ///< and as it is now
  double off_m = 0.0;         ///< what all others say that it is off by
  double detectable_m = 0.0;  ///< smallest blunder that would have shown, four standard deviations
  bool checked = false;       ///< the others could have shown a blunder
  bool left_out = false;      ///< it is one
};

/// World coordinates of an adjusted map: world = origin + turn about z and scale in the plane * map.
struct WorldPlace {
  int epsg = 0;
  std::string name;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< east, north, height
  double turn = 0.0;                                 ///< from east to x, radians, counter-clockwise
  double scale = 1.0;                                ///< grid metres a true metre
  double convergence = 0.0;  ///< from grid north to true north, radians, counter-clockwise
  /// Arguments of `export`: --epsg N --origin E,N,H,DEGREES,SCALE.
  [[nodiscard]] std::string export_arguments() const;
};

struct Adjustment {
  double scale = 1.0;
  double scale_sigma = 0.0;  ///< 0: scale was not observed
  double tilt_rad = 0.0;
  double turn_rad = 0.0;  ///< about z
  double shift_m = 0.0;
  double mean_bend_m = 0.0;  ///< motion of the keyframes after the similarity
  double largest_bend_m = 0.0;
  std::vector<ControlFinding> findings;
  std::optional<WorldPlace> world;
  std::string text;  ///< for a terminal, several lines
  std::string json;  ///< adjust.json
};

/// Adjusts the only part of `maps`. Errors (kUsage): nothing to adjust by, a place that no keyframe saw;
/// (kUntrustworthy): observations contradict each other, and nothing shows which is wrong.
core::Result<Adjustment> adjust_map(maps::StoredMaps& maps, const AdjustRequest& request,
                                    const core::Executor& executor);

/// The function for pipeline::FuseRequest::change: it adjusts, logs the text, and returns camera.yaml of each
/// robot, adjust.json and georeference.json.
std::function<core::Result<std::map<std::string, std::string>>(maps::StoredMaps&)> change_of(
    AdjustRequest request, const core::Executor& executor, core::Log& log);

/// Settings with which the map was fused, as overrides for fusing it again: "fuse.voxel=0.02 m". Errors
/// (kInput): there is no map.
core::Result<std::vector<std::string>> fusion_settings(const std::filesystem::path& map);

}  // namespace plumbline::adjust
