// SPDX-License-Identifier: BSD-3-Clause
// Procedural textures: noise, grain, weave, print and handwriting, drawn once when a world is built.
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "materials.hpp"
#include "random.hpp"

namespace plumbline::synth {

namespace {

using Canvas = cv::Mat_<cv::Vec3f>;  // reflectance, B G R

/// Sum of octaves of smooth noise on lattices that wrap round; `cx`, `cy` cells over the whole image at the
/// lowest one.
cv::Mat1f fractal(cv::Size size, int cx, int cy, int octaves, float falloff, std::uint64_t seed) {
  cv::Mat1f out(size, 0.0F);
  float gain = 1.0F, sum = 0.0F;
  std::vector<float> lattice;
  std::vector<int> cell(static_cast<std::size_t>(size.width));
  std::vector<float> ease(static_cast<std::size_t>(size.width));
  for (int o = 0; o < octaves; ++o) {
    const int px = cx << o, py = cy << o;
    if (px > size.width && py > size.height) break;
    const std::uint64_t key = mix(seed + static_cast<std::uint64_t>(o));
    lattice.resize(static_cast<std::size_t>(px) * static_cast<std::size_t>(py));
    for (std::size_t i = 0; i < lattice.size(); ++i) {
      lattice[i] = gain * (static_cast<float>(mix(key ^ i) >> 40U) * 0x1.0p-23F - 1.0F);
    }
    const auto smooth = [](float t) { return t * t * (3.0F - 2.0F * t); };
    for (int x = 0; x < size.width; ++x) {
      const float u = static_cast<float>(x) * static_cast<float>(px) / static_cast<float>(size.width);
      cell[static_cast<std::size_t>(x)] = std::min(px - 1, static_cast<int>(u));
      ease[static_cast<std::size_t>(x)] = smooth(u - std::floor(u));
    }
    for (int y = 0; y < size.height; ++y) {
      const float v = static_cast<float>(y) * static_cast<float>(py) / static_cast<float>(size.height);
      const int iy = std::min(py - 1, static_cast<int>(v));
      const float sy = smooth(v - std::floor(v));
      const float* top = lattice.data() + static_cast<std::size_t>(iy) * static_cast<std::size_t>(px);
      const float* low =
          lattice.data() + static_cast<std::size_t>((iy + 1) % py) * static_cast<std::size_t>(px);
      float* row = out[y];
      for (int x = 0; x < size.width; ++x) {
        const int i = cell[static_cast<std::size_t>(x)], k = i + 1 == px ? 0 : i + 1;
        const float sx = ease[static_cast<std::size_t>(x)];
        const float a = top[i] + sx * (top[k] - top[i]), b = low[i] + sx * (low[k] - low[i]);
        row[x] += a + sy * (b - a);
      }
    }
    sum += gain * gain;
    gain *= falloff;
  }
  out *= static_cast<double>(1.6F / std::sqrt(sum));
  return out;
}

/// Independent noise for each texel, uniform in [-1, 1].
cv::Mat1f grain(cv::Size size, std::uint64_t seed) {
  cv::Mat1f out(size);
  std::uint64_t i = 0;
  for (float& v : out) v = static_cast<float>(mix(seed, i++) >> 40U) * 0x1.0p-23F - 1.0F;
  return out;
}

cv::Vec3f tone(const Material& m) { return {m.blue, m.green, m.red}; }
cv::Scalar scalar(const cv::Vec3f& v) { return {v[0], v[1], v[2]}; }

/// base * (1 + amount * field)
void modulate(Canvas& canvas, const cv::Mat1f& field, float amount) {
  for (int y = 0; y < canvas.rows; ++y) {
    for (int x = 0; x < canvas.cols; ++x) canvas(y, x) *= 1.0F + amount * field(y, x);
  }
}

Canvas plain(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  modulate(canvas, fractal(size, 3, 3, 4, 0.6F, seed), 0.025F);
  return canvas;
}

Canvas plaster(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
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

Canvas ceiling(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas = plaster(m, size, seed);
  Rng rng(seed, 2);
  for (int i = 0; i < 900; ++i) {  // perforated acoustic boards
    const cv::Point c(static_cast<int>(rng.uniform(0, size.width)),
                      static_cast<int>(rng.uniform(0, size.height)));
    cv::circle(canvas, c, rng.uniform() < 0.3 ? 1 : 0, scalar(tone(m) * rng.uniform(0.45, 0.8)), -1);
  }
  for (int i = 0; i < 2; ++i) {
    const int at = i * size.width / 2;
    cv::line(canvas, {at, 0}, {at, size.height}, scalar(tone(m) * 0.6F), 3);
    cv::line(canvas, {0, at}, {size.width, at}, scalar(tone(m) * 0.6F), 3);
  }
  return canvas;
}

Canvas carpet(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
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
void wood_board(Canvas canvas, const cv::Vec3f& base, std::uint64_t seed) {
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

Canvas wood(const Material& m, cv::Size size, std::uint64_t seed) {
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
  modulate(canvas, grain(size, seed + 3), 0.05F);
  return canvas;
}

Canvas planks(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size);
  const int rows = 10, step = size.height / rows;
  Rng rng(seed, 6);
  for (int i = 0; i < rows; ++i) {
    const int y0 = i * step, y1 = i + 1 == rows ? size.height : y0 + step;
    const int cut = static_cast<int>(rng.uniform(0.2, 0.8) * size.width);
    const std::array<int, 3> ends = {0, cut, size.width};
    for (std::size_t k = 0; k < 2; ++k) {
      wood_board(canvas(cv::Rect(ends[k], y0, ends[k + 1] - ends[k], y1 - y0)), tone(m),
                 mix(seed, static_cast<std::uint64_t>(i * 2) + k));
      cv::line(canvas, {ends[k], y0}, {ends[k], y1 - 1}, scalar(tone(m) * 0.25F), 2);
    }
    cv::line(canvas, {0, y0}, {size.width, y0}, scalar(tone(m) * 0.25F), 2);
  }
  modulate(canvas, grain(size, seed + 3), 0.05F);
  return canvas;
}

Canvas brick(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, cv::Vec3f(0.50F, 0.53F, 0.55F));
  const int rows = 14;
  const double h = static_cast<double>(size.height) / rows, w = size.width / 4.0;
  Rng rng(seed, 7);
  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < 4; ++k) {
      const double x = (k + (i % 2) * 0.5) * w;
      const cv::Scalar color = scalar(tone(m) * rng.uniform(0.65, 1.3));
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
void add_creases(cv::Mat1f& field, Rng& rng) {
  cv::Mat1f creases(field.size(), 0.0F);
  for (int i = 0; i < 70; ++i) {
    cv::Point p(static_cast<int>(rng.uniform(0, field.cols)), static_cast<int>(rng.uniform(0, field.rows)));
    double angle = rng.uniform(0.0, M_PI);
    const double depth = rng.uniform(0.05, 0.16) * (rng.uniform() < 0.5 ? 1.0 : -1.0);
    for (int k = 0; k < 5; ++k) {
      const cv::Point q =
          p + cv::Point(static_cast<int>(7 * std::cos(angle)), static_cast<int>(7 * std::sin(angle)));
      cv::line(creases, p, q, depth * (1.0 - 0.15 * k), 2, cv::LINE_8);
      p = q;
      angle += rng.uniform(-0.5, 0.5);
    }
  }
  cv::GaussianBlur(creases, creases, {0, 0}, 1.0);
  field += creases;
}

/// The sewn edge near the floor, held down by strips of tape.
void add_hem(Canvas& canvas, double pixels_per_m, Rng& rng) {
  const int bottom = canvas.rows, seam = bottom - static_cast<int>(0.055 * pixels_per_m);
  canvas.rowRange(seam - 1, seam + 1) *= 0.86;
  canvas.rowRange(seam + 1, bottom) *= 1.04;
  for (double x = 0.0; x + 0.1 < canvas.cols / pixels_per_m; x += rng.uniform(0.3, 0.6)) {
    const int size = static_cast<int>(0.05 * pixels_per_m), left = static_cast<int>(x * pixels_per_m);
    canvas(cv::Rect(left, bottom - size, size, size)).setTo(cv::Scalar(0.72, 0.55, 0.50));
  }
}

/// Hung white cloth: broad soft folds from top to bottom and a faint weave.
Canvas cloth(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  modulate(canvas, fractal(size, 3, 2, 3, 0.5F, seed), 0.02F);
  const cv::Mat1f sway = fractal(size, 3, 3, 3, 0.45F, seed + 20);
  const cv::Mat1f fade = fractal(size, 9, 3, 2, 0.5F, seed + 30);
  Rng rng(seed, 8);
  struct Fold {
    float at, width, depth;
  };
  std::vector<Fold> folds;
  for (int i = 0; i < 16; ++i) {
    folds.push_back({static_cast<float>(rng.uniform()), static_cast<float>(rng.uniform(0.004, 0.018)),
                     static_cast<float>(rng.uniform(0.015, 0.085) * (rng.uniform() < 0.6 ? 1.0 : -0.6))});
  }
  for (int i = 0; i < 17; ++i) {  // narrow, nearly sharp ones
    folds.push_back({static_cast<float>(rng.uniform()), static_cast<float>(rng.uniform(0.0012, 0.0028)),
                     static_cast<float>(rng.uniform(0.08, 0.18) * (rng.uniform() < 0.6 ? 1.0 : -1.0))});
  }
  cv::Mat1f field(size, 0.0F);
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
  add_creases(field, rng);
  modulate(canvas, field, 1.0F);
  modulate(canvas, fractal(size, 128, 128, 3, 0.8F, seed + 40), 0.012F);
  for (int i = 0; i < 18; ++i) {  // stains and pin holes
    const cv::Point c(static_cast<int>(rng.uniform(0, size.width)),
                      static_cast<int>(rng.uniform(0, size.height)));
    cv::ellipse(canvas, c, {1 + static_cast<int>(rng.uniform(0, 2.0)), 1}, rng.uniform(0, 180), 0, 360,
                scalar(tone(m) * rng.uniform(0.4, 0.75)), -1, cv::LINE_AA);
  }
  add_hem(canvas, size.height / m.tile_m, rng);
  return canvas;
}

Canvas fabric(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float weave = ((x / 3 + y / 3) % 2 == 0 ? 1.0F : -1.0F) * 0.08F;
      canvas(y, x) *= 1.0F + weave;
    }
  }
  modulate(canvas, grain(size, seed), 0.18F);
  modulate(canvas, fractal(size, 10, 10, 4, 0.7F, seed + 1), 0.12F);
  return canvas;
}

Canvas rug(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  Rng rng(seed, 9);
  const std::array<cv::Scalar, 4> colors = {cv::Scalar(0.10, 0.16, 0.42), cv::Scalar(0.45, 0.60, 0.72),
                                            cv::Scalar(0.30, 0.16, 0.10), cv::Scalar(0.12, 0.42, 0.62)};
  const int cells = 6, step = size.width / cells;
  for (int i = 0; i < cells; ++i) {
    for (int k = 0; k < cells; ++k) {
      const cv::Point c(i * step + step / 2, k * step + step / 2);
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

const std::array<const char*, 24> kWords = {"ROBOT", "mapping", "the",    "visual", "point", "line",
                                            "of",    "depth",   "ICP",    "world",  "and",   "plane",
                                            "loop",  "2024",    "sensor", "a",      "light", "camera",
                                            "frame", "in",      "model",  "error",  "scale", "GRAPH"};

void text_line(Canvas& canvas, cv::Point at, int width, double scale, const cv::Scalar& color, int thick,
               Rng& rng) {
  int x = at.x;
  while (true) {
    const std::string word = kWords[static_cast<std::size_t>(rng.uniform(0.0, 23.999))];
    int base = 0;
    const cv::Size extent = cv::getTextSize(word, cv::FONT_HERSHEY_SIMPLEX, scale, thick, &base);
    if (x + extent.width > at.x + width) return;
    cv::putText(canvas, word, {x, at.y}, cv::FONT_HERSHEY_SIMPLEX, scale, color, thick, cv::LINE_AA);
    x += extent.width + static_cast<int>(14 * scale);
  }
}

cv::Scalar random_color(Rng& rng, double lo, double hi) {
  return {rng.uniform(lo, hi), rng.uniform(lo, hi), rng.uniform(lo, hi)};
}

/// Something like a photograph: horizon, hills, houses.
void photograph(Canvas part, std::uint64_t seed) {
  Rng rng(seed, 10);
  const cv::Size size = part.size();
  const cv::Mat1f sky = fractal(size, 3, 2, 5, 0.6F, seed), ground = fractal(size, 6, 6, 6, 0.75F, seed + 70);
  const cv::Vec3f high(0.75F, 0.50F, 0.25F), low(0.20F, 0.38F, 0.28F);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float hill = 0.55F + 0.12F * sky(size.height / 3, x);
      const bool above = static_cast<float>(y) < hill * static_cast<float>(size.height);
      part(y, x) = above ? high * (0.9F + 0.4F * sky(y, x)) : low * (0.9F + 0.5F * ground(y, x));
    }
  }
  for (int i = 0; i < 7; ++i) {
    const int w = static_cast<int>(rng.uniform(0.06, 0.2) * size.width),
              h = static_cast<int>(rng.uniform(0.1, 0.4) * size.height);
    const cv::Point at(static_cast<int>(rng.uniform(0, size.width - w)),
                       static_cast<int>(0.75 * size.height) - h);
    cv::rectangle(part, at, at + cv::Point(w, h), random_color(rng, 0.1, 0.8), -1);
    for (int k = 0; k < 6; ++k) {
      const cv::Point p = at + cv::Point(w * (1 + k % 2 * 3) / 6, h * (1 + k / 2 * 2) / 7);
      cv::rectangle(part, p, p + cv::Point(w / 6, h / 8), cv::Scalar::all(rng.uniform(0.02, 0.3)), -1);
    }
  }
}

Canvas poster(const Material&, cv::Size size, std::uint64_t seed) {
  Rng rng(seed, 11);
  const bool pale = rng.uniform() < 0.6;
  Canvas canvas(size, cv::Vec3f(0, 0, 0));
  canvas.setTo(random_color(rng, pale ? 0.6 : 0.08, pale ? 0.9 : 0.5));
  const cv::Scalar ink = pale ? cv::Scalar::all(0.04) : cv::Scalar::all(0.85);
  const int w = size.width, h = size.height, margin = w / 14;
  const double unit = w / 512.0;
  text_line(canvas, {margin, h / 9}, w - 2 * margin, 2.2 * unit, random_color(rng, 0.0, pale ? 0.4 : 0.9),
            std::max(2, static_cast<int>(5 * unit)), rng);
  const int top = h / 7, photo = static_cast<int>(h * rng.uniform(0.25, 0.42));
  photograph(canvas(cv::Rect(margin, top, w - 2 * margin, photo)), seed + 5);
  const int lines_from = top + photo + h / 18, columns = rng.uniform() < 0.5 ? 2 : 1;
  for (int c = 0; c < columns; ++c) {
    const int x = margin + c * (w - 2 * margin) / columns, width = (w - 2 * margin) / columns - margin / 2;
    int y = lines_from;
    while (y < h - margin) {
      if (rng.uniform() < 0.12 && y + h / 7 < h - margin) {
        const cv::Scalar color = random_color(rng, 0.05, 0.9);
        cv::rectangle(canvas, {x, y - h / 40}, {x + width / 2, y + h / 12}, color, -1);
        cv::circle(canvas, {x + 3 * width / 4, y + h / 30}, h / 26, random_color(rng, 0.05, 0.9), -1,
                   cv::LINE_AA);
        y += h / 7;
      } else {
        text_line(canvas, {x, y}, width, 0.62 * unit, ink, std::max(1, static_cast<int>(1.6 * unit)), rng);
        y += static_cast<int>(24 * unit);
      }
    }
  }
  return canvas;
}

Canvas picture(const Material&, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, cv::Vec3f(0.82F, 0.85F, 0.86F));
  const int m = std::min(size.width, size.height) / 9;
  photograph(canvas(cv::Rect(m, m, size.width - 2 * m, size.height - 2 * m)), seed);
  return canvas;
}

Canvas whiteboard(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  modulate(canvas, fractal(size, 4, 3, 4, 0.6F, seed), 0.02F);
  Rng rng(seed, 12);
  const std::array<cv::Scalar, 3> pens = {cv::Scalar(0.35, 0.08, 0.05), cv::Scalar(0.06, 0.06, 0.5),
                                          cv::Scalar(0.05, 0.05, 0.05)};
  for (int i = 0; i < 9; ++i) {
    const cv::Scalar& pen = pens[static_cast<std::size_t>(rng.uniform(0.0, 2.999))];
    const cv::Point at(static_cast<int>(rng.uniform(0.04, 0.75) * size.width),
                       static_cast<int>(rng.uniform(0.1, 0.8) * size.height));
    const int s = size.width / 9;
    if (i % 3 == 0) {
      cv::rectangle(canvas, at, at + cv::Point(s, s / 2), pen, 3, cv::LINE_AA);
      cv::arrowedLine(canvas, at + cv::Point(s, s / 4), at + cv::Point(2 * s, s / 4), pen, 3, cv::LINE_AA);
    } else if (i % 3 == 1) {
      for (int k = 0; k < 3; ++k) text_line(canvas, at + cv::Point(0, 34 * k), 2 * s, 0.9, pen, 2, rng);
    } else {
      std::vector<cv::Point> curve;
      const double f = rng.uniform(0.02, 0.07), a = rng.uniform(10, 40);
      for (int x = 0; x < 2 * s; x += 4)
        curve.emplace_back(at.x + x, at.y + static_cast<int>(a * std::sin(f * x)));
      cv::polylines(canvas, curve, false, pen, 3, cv::LINE_AA);
    }
  }
  return canvas;
}

Canvas sign(const Material&, cv::Size size, std::uint64_t seed) {
  Rng rng(seed, 13);
  Canvas canvas(size, cv::Vec3f(0, 0, 0));
  canvas.setTo(random_color(rng, 0.04, 0.6));
  const int h = size.height, w = size.width;
  cv::rectangle(canvas, {h / 16, h / 16}, {w - h / 16, h - h / 16}, cv::Scalar::all(0.85),
                std::max(1, h / 40));
  const std::string number = std::to_string(static_cast<int>(rng.uniform(100, 999)));
  cv::putText(canvas, number, {w / 8, 6 * h / 10}, cv::FONT_HERSHEY_DUPLEX, h / 62.0, cv::Scalar::all(0.88),
              h / 30 + 1, cv::LINE_AA);
  text_line(canvas, {w / 8, 17 * h / 20}, 3 * w / 4, h / 220.0, cv::Scalar::all(0.85), h / 110 + 1, rng);
  return canvas;
}

Canvas books(const Material&, cv::Size size, std::uint64_t seed) {
  Rng rng(seed, 14);
  Canvas canvas(size, cv::Vec3f(0.05F, 0.05F, 0.05F));
  int x = 0;
  while (x < size.width - 6) {
    const int w = std::min(size.width - x, static_cast<int>(rng.uniform(0.05, 0.13) * size.width));
    const int top = static_cast<int>(rng.uniform(0.0, 0.1) * size.height);
    const cv::Scalar color = random_color(rng, 0.04, 0.7);
    cv::rectangle(canvas, {x + 1, top}, {x + w - 2, size.height}, color, -1);
    cv::line(canvas, {x, 0}, {x, size.height}, cv::Scalar::all(0.01), 2);
    const cv::Scalar ink = color * 0.2 + cv::Scalar::all(rng.uniform() < 0.5 ? 0.7 : 0.02);
    const int band = static_cast<int>(rng.uniform(0.15, 0.3) * size.height);
    cv::rectangle(canvas, {x + 2, band}, {x + w - 3, band + size.height / 30}, ink, -1);
    for (int k = 0; k < 9; ++k) {  // title, set upright
      const int y = static_cast<int>((0.4 + 0.045 * k) * size.height);
      cv::line(canvas, {x + w / 3, y}, {x + w / 3 + static_cast<int>(rng.uniform(0.1, 0.4) * w), y}, ink, 2);
    }
    x += w;
  }
  return canvas;
}

Canvas door(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size);
  Canvas turned(cv::Size(size.height, size.width));
  wood_board(turned, tone(m), seed);
  cv::rotate(turned, canvas, cv::ROTATE_90_CLOCKWISE);
  const int w = size.width, h = size.height;
  for (const auto& [y0, y1] : {std::pair{0.07, 0.45}, std::pair{0.53, 0.93}}) {
    const cv::Rect r(w / 6, static_cast<int>(y0 * h), 2 * w / 3, static_cast<int>((y1 - y0) * h));
    cv::rectangle(canvas, r, scalar(tone(m) * 0.45F), 5);
    cv::rectangle(canvas, r + cv::Point(4, 4), scalar(tone(m) * 1.35F), 3);
  }
  return canvas;
}

Canvas window(const Material&, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size);
  photograph(canvas, seed);
  cv::GaussianBlur(canvas, canvas, {0, 0}, 6.0);
  canvas.convertTo(canvas, CV_32F, 0.35);
  canvas += cv::Scalar(0.62, 0.58, 0.54);
  return canvas;
}

Canvas screen(const Material&, cv::Size size, std::uint64_t seed) {
  Rng rng(seed, 15);
  Canvas canvas(size, cv::Vec3f(0.10F, 0.06F, 0.05F));
  cv::rectangle(canvas, {0, 0}, {size.width, size.height / 16}, cv::Scalar(0.35, 0.28, 0.2), -1);
  for (int y = size.height / 9; y < size.height - 12; y += size.height / 24) {
    const int indent = static_cast<int>(rng.uniform(0.02, 0.2) * size.width);
    text_line(canvas, {indent, y}, static_cast<int>(rng.uniform(0.1, 0.6) * size.width), 0.4,
              random_color(rng, 0.2, 0.9), 1, rng);
  }
  return canvas;
}

Canvas tiles(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size);
  Rng rng(seed, 16);
  const int n = 4, step = size.width / n;
  for (int i = 0; i < n * n; ++i) {
    const cv::Rect r(i % n * step, i / n * step, step, step);
    canvas(r).setTo(scalar(tone(m) * rng.uniform(0.85, 1.1)));
  }
  modulate(canvas, fractal(size, 10, 10, 5, 0.75F, seed), 0.12F);
  for (int i = 0; i < n; ++i) {
    cv::line(canvas, {i * step, 0}, {i * step, size.height}, cv::Scalar::all(0.3), 3);
    cv::line(canvas, {0, i * step}, {size.width, i * step}, cv::Scalar::all(0.3), 3);
  }
  return canvas;
}

Canvas cardboard(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
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

Canvas lino(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  modulate(canvas, fractal(size, 3, 3, 5, 0.6F, seed), 0.03F);
  modulate(canvas, grain(size, seed + 2), 0.06F);
  return canvas;
}

Canvas draw(const Material& m, cv::Size size, std::uint64_t seed) {
  switch (m.print) {
    case Print::kPlain:
    case Print::kPaper:
    case Print::kHall:
      return plain(m, size, seed);
    case Print::kPlaster:
      return plaster(m, size, seed);
    case Print::kCeiling:
      return ceiling(m, size, seed);
    case Print::kCarpet:
      return carpet(m, size, seed);
    case Print::kPlanks:
      return planks(m, size, seed);
    case Print::kWood:
      return wood(m, size, seed);
    case Print::kBrick:
      return brick(m, size, seed);
    case Print::kCloth:
      return cloth(m, size, seed);
    case Print::kFabric:
      return fabric(m, size, seed);
    case Print::kRug:
      return rug(m, size, seed);
    case Print::kMetal:
      return cardboard(m, size, seed);
    case Print::kScreen:
      return screen(m, size, seed);
    case Print::kPoster:
      return poster(m, size, seed);
    case Print::kPicture:
      return picture(m, size, seed);
    case Print::kWhiteboard:
      return whiteboard(m, size, seed);
    case Print::kSign:
      return sign(m, size, seed);
    case Print::kBooks:
      return books(m, size, seed);
    case Print::kCover:
      return poster(m, size, seed);
    case Print::kDoor:
      return door(m, size, seed);
    case Print::kWindow:
      return window(m, size, seed);
    case Print::kTiles:
      return tiles(m, size, seed);
    case Print::kCardboard:
      return cardboard(m, size, seed);
    case Print::kLino:
      return lino(m, size, seed);
    case Print::kLeaf:
      return fabric(m, size, seed);
  }
  return plain(m, size, seed);
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
