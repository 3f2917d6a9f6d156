// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Content of picture models besides poses: points, their tracks, and the pictures themselves.
#include <array>
#include <cstdint>
#include <vector>

#include "source/pictures.hpp"

namespace plumbline::exports {

/// A 3D point and its positions in pictures.
struct ModelPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::array<std::uint8_t, 3> color{128, 128, 128};  ///< red, green, blue
  double error_px = 0.0;                             ///< mean distance from where its pictures show it
  struct Sight {
    std::size_t picture = 0;  ///< among the model's
    int feature = 0;          ///< number of the feature in the picture's keyframe
  };
  std::vector<Sight> track;
};

/// The landmarks that at least two keyframes of the map see, by id; their tracks are those of `pictures`.
/// Colours are the dense cloud's there.
core::Result<std::vector<ModelPoint>> landmark_points(MapSource& source,
                                                      const std::vector<Picture>& pictures);
/// `count` points of the dense cloud, evenly; without tracks.
core::Result<std::vector<ModelPoint>> dense_points(MapSource& source, int count);
/// --dense-points, or else the landmarks.
core::Result<std::vector<ModelPoint>> model_points(MapSource& source, const std::vector<Picture>& pictures);

/// Pinhole of a robot's pictures.
sensor::Pinhole pinhole_of(const MapSource& source, std::int32_t robot);

/// Writes images/NAME.png of each picture that has a frame, and depth/NAME.png (16 bit, millimetres) if
/// `depth`. A frame that cannot be read loses its number, and a note says so. Errors (kOutput).
core::Result<void> write_pictures(const MapSource& source, const Pictures& recordings,
                                  std::vector<Picture>& pictures, const std::filesystem::path& folder,
                                  bool depth, ExportSummary& summary);

}  // namespace plumbline::exports
