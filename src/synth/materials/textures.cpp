// SPDX-License-Identifier: BSD-3-Clause
// Textures are drawn once, when a picture first needs them, and stored with mip levels.
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "materials/texture_draw.hpp"

namespace plumbline::synth {

namespace {

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
      // Square root, for dark tones need finer steps.
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
  if (texture != Texture::kNone || material.numbered) return material;
  const auto is = [&](std::string_view name) { return material.name == name; };

  // Large surfaces lose their texture.
  if (material.large) {
    const bool floor = is("carpet") || is("planks") || is("tiles") || is("lino");
    return *find_material(floor ? "lino" : is("hall") ? "hall" : "cloth");
  }
  Material m = material;
  if (!is("cardboard") && !is("leaf")) m.draw = draw_plain;
  return m;
}

cv::Size texture_size(const Material& material, Texture texture, double aspect) {
  const Material m = worn(material, texture);
  if (aspect <= 0.0) return {m.pixels, m.pixels};
  return {power_of_two(m.pixels * std::min(1.0, aspect)), power_of_two(m.pixels / std::max(1.0, aspect))};
}

Texture2d draw_texture(const Material& material, Texture texture, std::uint64_t seed, double aspect) {
  const Material m = worn(material, texture);
  const cv::Size size = texture_size(material, texture, aspect);

  Canvas canvas;
  if (aspect > 0.0) {
    // Drawn with square pixels, then stored at powers of two.
    const int w = static_cast<int>(m.pixels * std::min(1.0, aspect)),
              h = static_cast<int>(m.pixels / std::max(1.0, aspect));
    Canvas drawn = m.draw(m, {std::max(24, w), std::max(24, h)}, seed);
    cv::resize(drawn, canvas, size, 0, 0, cv::INTER_AREA);
  } else {
    canvas = m.draw(m, size, seed);
  }

  if (texture == Texture::kWeak && !m.numbered) fade(canvas, 0.2F);

  // Mip levels down to one texel.
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
