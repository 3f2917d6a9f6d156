// SPDX-License-Identifier: BSD-3-Clause
// Textures are drawn once, when a world is built, and stored with mip levels.
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "materials/texture_draw.hpp"

namespace plumbline::synth {

namespace {

Canvas draw(const Material& m, cv::Size size, std::uint64_t seed) {
  switch (m.print) {
    case Print::kPlain:
    case Print::kPaper:
    case Print::kHall:
      return draw_plain(m, size, seed);
    case Print::kPlaster:
      return draw_plaster(m, size, seed);
    case Print::kCeiling:
      return draw_ceiling(m, size, seed);
    case Print::kCarpet:
      return draw_carpet(m, size, seed);
    case Print::kPlanks:
      return draw_planks(m, size, seed);
    case Print::kWood:
      return draw_wood(m, size, seed);
    case Print::kBrick:
      return draw_brick(m, size, seed);
    case Print::kCloth:
      return draw_cloth(m, size, seed);
    case Print::kFabric:
      return draw_fabric(m, size, seed);
    case Print::kRug:
      return draw_rug(m, size, seed);
    case Print::kMetal:
      return draw_cardboard(m, size, seed);
    case Print::kScreen:
      return draw_screen(m, size, seed);
    case Print::kPoster:
      return draw_poster(m, size, seed);
    case Print::kPicture:
      return draw_picture(m, size, seed);
    case Print::kWhiteboard:
      return draw_whiteboard(m, size, seed);
    case Print::kSign:
      return draw_sign(m, size, seed);
    case Print::kBooks:
      return draw_books(m, size, seed);
    case Print::kCover:
      return draw_poster(m, size, seed);
    case Print::kDoor:
      return draw_door(m, size, seed);
    case Print::kWindow:
      return draw_window(m, size, seed);
    case Print::kTiles:
      return draw_tiles(m, size, seed);
    case Print::kCardboard:
      return draw_cardboard(m, size, seed);
    case Print::kLino:
      return draw_lino(m, size, seed);
    case Print::kLeaf:
      return draw_fabric(m, size, seed);
  }
  return draw_plain(m, size, seed);
}

/// Bleaches everything towards the mean colour.
void fade(Canvas& canvas, float contrast) {
  const cv::Scalar mean = cv::mean(canvas);
  canvas = canvas * contrast + mean * (1.0 - static_cast<double>(contrast));
}

Texture2d::Level encode(const Canvas& canvas) {
  Texture2d::Level level;
  level.width = canvas.cols;
  level.height = canvas.rows;
  level.texels.reserve(static_cast<std::size_t>(canvas.total()));
  for (const cv::Vec3f& c : canvas) {
    std::uint32_t texel = 0;
    for (int k = 0; k < 3; ++k) {
      const float v = 255.0F * std::sqrt(std::clamp(c[k], 0.0F, 1.0F)) + 0.5F;
      texel |= static_cast<std::uint32_t>(v) << (8 * k);
    }
    level.texels.push_back(texel);
  }
  return level;
}

int power_of_two(double pixels) {
  int n = 16;
  while (n < pixels * 0.75 && n < 2048) n *= 2;
  return n;
}

}  // namespace

Material worn(const Material& material, Texture texture) {
  if (texture != Texture::kNone) return material;
  Material m = material;
  if (m.large) {
    const bool floor = m.print == Print::kCarpet || m.print == Print::kPlanks || m.print == Print::kTiles ||
                       m.print == Print::kLino;
    return *find_material(floor ? "lino" : m.print == Print::kHall ? "hall" : "cloth");
  }
  if (m.print != Print::kCardboard && m.print != Print::kLeaf) m.print = Print::kPlain;
  return m;
}

Texture2d draw_texture(const Material& material, Texture texture, std::uint64_t seed, double aspect) {
  const Material m = worn(material, texture);
  cv::Size size(m.pixels, m.pixels);
  if (aspect > 0.0)
    size = {power_of_two(m.pixels * std::min(1.0, aspect)), power_of_two(m.pixels / std::max(1.0, aspect))};
  Canvas canvas;
  if (aspect > 0.0) {
    // Drawn with square pixels, then stored at powers of two.
    const int w = static_cast<int>(m.pixels * std::min(1.0, aspect)),
              h = static_cast<int>(m.pixels / std::max(1.0, aspect));
    Canvas drawn = draw(m, {std::max(24, w), std::max(24, h)}, seed);
    cv::resize(drawn, canvas, size, 0, 0, cv::INTER_AREA);
  } else {
    canvas = draw(m, size, seed);
  }
  if (texture == Texture::kWeak) fade(canvas, 0.2F);
  Texture2d out;
  while (true) {
    out.levels.push_back(encode(canvas));
    if (canvas.cols == 1 && canvas.rows == 1) break;
    Canvas half;
    cv::resize(canvas, half, {std::max(1, canvas.cols / 2), std::max(1, canvas.rows / 2)}, 0, 0,
               cv::INTER_AREA);
    canvas = half;
  }
  return out;
}

}  // namespace plumbline::synth
