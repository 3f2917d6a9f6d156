// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Materials of surfaces: their appearance, and how they return a depth sensor's infrared light.
#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "plumbline/synth/options.hpp"

namespace plumbline::synth {

struct Material;

/// Pictures are reflectances, B G R, 0-1.
using Canvas = cv::Mat_<cv::Vec3f>;
using DrawTexture = Canvas(const Material& m, cv::Size size, std::uint64_t seed);

struct Material {
  std::string_view name;
  DrawTexture* draw;
  float red, green, blue;  ///< mean reflectance, 0-1
  double tile_m;           ///< edge length of one copy of the texture
  int pixels;              ///< edge of the texture image
  float infrared;          ///< reflectance for the depth sensor, 0-1; under 0.1 measurements fail
  float gloss;             ///< 0 matt - 1 mirror: glints blind the depth sensor, grazing rays glance off
  float glow;              ///< gives light itself
  bool large;              ///< walls, floors, ceilings: without texture they become cloth or lino
  bool numbered = false;   ///< the seed of a face is a number that is printed, whatever the texture
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

/// The material that is used: without texture walls are cloth, floors lino, and the rest is plain.
Material worn(const Material& material, Texture texture);

/// Size of level 0 of the texture of a material.
cv::Size texture_size(const Material& material, Texture texture, double aspect);

/// Draws the texture of a material; `aspect` = width / height of the surface for prints that are not tiled.
Texture2d draw_texture(const Material& material, Texture texture, std::uint64_t seed, double aspect);

}  // namespace plumbline::synth
