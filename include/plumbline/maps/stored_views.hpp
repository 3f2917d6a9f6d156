// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Views from which clouds are fused: poses of a map, and clouds in a store.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "plumbline/cloud/io/frame.hpp"
#include "plumbline/maps/camera_history.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::maps {

/// Numbers of robots: from a store's to those of the run that reads it; those not in it stay.
using RobotNumbers = std::map<std::int32_t, std::int32_t>;

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
  RobotNumbers numbers = {};                   ///< of the store's robots in these views

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
  /// A view's cloud as the latest version of its camera has it; from several threads at a time. Errors
  /// (kInput): damaged.
  [[nodiscard]] core::Result<cloud::CloudPtr> read(std::size_t view) const;
  /// The same, encoded (cloud::encode_cloud).
  [[nodiscard]] core::Result<std::vector<std::uint8_t>> bytes(std::size_t view) const;
  /// The coarse surface of a keyframe's cloud; none: none was kept. From several threads at a time.
  [[nodiscard]] core::Result<std::optional<StoredSurface>> surface(std::size_t view) const;

  [[nodiscard]] core::KeyframeId stored_keyframe(std::size_t view) const;  ///< as the store numbers it
  [[nodiscard]] FrameId stored_frame(std::size_t view) const;
};

/// Order of arrival of the frames' clouds; frames that are not listed came before all of these.
using Arrivals = std::map<FrameId, std::size_t>;

/// `reader` must outlive the views. `map`: by the run's numbers of robots; `robots`: by the store's, with the
/// versions of their cameras. Frames are in the order of their arrival, else by robot and order, because sums
/// of a dense cloud are rounded in that order. Errors (kInput): damaged.
core::Result<StoredViews> views_of(const StoreReader& reader, const MapPoses& map,
                                   const std::vector<RobotInfo>& robots, const Arrivals& arrivals = {},
                                   const RobotNumbers& numbers = {});

/// The cloud of each keyframe as FOLDER/<number, six digits>.ply, transformed by `output_from_map` into
/// `frame`; makes the folder. `read`: a view's cloud. Returns how many. Errors (kOutput), those of `read`.
core::Result<std::size_t> write_keyframe_clouds(
    const std::filesystem::path& folder, const StoredViews& views, const geometry::Rigid3& output_from_map,
    const cloud::CloudFrame& frame, const std::function<core::Result<cloud::CloudPtr>(std::size_t)>& read);

}  // namespace plumbline::maps
