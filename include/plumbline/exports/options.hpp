// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Options of exports; Format::options lists those that a format uses.
#include <string>
#include <vector>

#include "plumbline/core/options.hpp"

namespace plumbline::exports {

/// Lengths in metres, in the frame of the map's results.
struct ExportOptions {
  // Selection of a part of the map.
  std::vector<double> box;     ///< x0 y0 z0 x1 y1 z1; empty: all
  std::vector<double> z;       ///< lowest and highest; empty: all
  int storey = -1;             ///< counted from the lowest, which is 0; -1: all
  double voxel_m = 0.0;        ///< voxel size for fusing the cloud again; 0: unchanged
  std::vector<double> datum;   ///< latitude, longitude (degrees) of the origin, heading of x; empty: none
  int epsg = 0;                ///< number of a projected coordinate system; 0: none
  std::vector<double> origin;  ///< east, north, height of the map's origin there, and heading of y
  // Grids.
  double resolution_m = 0.0;              ///< edge of a cell or of a mesh's triangles; 0: 5 cm and 2 cm
  std::vector<double> heights{0.1, 1.8};  ///< heights over the floor between which things are obstacles
  // Pictures and models.
  bool text = false;      ///< COLMAP's text files instead of binary ones
  int every = 0;          ///< every n-th tracked frame besides the keyframes; 0: keyframes only
  bool sharpest = false;  ///< the sharpest picture near each keyframe instead of its own
  int dense_points = 0;   ///< number of points of the cloud to write instead of landmarks; 0: landmarks
  bool depth = true;      ///< depth images besides the pictures
  // Clouds and meshes.
  bool ascii = false;
  double reach_m = 0.05;  ///< distance from every point beyond which a mesh's surface is left out
  // Pages.
  int points = 1500000;  ///< largest number of points, thinned by voxels; 0: all
  // Plans.
  double cut_m = 1.2;           ///< height over the floor
  std::vector<double> section;  ///< x y x y: a vertical cut along this line instead; empty: a plan
  std::string paper = "auto";   ///< "A4" to "A0"
  std::string scale = "auto";   ///< "1:50"
  std::string title, client, address, date;  ///< of the title block
  std::string title_block;                   ///< a YAML file with them and others
  std::string decimal = "point";             ///< or "comma"
  std::string without = "path";              ///< layers that are left out, separated by commas
  // Paths.
  /// Pose "x,y,z,qx,qy,qz,qw" of the camera in the body; "base": that of the recording's base; "": the
  /// camera's own path.
  std::string body;

  /// `table` refers to this object.
  void declare(core::OptionTable& table);
};

}  // namespace plumbline::exports
