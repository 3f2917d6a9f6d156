// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// pose_samples.npy of a result: errors that the poses may have, drawn together (docs/method/trust.md).
#include <filesystem>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/ids.hpp"
#include "plumbline/geometry/pose_samples.hpp"

namespace plumbline::maps {

inline constexpr const char* kPoseSamplesFile = "pose_samples.npy";

struct KeyframeSamples {
  core::KeyframeId keyframe;  ///< of a path without keyframes its pose's number
  geometry::PoseSamples in_camera;
};

/// NumPy's format 1.0: records of `robot`, `keyframe` (int32) and `motion` (32 x 6 float32). Errors
/// (kOutput).
core::Result<void> write_pose_samples(const std::filesystem::path& file,
                                      const std::vector<KeyframeSamples>& samples);
/// Such a file. Errors (kInput): it cannot be read, or is another kind of file.
core::Result<std::vector<KeyframeSamples>> read_pose_samples(const std::filesystem::path& file);

}  // namespace plumbline::maps
