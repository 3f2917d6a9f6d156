// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Views from which clouds are fused: poses of a map, and clouds in a store.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <vector>

#include "plumbline/maps/camera_history.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::maps {

/// All that have a cloud and a pose: keyframes by id, then frames between them.
struct StoredViews {
  const StoreReader* reader = nullptr;
  std::vector<core::KeyframeId> keyframes;  ///< invalid: a frame's
  std::vector<FrameId> frames;
  std::vector<geometry::Rigid3> world_from_camera;
  std::vector<std::int32_t> robots;
  std::vector<double> stamps;
  std::vector<geometry::Vector6d> velocities;  ///< of camera_from_world, in its own frame; m/s, rad/s
  CameraHistory cameras;                       ///< versions of the cameras of the clouds

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
  /// A view's cloud as the latest version of its camera has it; from several threads at a time. Errors
  /// (kInput): damaged.
  [[nodiscard]] core::Result<cloud::CloudPtr> read(std::size_t view) const;
};

/// Order of arrival of the frames' clouds; frames that are not listed came before all of these.
using Arrivals = std::map<FrameId, std::size_t>;

/// `reader` must outlive the views. `robots`: with the versions of their cameras. Frames are in the order of
/// their arrival, else by robot and order, because sums of a dense cloud are rounded in that order. Errors
/// (kInput): damaged.
core::Result<StoredViews> views_of(const StoreReader& reader, const MapPoses& map,
                                   const std::vector<RobotInfo>& robots, const Arrivals& arrivals = {});

/// The cloud of each keyframe as FOLDER/<number, six digits>.ply, laid by `output_from_map`; makes the
/// folder. `read`: a view's cloud. Returns how many. Errors (kOutput), those of `read`.
core::Result<std::size_t> write_keyframe_clouds(
    const std::filesystem::path& folder, const StoredViews& views, const geometry::Rigid3& output_from_map,
    const std::function<core::Result<cloud::CloudPtr>(std::size_t)>& read);

}  // namespace plumbline::maps
