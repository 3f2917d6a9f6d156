// SPDX-License-Identifier: BSD-3-Clause
#include "render/render.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "render/ray_batch.hpp"

namespace plumbline::synth {

namespace {

using Vec4 = float __attribute__((vector_size(16)));
using Byte4 = std::uint8_t __attribute__((vector_size(4)));

// The inner loop is compiled twice, for any x86-64 and for AVX2, and chosen when it runs. No fused operations
// in either, so the bytes are the same.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define PLUMBLINE_FAST __attribute__((target_clones("avx2", "default")))
#else
#define PLUMBLINE_FAST
#endif
#define PLUMBLINE_INLINE inline __attribute__((always_inline))

constexpr int kChunk = 8;  // pixels that share level of detail and interpolated light

// ---- texture sampling ----

PLUMBLINE_INLINE Vec4 unpack(std::uint32_t texel) {
  Byte4 bytes;
  static_assert(sizeof bytes == sizeof texel);
  __builtin_memcpy(&bytes, &texel, sizeof texel);
  return __builtin_convertvector(bytes, Vec4);
}

PLUMBLINE_INLINE Vec4 bilinear(const Texture2d::Level& level, float x, float y) {
  x -= 0.5F;
  y -= 0.5F;
  const int ix = static_cast<int>(x) - (x < 0.0F ? 1 : 0), iy = static_cast<int>(y) - (y < 0.0F ? 1 : 0);
  const float sx = x - static_cast<float>(ix), sy = y - static_cast<float>(iy);

  // Textures repeat; their sizes are powers of two.
  const auto x0 = static_cast<std::size_t>(ix & (level.width - 1)),
             x1 = static_cast<std::size_t>((ix + 1) & (level.width - 1));
  const std::uint32_t* top =
      level.texels.data() + static_cast<std::size_t>((iy & (level.height - 1)) * level.width);
  const std::uint32_t* low =
      level.texels.data() + static_cast<std::size_t>(((iy + 1) & (level.height - 1)) * level.width);
  const Vec4 t0 = unpack(top[x0]), t1 = unpack(top[x1]), l0 = unpack(low[x0]), l1 = unpack(low[x1]);
  const Vec4 t = t0 + sx * (t1 - t0), l = l0 + sx * (l1 - l0);
  return t + sy * (l - t);
}

/// Level of the pyramid to read, and number of samples along the longer axis of the pixel's footprint.
struct Footprint {
  const Texture2d::Level* fine;
  const Texture2d::Level* coarse;
  float fine_x, fine_y, coarse_x, coarse_y;  ///< level 0 texels -> level texels
  float blend;
  int probes;
  float step_x, step_y;  ///< between probes, level 0 texels
};

Footprint footprint(const Texture2d& texture, const FaceView& f, float x, float y) {
  const float z = 1.0F / (f.c[0] * x + f.c[1] * y + f.c[2]);
  const float u = (f.a[0] * x + f.a[1] * y + f.a[2]) * z, v = (f.b[0] * x + f.b[1] * y + f.b[2]) * z;
  const float ux = (f.a[0] - u * f.c[0]) * z, vx = (f.b[0] - v * f.c[0]) * z;
  const float uy = (f.a[1] - u * f.c[1]) * z, vy = (f.b[1] - v * f.c[1]) * z;

  // Axes of the footprint: eigenvalues of J J^T.
  const float xx = ux * ux + uy * uy, yy = vx * vx + vy * vy, xy = ux * vx + uy * vy;
  const float mean = 0.5F * (xx + yy), spread = std::sqrt(0.25F * (xx - yy) * (xx - yy) + xy * xy);
  const float major = std::sqrt(std::max(mean + spread, 1e-12F)),
              minor = std::sqrt(std::max(mean - spread, 1e-12F));
  Footprint out{};
  out.probes = major > 3.0F * minor ? 4 : major > 1.5F * minor ? 2 : 1;
  const float size = std::max(minor, major / static_cast<float>(out.probes));

  if (out.probes > 1) {
    // The longer axis: eigenvector of the larger eigenvalue, from the row that is not nearly zero.
    const float big = mean + spread;
    const float ex = xx >= yy ? big - yy : xy, ey = xx >= yy ? xy : big - xx;
    const float step =
        major / (static_cast<float>(out.probes) * std::sqrt(std::max(ex * ex + ey * ey, 1e-20F)));
    out.step_x = ex * step;
    out.step_y = ey * step;
  }

  const float last = static_cast<float>(texture.levels.size() - 1);
  const float level = std::clamp(std::log2(size), 0.0F, last);
  // Several probes are smooth enough without mixing levels.
  const auto fine = static_cast<std::size_t>(out.probes > 1 ? level + 0.5F : level);

  const auto coarse = std::min(fine + 1, texture.levels.size() - 1);
  out.fine = &texture.levels[fine];
  out.coarse = &texture.levels[coarse];
  out.blend = out.probes > 1 ? 0.0F : level - static_cast<float>(fine);

  // Factors from level 0 to the levels read.
  const auto width = static_cast<float>(texture.levels[0].width),
             height = static_cast<float>(texture.levels[0].height);
  out.fine_x = static_cast<float>(out.fine->width) / width;
  out.fine_y = static_cast<float>(out.fine->height) / height;
  out.coarse_x = static_cast<float>(out.coarse->width) / width;
  out.coarse_y = static_cast<float>(out.coarse->height) / height;
  return out;
}

PLUMBLINE_INLINE Vec4 sample(const Footprint& f, float u, float v) {
  // Two levels of detail are blended.
  if (f.probes == 1) {
    const Vec4 fine = bilinear(*f.fine, u * f.fine_x, v * f.fine_y);
    if (f.blend == 0.0F) return fine;
    return fine + f.blend * (bilinear(*f.coarse, u * f.coarse_x, v * f.coarse_y) - fine);
  }

  // Anisotropic: several probes along the footprint.
  Vec4 sum = {0.0F, 0.0F, 0.0F, 0.0F};
  float du = u - 0.5F * static_cast<float>(f.probes - 1) * f.step_x;
  float dv = v - 0.5F * static_cast<float>(f.probes - 1) * f.step_y;
  for (int i = 0; i < f.probes; ++i, du += f.step_x, dv += f.step_y) {
    sum += bilinear(*f.fine, du * f.fine_x, dv * f.fine_y);
  }
  return sum * (1.0F / static_cast<float>(f.probes));
}

/// The camera's response: straight, then a shoulder, then white.
PLUMBLINE_INLINE std::uint8_t respond(float v) {
  if (v > 185.0F) v = 185.0F + 70.0F * (1.0F - 1.0F / (1.0F + (v - 185.0F) * (1.0F / 70.0F)));
  return static_cast<std::uint8_t>(v + 0.5F);
}

/// Shades pixels of one picture, in one thread. The textures that it has used stay until it ends.
class Shader {
 public:
  Shader(const World& world, const View& view, const Exposure& exposure)
      : world_(world), view_(view), exposure_(exposure), textures_(world.texture_sizes.size()) {
    scales_.reserve(view.faces.size());
    for (std::size_t i = 0; i < view.faces.size(); ++i) {
      const TexelScale s = texel_scale(world, i);
      scales_.push_back({static_cast<float>(1.0 / s.u), static_cast<float>(1.0 / s.v)});
    }
    const int rows = view.picture_rows > 0 ? view.picture_rows : view.camera.height;
    const double cx = 0.5 * view.camera.width, cy = 0.5 * rows;
    center_x_ = static_cast<float>(cx);
    center_y_ = static_cast<float>(cy - view.first_row);
    per_radius2_ = static_cast<float>(1.0 / (cx * cx + cy * cy));
  }

  /// Light, lens and exposure together at a pixel of a face.
  [[nodiscard]] float brightness(std::size_t id, float x, float y) const {
    const FaceView& f = view_.faces[id];
    const float z = 1.0F / (f.c[0] * x + f.c[1] * y + f.c[2]);
    const float u = (f.a[0] * x + f.a[1] * y + f.a[2]) * z * scales_[id][0] - world_.offset_u[id];
    const float v = -(f.b[0] * x + f.b[1] * y + f.b[2]) * z * scales_[id][1] - world_.offset_v[id];
    const float dx = x - center_x_, dy = y - center_y_;
    const float lens = 1.0F - exposure_.vignette * (dx * dx + dy * dy) * per_radius2_;
    return world_.light[id].at(u, v) * lens * exposure_.gain;
  }
  [[nodiscard]] Footprint foot(std::size_t id, float x, float y) const {
    return footprint(texture(id), view_.faces[id], x, y);
  }
  /// Radiance at one place, no interpolation.
  [[nodiscard]] Vec4 at(int face, float x, float y) const {
    if (face < 0) return Vec4{24.0F, 24.0F, 24.0F, 0.0F};
    const auto id = static_cast<std::size_t>(face);
    return color(id, foot(id, x, y), x, y) * brightness(id, x, y);
  }
  /// Sum of four places about a pixel; light and level of detail are worked out once for each face.
  [[nodiscard]] Vec4 mean(const std::array<int, 4>& faces, float x, float y,
                          const float (&spots)[4][2]) const {
    Vec4 sum = {0.0F, 0.0F, 0.0F, 0.0F};
    for (std::size_t k = 0; k < 4; ++k) {
      // Each face once.
      bool done = false;
      for (std::size_t i = 0; i < k; ++i) done = done || faces[i] == faces[k];
      if (done) continue;
      if (faces[k] < 0) {
        for (const int face : faces) sum += face < 0 ? at(face, x, y) : Vec4{0.0F, 0.0F, 0.0F, 0.0F};
        continue;
      }

      // All its places with one footprint.
      const auto id = static_cast<std::size_t>(faces[k]);
      const float sx = x + spots[k][0], sy = y + spots[k][1];
      const Footprint here = foot(id, sx, sy);
      Vec4 part = {0.0F, 0.0F, 0.0F, 0.0F};
      for (std::size_t i = k; i < 4; ++i) {
        if (faces[i] == faces[k]) part += color(id, here, x + spots[i][0], y + spots[i][1]);
      }

      sum += part * brightness(id, sx, sy);
    }

    return sum;
  }
  [[nodiscard]] PLUMBLINE_INLINE Vec4 color(std::size_t id, const Footprint& foot, float x, float y) const {
    const FaceView& f = view_.faces[id];
    const float z = 1.0F / (f.c[0] * x + f.c[1] * y + f.c[2]);
    return sample(foot, (f.a[0] * x + f.a[1] * y + f.a[2]) * z, (f.b[0] * x + f.b[1] * y + f.b[2]) * z);
  }
  static PLUMBLINE_INLINE void store(const Vec4& v, std::uint8_t* bgr) {
    bgr[0] = respond(v[0]);
    bgr[1] = respond(v[1]);
    bgr[2] = respond(v[2]);
  }
  PLUMBLINE_INLINE void row(int y, std::uint8_t* bgr) const {
    const int* ids = view_.ids[y];
    const auto fy = static_cast<float>(y);
    int x = 0;
    while (x < view_.ids.cols) {
      // Neighbours on one face share the footprint.
      int end = x + 1;
      while (end < view_.ids.cols && end < x + kChunk && ids[end] == ids[x]) ++end;
      chunk(ids[x], x, end, fy, bgr);
      x = end;
    }
  }

 private:
  [[nodiscard]] const Texture2d& texture(std::size_t id) const {
    const auto index = static_cast<std::size_t>(world_.texture_of[id]);
    auto& texture = textures_[index];
    if (!texture) texture = world_.textures[index];
    return *texture;
  }
  PLUMBLINE_INLINE void chunk(int face, int from, int to, float y, std::uint8_t* bgr) const {
    if (face < 0) {
      for (int x = from; x < to; ++x) store(at(face, 0.0F, 0.0F), bgr + 3 * x);
      return;
    }
    const auto id = static_cast<std::size_t>(face);
    const auto x0 = static_cast<float>(from), x1 = static_cast<float>(to - 1);
    const Footprint here = foot(id, 0.5F * (x0 + x1), y);

    // Light is linear within a chunk.
    const float start = brightness(id, x0, y);
    const float slope = to - from > 1 ? (brightness(id, x1, y) - start) / (x1 - x0) : 0.0F;
    for (int x = from; x < to; ++x) {
      const auto fx = static_cast<float>(x);
      store(color(id, here, fx, y) * (start + slope * (fx - x0)), bgr + 3 * x);
    }
  }

  const World& world_;
  const View& view_;
  Exposure exposure_;
  mutable std::vector<std::shared_ptr<const Texture2d>> textures_;
  std::vector<std::array<float, 2>> scales_;
  float center_x_ = 0.0F, center_y_ = 0.0F, per_radius2_ = 0.0F;
};

PLUMBLINE_FAST void shade_rows(const Shader& shader, cv::Mat3b& image) {
  for (int y = 0; y < image.rows; ++y) shader.row(y, image.ptr<std::uint8_t>(y));
}

/// Pixels that a border between faces crosses are averages of four places.
void smooth_borders(const World& world, const View& view, const Shader& shader, cv::Mat3b& image) {
  constexpr float kSpots[4][2] = {{-0.125F, -0.375F}, {0.375F, -0.125F}, {-0.375F, 0.125F}, {0.125F, 0.375F}};
  const cv::Mat1i& ids = view.ids;
  std::vector<cv::Point> pixels;

  // Pixels next to another face.
  for (int y = 0; y < ids.rows; ++y) {
    const int *row = ids[y], *up = ids[std::max(0, y - 1)], *low = ids[std::min(ids.rows - 1, y + 1)];
    for (int x = 0; x < ids.cols; ++x) {
      const int id = row[x];

      // One of four neighbours is another face.
      if (up[x] != id || low[x] != id || row[std::max(0, x - 1)] != id ||
          row[std::min(ids.cols - 1, x + 1)] != id) {
        pixels.emplace_back(x, y);
      }
    }
  }

  // Four rays for each.
  std::vector<std::array<int, 4>> seen(pixels.size());
  RayBatch rays(world, view);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      rays.add(static_cast<float>(pixels[i].x) + kSpots[k][0], static_cast<float>(pixels[i].y) + kSpots[k][1],
               &seen[i][k]);
    }
  }
  rays.flush();

  // Moving faces may be in front.
  if (const MovingFaces moving(world, view, view.time.value_or(0.0)); view.time && !moving.empty()) {
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        seen[i][k] = moving.in_front(view, seen[i][k], static_cast<float>(pixels[i].x) + kSpots[k][0],
                                     static_cast<float>(pixels[i].y) + kSpots[k][1]);
      }
    }
  }

  // Mean of the four places.
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    Shader::store(
        shader.mean(seen[i], static_cast<float>(pixels[i].x), static_cast<float>(pixels[i].y), kSpots) *
            0.25F,
        image[pixels[i].y][pixels[i].x].val);
  }
}

}  // namespace

cv::Mat3b shade(const World& world, const View& view, const Exposure& exposure) {
  cv::Mat3b image(view.ids.size());
  const Shader shader(world, view, exposure);
  shade_rows(shader, image);
  smooth_borders(world, view, shader, image);
  return image;
}

cv::Vec3b surface_color(const World& world, std::size_t face, double u, double v) {
  const TexelScale scale = texel_scale(world, face);
  const auto texture = world.textures[static_cast<std::size_t>(world.texture_of[face])];
  const Texture2d::Level& top = texture->levels[0];
  const Vec4 texel =
      bilinear(top, static_cast<float>((u + static_cast<double>(world.offset_u[face])) * scale.u),
               static_cast<float>(-(v + static_cast<double>(world.offset_v[face])) * scale.v));
  cv::Vec3b bgr;
  Shader::store(texel * world.light[face].at(static_cast<float>(u), static_cast<float>(v)), bgr.val);
  return bgr;
}

float mean_level(const World& world, const View& view) {
  const Shader shader(world, view, Exposure{});
  double sum = 0.0;
  for (int y = 0; y < view.ids.rows; ++y) {
    for (int x = 0; x < view.ids.cols; ++x) {
      const Vec4 v = shader.at(view.ids(y, x), static_cast<float>(x), static_cast<float>(y));
      sum += static_cast<double>(std::min(1.5F, (v[0] + v[1] + v[2]) / 765.0F));
    }
  }
  return static_cast<float>(sum / static_cast<double>(view.ids.total()));
}

}  // namespace plumbline::synth
