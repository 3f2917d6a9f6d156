// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Writes what the robots film: TUM-layout folders, the true surfaces and a description.
#include <cstddef>
#include <filesystem>
#include <functional>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/synth/options.hpp"
#include "plumbline/synth/scene.hpp"

namespace plumbline::synth {

struct WriteSummary {
  int robots = 0;
  std::size_t frames = 0;             ///< pairs written, all robots
  double path_m = 0.0;                ///< all robots
  std::size_t reference_samples = 0;  ///< points of reference.ply
  std::size_t reference_visible = 0;  ///< of these seen by a camera within the sensor's range
  double reference_spacing_m = 0.0;
  std::size_t openings = 0;       ///< of a world made from a number
  std::size_t openings_seen = 0;  ///< those of whose jambs the cameras saw half or more
  bool stopped = false;           ///< ended early; the files are complete up to the last frame listed
  double wall_s = 0.0;            ///< of rendering and writing the frames
};

/// A world to be filmed. Scene and options must outlive this.
struct WriteRequest {
  const Scene& scene;
  const SynthOptions& options;
  std::filesystem::path output;  ///< folder
};

/// Frames written so far, frames in all.
using Progress = std::function<void(std::size_t, std::size_t)>;

/// Makes
///   OUT/robot0/ ...       TUM layout: rgb/ (8-bit PNG), depth/ (16-bit PNG, 5000 per metre), rgb.txt,
///   depth.txt,
///                         associations.txt, groundtruth.txt (exact world_from_camera at colour and depth
///                         stamps), camera.yaml; with SynthOptions::camera_error camera.true.yaml;
///                         truth.csv: pose, velocity (world), turn rate (camera), share of the picture that
///                         moves, events, of each frame; events.csv if there are any; moving/ if asked
///   OUT/reference.ply     binary PLY, samples of the true surfaces in the frame of groundtruth.txt:
///                         float x y z, float nx ny nz, uchar red green blue, uchar visible.
///                         visible = 1 when some camera saw that spot within the sensor's range and at no
///                         grazing angle, else 0. Insides of solids and the world's outer skin are left out.
///   OUT/plan.json         only of a world made from a number: rooms, faces of walls, openings, things,
///   OUT/changes.json      only with changes: what is different from the world as it was made
///   OUT/scene.json        what was made: scene, options, seeds, cameras, robot starts and path lengths,
///   counts
/// Errors: kUsage (options, scene), kOutput (cannot write; names the file). `progress` may be empty; it is
/// called from one thread at a time.
core::Result<WriteSummary> write_recordings(const WriteRequest& request, const core::Executor& executor,
                                            const core::StopToken& stop, core::Log& log,
                                            const Progress& progress);

}  // namespace plumbline::synth
