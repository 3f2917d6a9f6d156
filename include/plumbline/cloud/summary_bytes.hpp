// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Summaries of views as bytes, to be kept beside the views' clouds by whoever lays them down later.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/dense_fusion.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::cloud {

/// A summary, and where the depth camera was: of a view that need not be read before it is laid down.
struct KeptSummary {
  ViewSummary summary;
  geometry::Rigid3 camera_from_depth;
};

/// Exactly, but for the limits of the raster, which follow from it. Same summary, same bytes.
std::vector<std::uint8_t> encode_summary(const KeptSummary& kept);

/// `camera`: the one that took the view. Errors (kInput): damaged, of another version, or the picture is not
/// the camera's.
core::Result<KeptSummary> decode_summary(const std::uint8_t* bytes, std::size_t size,
                                         const sensor::Pinhole& camera);

}  // namespace plumbline::cloud
