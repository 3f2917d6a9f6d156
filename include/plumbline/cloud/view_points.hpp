// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The measured points of a view, coordinate by coordinate: what fusion goes over, without a cloud's gaps.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::cloud {

/// Points with finite coordinates in the order of the cloud, camera frame, metres; unknown normals are NaN.
/// Vectors of one length. Meant to be used for one view after another: memory is taken once.
struct ViewPoints {
  std::vector<float> x, y, z;
  std::vector<float> normal_x, normal_y, normal_z;
  std::vector<std::uint8_t> r, g, b;
  std::uint32_t width = 0;   ///< of the organised cloud that they are of
  std::uint32_t height = 0;  ///< 1: of none
  geometry::Rigid3 camera_from_depth;

  std::vector<std::uint8_t> compact;      ///< room for who reads bytes from a file
  std::vector<std::uint8_t> content;      ///< room of decode_points()
  std::vector<std::uint8_t> directions;   ///< the same
  std::vector<std::int32_t> differences;  ///< the same

  [[nodiscard]] std::size_t size() const { return x.size(); }
  void resize(std::size_t count);
};

/// Those of a cloud.
void take_points(const Cloud& camera_cloud, ViewPoints& points);

/// The same as take_points() of decode_cloud()'s cloud, to the last bit. Errors as there.
core::Result<void> decode_points(const std::uint8_t* bytes, std::size_t size, ViewPoints& points);

/// is_look() of the cloud that the points are of.
bool is_look(const ViewPoints& points, const sensor::Pinhole& camera);

}  // namespace plumbline::cloud
