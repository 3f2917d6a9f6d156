// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "materials/texture_draw.hpp"
#include "scene/random.hpp"

namespace plumbline::synth {

static const std::array<const char*, 24> kWords = {"ROBOT", "mapping", "the",    "visual", "point", "line",
                                                   "of",    "depth",   "ICP",    "world",  "and",   "plane",
                                                   "loop",  "2024",    "sensor", "a",      "light", "camera",
                                                   "frame", "in",      "model",  "error",  "scale", "GRAPH"};

namespace {
/// Settings of a line of text.
struct Pen {
  double scale;
  cv::Scalar color;
  int thick;  ///< px
};
}  // namespace

/// Random words from left to right, as many as fit.
static void text_line(Canvas& canvas, cv::Point at, int width, const Pen& pen, Rng& rng) {
  int x = at.x;
  while (true) {
    const std::string word = kWords[static_cast<std::size_t>(rng.uniform(0.0, 23.999))];
    int base = 0;
    const cv::Size extent = cv::getTextSize(word, cv::FONT_HERSHEY_SIMPLEX, pen.scale, pen.thick, &base);
    if (x + extent.width > at.x + width) return;
    cv::putText(canvas, word, {x, at.y}, cv::FONT_HERSHEY_SIMPLEX, pen.scale, pen.color, pen.thick,
                cv::LINE_AA);
    x += extent.width + static_cast<int>(14 * pen.scale);
  }
}

static cv::Scalar random_color(Rng& rng, double lo, double hi) {
  return {rng.uniform(lo, hi), rng.uniform(lo, hi), rng.uniform(lo, hi)};
}

/// Something like a photograph: horizon, hills, houses.
static void photograph(Canvas part, std::uint64_t seed) {
  Rng rng(seed, 10);
  const cv::Size size = part.size();
  const cv::Mat1f sky = fractal(size, 3, 2, 5, 0.6F, seed), ground = fractal(size, 6, 6, 6, 0.75F, seed + 70);

  // Sky above the hills, ground below.
  const cv::Vec3f high(0.75F, 0.50F, 0.25F), low(0.20F, 0.38F, 0.28F);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float hill = 0.55F + 0.12F * sky(size.height / 3, x);
      const bool above = static_cast<float>(y) < hill * static_cast<float>(size.height);
      part(y, x) = above ? high * (0.9F + 0.4F * sky(y, x)) : low * (0.9F + 0.5F * ground(y, x));
    }
  }

  // Houses with windows.
  for (int i = 0; i < 7; ++i) {
    const int w = static_cast<int>(rng.uniform(0.06, 0.2) * size.width),
              h = static_cast<int>(rng.uniform(0.1, 0.4) * size.height);
    const cv::Point at(static_cast<int>(rng.uniform(0, size.width - w)),
                       static_cast<int>(0.75 * size.height) - h);
    cv::rectangle(part, at, at + cv::Point(w, h), random_color(rng, 0.1, 0.8), -1);

    // Six windows in each house.
    for (int k = 0; k < 6; ++k) {
      const cv::Point p = at + cv::Point(w * (1 + k % 2 * 3) / 6, h * (1 + k / 2 * 2) / 7);
      cv::rectangle(part, p, p + cv::Point(w / 6, h / 8), cv::Scalar::all(rng.uniform(0.02, 0.3)), -1);
    }
  }
}

Canvas draw_poster(const Material&, cv::Size size, std::uint64_t seed) {
  Rng rng(seed, 11);
  const bool pale = rng.uniform() < 0.6;
  Canvas canvas(size, cv::Vec3f(0, 0, 0));
  canvas.setTo(random_color(rng, pale ? 0.6 : 0.08, pale ? 0.9 : 0.5));

  // Dark ink on pale paper, or the reverse.
  const cv::Scalar ink = pale ? cv::Scalar::all(0.04) : cv::Scalar::all(0.85);
  const int w = size.width, h = size.height, margin = w / 14;
  const double unit = w / 512.0;
  text_line(canvas, {margin, h / 9}, w - 2 * margin,
            {2.2 * unit, random_color(rng, 0.0, pale ? 0.4 : 0.9), std::max(2, static_cast<int>(5 * unit))},
            rng);

  // An image below the title.
  const int top = h / 7, photo = static_cast<int>(h * rng.uniform(0.25, 0.42));
  photograph(canvas(cv::Rect(margin, top, w - 2 * margin, photo)), seed + 5);
  const int lines_from = top + photo + h / 18, columns = rng.uniform() < 0.5 ? 2 : 1;

  // Columns of text, with diagrams in between.
  for (int c = 0; c < columns; ++c) {
    const int x = margin + c * (w - 2 * margin) / columns, width = (w - 2 * margin) / columns - margin / 2;
    int y = lines_from;

    // Text lines, and a diagram now and then.
    while (y < h - margin) {
      if (rng.uniform() < 0.12 && y + h / 7 < h - margin) {
        const cv::Scalar color = random_color(rng, 0.05, 0.9);
        cv::rectangle(canvas, {x, y - h / 40}, {x + width / 2, y + h / 12}, color, -1);
        cv::circle(canvas, {x + 3 * width / 4, y + h / 30}, h / 26, random_color(rng, 0.05, 0.9), -1,
                   cv::LINE_AA);
        y += h / 7;
      } else {
        text_line(canvas, {x, y}, width, {0.62 * unit, ink, std::max(1, static_cast<int>(1.6 * unit))}, rng);
        y += static_cast<int>(24 * unit);
      }
    }
  }

  return canvas;
}

Canvas draw_picture(const Material&, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, cv::Vec3f(0.82F, 0.85F, 0.86F));
  const int m = std::min(size.width, size.height) / 9;
  photograph(canvas(cv::Rect(m, m, size.width - 2 * m, size.height - 2 * m)), seed);
  return canvas;
}

Canvas draw_whiteboard(const Material& m, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size, tone(m));
  modulate(canvas, fractal(size, 4, 3, 4, 0.6F, seed), 0.02F);
  Rng rng(seed, 12);

  // Diagrams, notes and curves by turns.
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
      for (int k = 0; k < 3; ++k) text_line(canvas, at + cv::Point(0, 34 * k), 2 * s, {0.9, pen, 2}, rng);
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

Canvas draw_sign(const Material&, cv::Size size, std::uint64_t seed) {
  Rng rng(seed, 13);
  Canvas canvas(size, cv::Vec3f(0, 0, 0));
  canvas.setTo(random_color(rng, 0.04, 0.6));
  const int h = size.height, w = size.width;
  cv::rectangle(canvas, {h / 16, h / 16}, {w - h / 16, h - h / 16}, cv::Scalar::all(0.85),
                std::max(1, h / 40));

  // Number of a room, above a line of text.
  const std::string number = std::to_string(static_cast<int>(rng.uniform(100, 999)));
  cv::putText(canvas, number, {w / 8, 6 * h / 10}, cv::FONT_HERSHEY_DUPLEX, h / 62.0, cv::Scalar::all(0.88),
              h / 30 + 1, cv::LINE_AA);
  text_line(canvas, {w / 8, 17 * h / 20}, 3 * w / 4, {h / 220.0, cv::Scalar::all(0.85), h / 110 + 1}, rng);
  return canvas;
}

Canvas draw_books(const Material&, cv::Size size, std::uint64_t seed) {
  Rng rng(seed, 14);
  Canvas canvas(size, cv::Vec3f(0.05F, 0.05F, 0.05F));
  int x = 0;
  while (x < size.width - 6) {
    // The spine in the book's colour.
    const int w = std::min(size.width - x, static_cast<int>(rng.uniform(0.05, 0.13) * size.width));
    const int top = static_cast<int>(rng.uniform(0.0, 0.1) * size.height);
    const cv::Scalar color = random_color(rng, 0.04, 0.7);
    cv::rectangle(canvas, {x + 1, top}, {x + w - 2, size.height}, color, -1);
    cv::line(canvas, {x, 0}, {x, size.height}, cv::Scalar::all(0.01), 2);

    // Band and title in another tint.
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

Canvas draw_window(const Material&, cv::Size size, std::uint64_t seed) {
  Canvas canvas(size);
  photograph(canvas, seed);

  // Out of focus and bright, as seen from inside.
  cv::GaussianBlur(canvas, canvas, {0, 0}, 6.0);
  canvas.convertTo(canvas, CV_32F, 0.35);
  canvas += cv::Scalar(0.62, 0.58, 0.54);
  return canvas;
}

Canvas draw_screen(const Material&, cv::Size size, std::uint64_t seed) {
  Rng rng(seed, 15);
  Canvas canvas(size, cv::Vec3f(0.10F, 0.06F, 0.05F));

  // A title bar above lines of code.
  cv::rectangle(canvas, {0, 0}, {size.width, size.height / 16}, cv::Scalar(0.35, 0.28, 0.2), -1);
  for (int y = size.height / 9; y < size.height - 12; y += size.height / 24) {
    const int indent = static_cast<int>(rng.uniform(0.02, 0.2) * size.width);
    const Pen pen{0.4, random_color(rng, 0.2, 0.9), 1};
    text_line(canvas, {indent, y}, static_cast<int>(rng.uniform(0.1, 0.6) * size.width), pen, rng);
  }
  return canvas;
}

}  // namespace plumbline::synth
