// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/exports/options.hpp"

namespace plumbline::exports {

void ExportOptions::declare(core::OptionTable& table) {
  constexpr double kFar_m = 1e6;
  constexpr double kWorld_m = 1e8;
  table.numbers("box", box, 0, {-kFar_m, kFar_m}, "m", "Export only what is in this box: x0,y0,z0,x1,y1,z1");
  table.numbers("z", z, 0, {-kFar_m, kFar_m}, "m", "Export only what is between two heights, such as 0,2.5m");
  table.integer("storey", storey, {-1, 200}, "",
                "Export only this storey, counted from the lowest floor, which is 0; -1: all");
  table.number(
      "voxel", voxel_m, {0.0, 10.0}, "m",
      "Fuse the cloud again from map.db with voxels of this size, or thin a cloud file; 0: unchanged");

  table.numbers("datum", datum, 0, {-360.0, 360.0}, "",
                "Position of the map's origin on Earth, for UTM: latitude,longitude,heading of its x axis; "
                "degrees, clockwise from north");
  table.integer("epsg", epsg, {0, 999999}, "", "A projected coordinate system in metres, with --origin");
  table.numbers("origin", origin, 0, {-kWorld_m, kWorld_m}, "",
                "East,north,height of the map's origin in --epsg, metres; a fourth number turns the map "
                "clockwise, degrees, and a fifth is the scale of the grid");

  table.number("resolution", resolution_m, {0.0, 10.0}, "m",
               "Cell size of a grid (0: 5 cm), or approximate edge length of a mesh (0: 2 cm)");
  table.numbers("heights", heights, 2, {-100.0, 100.0}, "m",
                "Heights over the floor between which things are obstacles");
  table.boolean("text", text, "Write COLMAP's text files instead of binary ones");
  table.integer("every", every, {0, 100000}, "",
                "Export every N-th tracked frame besides the keyframes; 0: keyframes only");

  table.boolean("sharpest", sharpest, "Replace each keyframe by the sharpest picture near it, for splatting");
  table.integer("dense_points", dense_points, {0, 100000000}, "",
                "Number of points of the cloud to write instead of landmarks; 0: landmarks");
  table.boolean("depth", depth, "Write depth images besides the pictures, 16 bit, millimetres");
  table.boolean("ascii", ascii, "Write text instead of binary");
  table.number("reach", reach_m, {0.001, 10.0}, "m",
               "Distance from every point beyond which a mesh's surface is left out");

  table.integer("points", points, {0, 2000000000}, "",
                "Largest number of points; the cloud is thinned by voxels; 0: all");
  table.number("cut", cut_m, {0.0, 100.0}, "m", "Height of the cut over the floor");
  table.numbers("section", section, 0, {-kFar_m, kFar_m}, "m",
                "Draw a vertical section along the line x,y,x,y instead of the plan");

  table.choice("paper", paper, {"auto", "A4", "A3", "A2", "A1", "A0"},
               "Paper of a plan; auto: A3, or the next that holds it");
  table.text("scale", scale,
             "Scale of a plan, such as 1:50; auto: the largest of 1:20, 1:50, 1:100, 1:200 that fits");
  table.text("title", title, "Title of a plan; empty: the map's name");
  table.text("client", client, "Client, for a plan's title block; empty: none");
  table.text("address", address, "Address, for a plan's title block; empty: none");

  table.text("date", date,
             "Date of the recording, for a plan's title block; empty: that of its stamps, if they tell one");
  table.text("title_block", title_block, "YAML file with texts of a plan's title block; empty: none");
  table.choice("decimal", decimal, {"point", "comma"}, "Decimal sign of a plan");

  table.text("without", without,
             "Layers that a plan leaves out: wall, patt, assm, door, glaz, area, furn, dims, grid, anno, "
             "path; none");
  table.text("body", body,
             "Write the path of a body that carries the camera: the camera's pose in it, x,y,z,qx,qy,qz,qw; "
             "or base: the base of the recording's /tf and odometry");
}

}  // namespace plumbline::exports
