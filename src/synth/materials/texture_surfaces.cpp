// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "materials/texture_draw.hpp"
#include "scene/random.hpp"

namespace plumbline::synth {

Canvas draw_plain(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  modulate(canvas, fractal(size, 3, 3, 4, 0.6F, seed), 0.025F);
  return canvas;
}

Canvas draw_plaster(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));

  // Stains, then marks of the roller.
  modulate(canvas, fractal(size, 2, 2, 4, 0.6F, seed), 0.03F);
  modulate(canvas, fractal(size, 64, 64, 3, 0.8F, seed + 50), 0.05F);  // roller marks
  Rng rng(seed, 1);
  for (int i = 0; i < 40; ++i) {  // scuffs and specks
    const cv::Point c(static_cast<int>(rng.uniform(0, size.width)),
                      static_cast<int>(rng.uniform(0, size.height)));
    const double gain = rng.uniform(0.72, 1.06);
    cv::ellipse(canvas, c, {1 + static_cast<int>(rng.uniform(0, 2.5)), 1}, rng.uniform(0, 180), 0, 360,
                scalar(tone(m) * gain), -1, cv::LINE_AA);
  }
  return canvas;
}

Canvas draw_ceiling(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas = draw_plaster(m, size, seed);
  Rng rng(seed, 2);
  for (int i = 0; i < 900; ++i) {  // perforated acoustic boards
    const cv::Point c(static_cast<int>(rng.uniform(0, size.width)),
                      static_cast<int>(rng.uniform(0, size.height)));
    cv::circle(canvas, c, rng.uniform() < 0.3 ? 1 : 0, scalar(tone(m) * rng.uniform(0.45, 0.8)), -1);
  }

  // Joints between the boards.
  for (int i = 0; i < 2; ++i) {
    const int at = i * size.width / 2;
    cv::line(canvas, {at, 0}, {at, size.height}, scalar(tone(m) * 0.6F), 3);
    cv::line(canvas, {0, at}, {size.width, at}, scalar(tone(m) * 0.6F), 3);
  }
  return canvas;
}

Canvas draw_carpet(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));

  // Soft yarn of uneven colour.
  modulate(canvas, grain(size, seed), 0.45F);
  cv::GaussianBlur(canvas, canvas, {0, 0}, 0.8);
  modulate(canvas, fractal(size, 24, 24, 4, 0.8F, seed + 7), 0.22F);
  Rng rng(seed, 3);
  for (int i = 0; i < 1400; ++i) {  // flecks of other yarn
    const cv::Point c(static_cast<int>(rng.uniform(0, size.width)),
                      static_cast<int>(rng.uniform(0, size.height)));
    const cv::Point d(static_cast<int>(rng.uniform(-5, 5)), static_cast<int>(rng.uniform(-5, 5)));
    cv::line(canvas, c, c + d, scalar(tone(m) * rng.uniform(0.35, 2.2)), 1, cv::LINE_AA);
  }
  return canvas;
}

/// Rings of a board cut along the trunk; `x` runs along the grain.
static void wood_board(Canvas canvas, const cv::Vec3f& base, std::uint64_t seed) {
  const cv::Size size = canvas.size();
  const cv::Mat1f warp = fractal(size, 1, 3, 3, 0.5F, seed), fibre = fractal(size, 8, 128, 2, 0.7F, seed + 9);
  Rng rng(seed, 4);
  const float rings = static_cast<float>(rng.uniform(5.0, 11.0)), phase = static_cast<float>(rng.uniform());
  const cv::Vec3f own = base * rng.uniform(0.8, 1.15);

  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float v = static_cast<float>(y) / static_cast<float>(size.height);
      const float ring = rings * (v + 0.16F * warp(y, x)) + phase;
      const float saw = ring - std::floor(ring);
      const float dark = 1.0F - 0.33F * saw * saw * saw + 0.10F * fibre(y, x);
      canvas(y, x) = own * dark;
    }
  }
}

Canvas draw_wood(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size);
  wood_board(canvas, tone(m), seed);
  Rng rng(seed, 5);
  for (int i = 0; i < 3; ++i) {  // knots
    const cv::Point c(static_cast<int>(rng.uniform(30, size.width - 30)),
                      static_cast<int>(rng.uniform(30, size.height - 30)));
    for (int r = 9; r >= 1; r -= 2) {
      cv::ellipse(canvas, c, {2 * r, r}, 0, 0, 360, scalar(tone(m) * (r % 4 == 1 ? 0.45 : 0.75)), -1,
                  cv::LINE_AA);
    }
  }

  // Fine pores over everything.
  modulate(canvas, grain(size, seed + 3), 0.05F);
  return canvas;
}

Canvas draw_planks(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size);
  const int rows = 10, step = size.height / rows;
  Rng rng(seed, 6);

  for (int i = 0; i < rows; ++i) {
    const int y0 = i * step, y1 = i + 1 == rows ? size.height : y0 + step;

    // Two boards per row, cut at random.
    const int cut = static_cast<int>(rng.uniform(0.2, 0.8) * size.width);
    const std::array<int, 3> ends = {0, cut, size.width};
    for (std::size_t k = 0; k < 2; ++k) {
      wood_board(canvas(cv::Rect(ends[k], y0, ends[k + 1] - ends[k], y1 - y0)), tone(m),
                 mix(seed, static_cast<std::uint64_t>(i * 2) + k));
      cv::line(canvas, {ends[k], y0}, {ends[k], y1 - 1}, scalar(tone(m) * 0.25F), 2);
    }

    // Joint above the row.
    cv::line(canvas, {0, y0}, {size.width, y0}, scalar(tone(m) * 0.25F), 2);
  }

  modulate(canvas, grain(size, seed + 3), 0.05F);
  return canvas;
}

Canvas draw_brick(const Material& m, cv::Size size, std::uint64_t seed) {
  // Mortar shows between the bricks.
  Canvas canvas(size, cv::Vec3f(0.50F, 0.53F, 0.55F));
  const int rows = 14;
  const double h = static_cast<double>(size.height) / rows, w = size.width / 4.0;
  Rng rng(seed, 7);

  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < 4; ++k) {
      // Every other row is offset by half a brick.
      const double x = (k + (i % 2) * 0.5) * w;
      const cv::Scalar color = scalar(tone(m) * rng.uniform(0.65, 1.3));

      // Drawn twice, to continue at the opposite border.
      for (const double shift : {0.0, -static_cast<double>(size.width)}) {
        cv::rectangle(canvas, cv::Point2d(x + 3 + shift, i * h + 3),
                      cv::Point2d(x + w - 3 + shift, (i + 1) * h - 3), color, -1);
      }
    }
  }

  modulate(canvas, fractal(size, 48, 48, 3, 0.8F, seed), 0.14F);
  return canvas;
}

/// Short creases where the cloth was folded or pulled.
static void add_creases(cv::Mat1f& field, Rng& rng) {
  cv::Mat1f creases(field.size(), 0.0F);

  constexpr int kAcross = 7, kDown = 8;  // one per cell, so that all seeds have about as many in view
  for (int i = 0; i < kAcross * kDown; ++i) {
    cv::Point p(static_cast<int>((i % kAcross + rng.uniform()) * field.cols / kAcross),
                static_cast<int>((i / kAcross + rng.uniform()) * field.rows / kDown));
    double angle = rng.uniform(0.0, M_PI);
    const double depth = rng.uniform(0.05, 0.13) * (rng.uniform() < 0.5 ? 1.0 : -1.0);

    // Bends from piece to piece, fading.
    for (int k = 0; k < 5; ++k) {
      const cv::Point q =
          p + cv::Point(static_cast<int>(7 * std::cos(angle)), static_cast<int>(7 * std::sin(angle)));
      cv::line(creases, p, q, depth * (1.0 - 0.15 * k), 2, cv::LINE_8);
      p = q;
      angle += rng.uniform(-0.5, 0.5);
    }
  }

  // Soft, as cloth is.
  cv::GaussianBlur(creases, creases, {0, 0}, 1.0);
  field += creases;
}

/// The sewn edge near the floor, held down by strips of tape.
static void add_hem(Canvas& canvas, double pixels_per_m, Rng& rng) {
  const int bottom = canvas.rows, seam = bottom - static_cast<int>(0.055 * pixels_per_m);
  canvas.rowRange(seam - 1, seam + 1) *= 0.86;
  canvas.rowRange(seam + 1, bottom) *= 1.04;
  for (double x = 0.0; x + 0.1 < canvas.cols / pixels_per_m; x += rng.uniform(0.5, 0.65)) {
    const int size = static_cast<int>(0.05 * pixels_per_m), left = static_cast<int>(x * pixels_per_m);
    canvas(cv::Rect(left, bottom - size, size, size)).setTo(cv::Scalar(0.72, 0.55, 0.50));
  }
}

/// Hung white cloth: broad soft folds from top to bottom and a faint weave.
Canvas draw_cloth(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  modulate(canvas, fractal(size, 3, 2, 3, 0.5F, seed), 0.02F);

  // Folds sway and fade along their length.
  const cv::Mat1f sway = fractal(size, 3, 3, 3, 0.45F, seed + 20);
  const cv::Mat1f fade = fractal(size, 9, 3, 2, 0.5F, seed + 30);

  Rng rng(seed, 8);
  struct Fold {
    float at, width, depth;
  };
  std::vector<Fold> folds;

  for (int i = 0; i < 16; ++i) {  // spread evenly, as the creases are
    folds.push_back({static_cast<float>((i + rng.uniform()) / 16.0),
                     static_cast<float>(rng.uniform(0.004, 0.018)),
                     static_cast<float>(rng.uniform(0.015, 0.085) * (rng.uniform() < 0.6 ? 1.0 : -0.6))});
  }

  for (int i = 0; i < 18; ++i) {  // narrow, nearly sharp ones
    folds.push_back({static_cast<float>((i + rng.uniform()) / 18.0),
                     static_cast<float>(rng.uniform(0.0012, 0.0028)),
                     static_cast<float>(rng.uniform(0.095, 0.16) * (rng.uniform() < 0.6 ? 1.0 : -1.0))});
  }

  cv::Mat1f field(size, 0.0F);

  // Profile of all folds at each pixel.
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(size.width) + 0.018F * sway(y, x);
      float sum = 0.0F;

      for (const Fold& f : folds) {
        float d = u - f.at;
        d -= std::round(d);
        const float k = d / f.width;
        if (k > -4.0F && k < 4.0F) sum += f.depth * std::exp(-0.5F * k * k) * (0.55F + 0.6F * fade(y, x));
      }
      field(y, x) = sum;
    }
  }

  // Creases, weave, stains and hem.
  add_creases(field, rng);
  modulate(canvas, field, 1.0F);
  modulate(canvas, fractal(size, 128, 128, 3, 0.8F, seed + 40), 0.012F);

  for (int i = 0; i < 8; ++i) {  // stains and pin holes
    const cv::Point c(static_cast<int>((i % 4 + rng.uniform()) * size.width / 4),
                      static_cast<int>((i / 4 + rng.uniform()) * size.height / 2));
    cv::ellipse(canvas, c, {1 + static_cast<int>(rng.uniform(0, 2.0)), 1}, rng.uniform(0, 180), 0, 360,
                scalar(tone(m) * rng.uniform(0.5, 0.8)), -1, cv::LINE_AA);
  }

  add_hem(canvas, size.height / m.tile_m, rng);
  return canvas;
}

Canvas draw_fabric(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      // A checkered weave.
      const float weave = ((x / 3 + y / 3) % 2 == 0 ? 1.0F : -1.0F) * 0.08F;
      canvas(y, x) *= 1.0F + weave;
    }
  }
  modulate(canvas, grain(size, seed), 0.18F);
  modulate(canvas, fractal(size, 10, 10, 4, 0.7F, seed + 1), 0.12F);
  return canvas;
}

Canvas draw_rug(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  Rng rng(seed, 9);
  const std::array<cv::Scalar, 4> colors = {cv::Scalar(0.10, 0.16, 0.42), cv::Scalar(0.45, 0.60, 0.72),
                                            cv::Scalar(0.30, 0.16, 0.10), cv::Scalar(0.12, 0.42, 0.62)};
  const int cells = 6, step = size.width / cells;

  for (int i = 0; i < cells; ++i) {
    for (int k = 0; k < cells; ++k) {
      const cv::Point c(i * step + step / 2, k * step + step / 2);

      // Diamonds from the outside in.
      for (int ring = 3; ring >= 0; --ring) {
        const int r = step * (ring + 1) / 9;
        const std::vector<cv::Point> diamond = {c + cv::Point(r, 0), c + cv::Point(0, r), c - cv::Point(r, 0),
                                                c - cv::Point(0, r)};
        cv::fillConvexPoly(canvas, diamond, colors[static_cast<std::size_t>(ring + i + 2 * k) % 4],
                           cv::LINE_AA);
      }
    }
  }

  modulate(canvas, grain(size, seed), 0.2F);
  return canvas;
}

Canvas draw_door(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size);
  Canvas turned(cv::Size(size.height, size.width));

  // The grain runs upright.
  wood_board(turned, tone(m), seed);
  cv::rotate(turned, canvas, cv::ROTATE_90_CLOCKWISE);
  const int w = size.width, h = size.height;

  // Two panels with bevelled edges.
  for (const auto& [y0, y1] : {std::pair{0.07, 0.45}, std::pair{0.53, 0.93}}) {
    const cv::Rect r(w / 6, static_cast<int>(y0 * h), 2 * w / 3, static_cast<int>((y1 - y0) * h));
    cv::rectangle(canvas, r, scalar(tone(m) * 0.45F), 5);
    cv::rectangle(canvas, r + cv::Point(4, 4), scalar(tone(m) * 1.35F), 3);
  }
  return canvas;
}

Canvas draw_tiles(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size);
  Rng rng(seed, 16);
  const int n = 4, step = size.width / n;
  for (int i = 0; i < n * n; ++i) {
    const cv::Rect r(i % n * step, i / n * step, step, step);
    canvas(r).setTo(scalar(tone(m) * rng.uniform(0.85, 1.1)));
  }
  modulate(canvas, fractal(size, 10, 10, 5, 0.75F, seed), 0.12F);

  // Joints between the tiles.
  for (int i = 0; i < n; ++i) {
    cv::line(canvas, {i * step, 0}, {i * step, size.height}, cv::Scalar::all(0.3), 3);
    cv::line(canvas, {0, i * step}, {size.width, i * step}, cv::Scalar::all(0.3), 3);
  }
  return canvas;
}

Canvas draw_cardboard(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));

  // Flutes, stains and grain.
  modulate(canvas, fractal(size, 3, 64, 3, 0.7F, seed), 0.05F);
  modulate(canvas, fractal(size, 4, 4, 4, 0.6F, seed + 4), 0.05F);
  modulate(canvas, grain(size, seed + 5), 0.05F);
  Rng rng(seed, 17);
  for (int i = 0; i < 12; ++i) {  // staples and scratches
    const cv::Point c(static_cast<int>(rng.uniform(0, size.width)),
                      static_cast<int>(rng.uniform(0, size.height)));
    cv::circle(canvas, c, 2, scalar(tone(m) * (rng.uniform() < 0.5 ? 0.3 : 1.7)), -1, cv::LINE_AA);
  }
  return canvas;
}

Canvas draw_lino(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  modulate(canvas, fractal(size, 3, 3, 5, 0.6F, seed), 0.03F);
  modulate(canvas, grain(size, seed + 2), 0.06F);
  return canvas;
}

}  // namespace plumbline::synth
