// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What surfaces are made of: how they look and how a depth sensor's infrared light likes them.
#include <cstdint>
#include <string>
#include <vector>

#include "plumbline/synth/options.hpp"

namespace plumbline::synth {

enum class Print {
  kPlain,
  kPlaster,
  kCeiling,
  kCarpet,
  kPlanks,
  kWood,
  kBrick,
  kCloth,
  kFabric,
  kRug,
  kMetal,
  kScreen,
  kPoster,
  kPicture,
  kWhiteboard,
  kSign,
  kBooks,
  kPaper,
  kCover,
  kDoor,
  kWindow,
  kTiles,
  kCardboard,
  kLino,
  kLeaf,
  kHall
};

struct Material {
  const char* name;
  Print print;
  float red, green, blue;  ///< mean reflectance, 0-1
  double tile_m;           ///< one copy of the texture covers so much
  int pixels;              ///< edge of the texture image
  float infrared;          ///< reflectance for the depth sensor, 0-1; under 0.1 measurements fail
  float gloss;             ///< 0 matt - 1 mirror: glints blind the depth sensor, grazing rays glance off
  float glow;              ///< gives light itself
  bool large;              ///< walls, floors, ceilings: without texture they become cloth or lino
};

/// Null when there is no such material.
const Material* find_material(const std::string& name);

/// 8-bit texture with mip levels. Values are 255 sqrt(reflectance), so that light multiplies as its square
/// root.
struct Texture2d {
  struct Level {
    int width = 0;                      ///< a power of two
    int height = 0;                     ///< a power of two
    std::vector<std::uint32_t> texels;  ///< B | G << 8 | R << 16, row by row, v = 0 at the top of the image
  };
  std::vector<Level> levels;
};

/// The material that is really put on: without texture walls wear cloth, floors lino, and the rest is plain.
Material worn(const Material& material, Texture texture);

/// Draws the texture of a material; `aspect` = width / height of the surface for prints that are not tiled.
Texture2d draw_texture(const Material& material, Texture texture, std::uint64_t seed, double aspect);

}  // namespace plumbline::synth
