// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/exports/options.hpp"

namespace plumbline::exports {

void ExportOptions::declare(core::OptionTable& table) {
  constexpr double kFar_m = 1e6;
  constexpr double kWorld_m = 1e8;
  table.numbers("box", box, 0, {-kFar_m, kFar_m}, "m", "Only what lies in it: x0,y0,z0,x1,y1,z1");
  table.numbers("z", z, 0, {-kFar_m, kFar_m}, "m", "Only what lies between two heights, such as 0,2.5m");
  table.integer("storey", storey, {-1, 200}, "",
                "Only this storey, counted from the lowest floor, which is 0; -1: all");
  table.number(
      "voxel", voxel_m, {0.0, 10.0}, "m",
      "Lay the cloud down anew from map.db in voxels of this size, or thin a cloud file; 0: as it is");
  table.numbers("datum", datum, 0, {-360.0, 360.0}, "",
                "Where the map's origin is on Earth: latitude,longitude,heading of its x axis; degrees, "
                "clockwise from north; into UTM");
  table.integer("epsg", epsg, {0, 999999}, "", "A projected coordinate system in metres, with --origin");
  table.numbers("origin", origin, 0, {-kWorld_m, kWorld_m}, "",
                "East,north,height of the map's origin in --epsg, metres; a fourth number turns the map "
                "clockwise, degrees");
  table.number("resolution", resolution_m, {0.0, 10.0}, "m",
               "Edge of a grid's cells (0: 5 cm), or length of a mesh's edges, about (0: 2 cm)");
  table.numbers("heights", heights, 2, {-100.0, 100.0}, "m",
                "What lies between these heights over the floor is in the way");
  table.boolean("text", text, "COLMAP's text files instead of binary ones");
  table.integer("every", every, {0, 100000}, "",
                "Every N-th tracked frame besides the keyframes; 0: keyframes only");
  table.boolean("sharpest", sharpest,
                "In the place of each keyframe the sharpest picture near it, for splatting");
  table.integer("dense_points", dense_points, {0, 100000000}, "",
                "So many points of the cloud in the place of the landmarks; 0: landmarks");
  table.boolean("depth", depth, "Depth images beside the pictures, 16 bit, millimetres");
  table.boolean("ascii", ascii, "Text instead of binary");
  table.number("reach", reach_m, {0.001, 10.0}, "m",
               "Of a mesh: surface further than this from every point is left out");
  table.integer("points", points, {0, 2000000000}, "",
                "Points of the cloud, at most, which is thinned by voxels; 0: all");
  table.number("cut", cut_m, {0.0, 100.0}, "m", "Height of the cut over the floor");
  table.numbers("section", section, 0, {-kFar_m, kFar_m}, "m",
                "A vertical section along the line x,y,x,y instead of the plan");
  table.numbers("body", body, 0, {-1e4, 1e4}, "",
                "Pose of the camera in the body, x,y,z,qx,qy,qz,qw: the path of the body is written");
}

}  // namespace plumbline::exports
