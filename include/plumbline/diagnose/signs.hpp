// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Mistakes that people make with a recording, as hypotheses with names (docs/method/mistakes.md).
#include <string>
#include <vector>

#include "plumbline/diagnose/samples.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::diagnose {

enum class Certainty {
  kNone,     ///< measured, and as in a right recording
  kLikely,   ///< worth a warning
  kCertain,  ///< a result must not be trusted
};
std::string to_string(Certainty certainty);

/// One hypothesis and its evidence.
struct Sign {
  std::string name;       ///< "ray_distance", "not_registered" ...
  std::string unit;       ///< of size
  double size = 0.0;      ///< how large the mistake is
  double strength = 0.0;  ///< the weakest piece of evidence in terms of what is needed: 1 and more is certain
  Certainty certainty = Certainty::kNone;
  std::string text{};    ///< what is wrong, with its size; "" unless likely or certain
  std::string remedy{};  ///< what to do or to type; "" unless likely or certain
};

/// Depth along the ray instead of along z, and disparity instead of depth: by planes.
std::vector<Sign> depth_kind_signs(const Samples& samples);
/// Depth that another lens has seen: edges of depth against edges of the pictures.
Sign registration_sign(const Samples& samples);
/// Patterns that stay in the picture while the camera moves.
Sign fixed_pattern_sign(const Samples& samples);
/// Depth that falls behind colour in the course of the recording, or that is older or newer than its stamps
/// all along.
std::vector<Sign> lag_signs(const Samples& samples);
/// True if neither the pictures nor depth show that the camera moved.
bool stood_still(const Samples& samples);
/// Poses that come with the recording (world_from_camera, with the convention that they were read by) against
/// depth: inverted, OpenGL's axes, w first, in another unit, at another time.
Sign pose_sign(const Samples& samples, const geometry::Trajectory& poses);

/// All that need no poses.
std::vector<Sign> signs_of(const Samples& samples);

/// Text of a sign for a reason or a warning: what is wrong, and what to type.
std::string sentence(const Sign& sign);

}  // namespace plumbline::diagnose
