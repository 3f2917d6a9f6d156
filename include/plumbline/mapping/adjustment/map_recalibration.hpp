// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Rebuilds a map for another camera than the one its keyframes were read with: features follow from their
// measurements, and only surfaces are read in the keyframes' pictures again (docs/method/calibration.md).
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/mapping/adjustment/global_adjustment.hpp"
#include "plumbline/mapping/local_mapping/landmark_fusion.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/sensor/recalibration.hpp"
#include "plumbline/tracking/surface_sampler.hpp"

namespace plumbline::mapping {

/// Changes the map of one robot, and the poses of its frames relative to keyframes, from the previous camera
/// to the new one: features, surfaces, edges and the tracker's steps are recomputed as the new camera would
/// have measured them, and keyframes and landmarks are moved accordingly.
void recalibrate_map(const sensor::Recalibration& change, maps::Map& map,
                     std::vector<maps::FramePose>& frames);

/// Poses that the keyframes of one robot's map would have with the new camera: those of recalibrate_map,
/// which this does not need to run. Empty if no poses could be found.
KeyframePoses recalibrated_poses(const sensor::Recalibration& change, const maps::Map& map,
                                 const std::vector<maps::FramePose>& frames);

/// Reads a keyframe's picture again, by its number in the recording, with the new camera; none: it cannot be
/// read. Called from several threads at a time.
using PictureReader = std::function<std::optional<sensor::RgbdFrame>(std::int64_t frame_index)>;

struct SurfaceMeasurement {
  tracking::SurfaceSamplerOptions sampler;
  double min_overlap = 0.25;  ///< SurfaceEdgeOptions
  bool photometric = true;    ///< grey values, too
};

/// Measures surfaces of keyframes and the edges between them again, in the pictures themselves. Those that
/// cannot be read or aligned stay as recalibrate_map left them.
void measure_surfaces_again(const sensor::Pinhole& camera, const std::vector<maps::FramePose>& frames,
                            const PictureReader& read, const SurfaceMeasurement& how,
                            const core::Executor& executor, maps::Map& map);

/// Searches landmarks in all keyframes that should see them, because a wrong camera made the tracker
/// reject some; then adjusts the whole map, which must not be empty.
GlobalAdjustmentSummary adjust_recalibrated_map(const sensor::Pinhole& camera, const FusionOptions& fusion,
                                                const GlobalAdjustmentOptions& adjustment, maps::Map& map);

/// Solves the poses of frames between keyframes again, from the landmarks that each of them saw
/// (FramePose::seen) and its pose as recalibrate_map left it, which counts for less the more it was
/// corrected. `model`: the new camera; `before`, `path_before`: the same frames and their path
/// before recalibrate_map. The map is not changed.
void solve_frames_again(const sensor::ImageModel& model, const maps::Map& map,
                        const std::vector<maps::FramePose>& before, const geometry::Trajectory& path_before,
                        const core::Executor& executor, std::vector<maps::FramePose>& frames);

}  // namespace plumbline::mapping
