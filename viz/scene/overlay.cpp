// SPDX-License-Identifier: BSD-3-Clause
#include "scene/overlay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "canvas/ticks.hpp"

namespace plumbline::viz {
namespace {

constexpr Rgb kInk{45, 48, 54};
constexpr Rgb kFaint{110, 114, 122};
constexpr Rgb kWhite{255, 255, 255};
constexpr Rgb kGround{250, 250, 248};  // background of text in front of points
constexpr double kTextSize = 22.0;     // in pixels, if the picture is 1200 px high

Eigen::Vector2d on_picture(const Projection& projection, const Eigen::Vector3d& p) {
  return projection.project(p).head<2>();
}

bool in_front(const Projection& projection, const Eigen::Vector3d& p) {
  return p.allFinite() && (projection.orthographic || (p - projection.eye).dot(projection.forward) > 0.02);
}

/// Draws a line with a white edge, readable on any background.
void cased_line(Painter& painter, const std::vector<Eigen::Vector2d>& line, const Rgb& color, double width) {
  painter.polyline(line, kWhite, width + 2.0);
  painter.polyline(line, color, width);
}

void draw_path(Painter& painter, const Projection& projection, const CameraPath& path) {
  std::vector<std::vector<Eigen::Vector2d>> pieces(1);

  // Points behind the viewer split the path.
  for (const auto& pose : path.trajectory) {
    const Eigen::Vector3d& p = pose.world_from_camera.translation;
    if (in_front(projection, p)) {
      const Eigen::Vector2d at = on_picture(projection, p);

      // Points less than a pixel apart add nothing.
      const bool moved = pieces.back().empty() || (at - pieces.back().back()).norm() > painter.scale();
      if (moved) pieces.back().push_back(at);
    } else if (!pieces.back().empty()) {
      pieces.emplace_back();
    }
  }

  for (const auto& piece : pieces) cased_line(painter, piece, path.color, 3.0);

  // Empty pieces have no ends to mark.
  pieces.erase(std::remove_if(pieces.begin(), pieces.end(), [](const auto& piece) { return piece.empty(); }),
               pieces.end());
  if (pieces.empty()) return;

  // Disc at the end, ring at the start.
  painter.disc(pieces.back().back(), 8.5, kWhite);
  painter.disc(pieces.back().back(), 7.0, path.color);
  painter.disc(pieces.front().front(), 9.5, kWhite);
  painter.ring(pieces.front().front(), 6.5, path.color, 3.0);
}

struct LegendEntry {
  std::string text;
  Rgb color;
  bool line = false;
};

/// Robots by the colour of their points, paths by that of their lines.
std::vector<LegendEntry> legend_entries(const OverlayContent& content) {
  std::vector<LegendEntry> entries;
  if (content.options->color == ColorMode::kRobot) {
    for (std::size_t i = 0; i < content.scene->robot_names.size(); ++i) {
      entries.push_back({content.scene->robot_names[i], category_color(i), false});
    }
  }
  for (const CameraPath& path : content.scene->paths) {
    if (!path.name.empty()) entries.push_back({path.name, path.color, true});
  }
  return entries;
}

void draw_title_and_legend(Painter& painter, const OverlayContent& content) {
  const double s = painter.scale();
  double y = content.projection.height_px - 40.0 * s;
  const double x = 36.0 * s;

  // A veil keeps text readable over points.
  if (!content.scene->title.empty()) {
    const double width = painter.text_width(content.scene->title, 30.0, true);
    painter.rectangle({x - 8.0 * s, y - 24.0 * s}, {width + 16.0 * s, 48.0 * s}, kGround, 0.8);
    painter.text({x, y}, content.scene->title, 30.0, kInk, Anchor::kLeft, true);
    y -= 46.0 * s;
  }

  // The longest entry sets the width.
  const auto entries = legend_entries(content);
  double widest = 0.0;
  for (const auto& entry : entries) widest = std::max(widest, painter.text_width(entry.text, kTextSize));
  if (entries.empty()) return;

  const double line_height = 32.0 * s;
  const double height = line_height * static_cast<double>(entries.size()) + 12.0 * s;
  painter.rectangle({x - 8.0 * s, y + 22.0 * s - height}, {widest + 66.0 * s, height}, kGround, 0.8);

  // Lines for paths, squares for robots.
  for (const auto& entry : entries) {
    if (entry.line) {
      painter.polyline({{x, y}, {x + 36.0 * s, y}}, entry.color, 4.0);
    } else {
      painter.rectangle({x + 8.0 * s, y - 9.0 * s}, {18.0 * s, 18.0 * s}, entry.color);
    }
    painter.text({x + 46.0 * s, y}, entry.text, kTextSize, kInk);
    y -= line_height;
  }
}

void draw_scale_bar(Painter& painter, const OverlayContent& content) {
  const Projection& projection = content.projection;
  const double depth = 0.5 * (projection.near_m + projection.far_m);
  const double per_metre = projection.pixels_per_metre(depth);
  const double metres = nice_number_below(0.22 * projection.width_px / per_metre);

  const double s = painter.scale();
  const double length = metres * per_metre;
  const Eigen::Vector2d left(36.0 * s, 40.0 * s);
  painter.rectangle(left - Eigen::Vector2d(10.0 * s, 14.0 * s), {length + 20.0 * s, 60.0 * s}, kGround, 0.8);
  painter.rectangle(left, {length, 6.0 * s}, kInk);
  painter.rectangle(left, {2.0 * s, 14.0 * s}, kInk);
  painter.rectangle(left + Eigen::Vector2d(length - 2.0 * s, 0.0), {2.0 * s, 14.0 * s}, kInk);

  // In perspective the bar is true at the middle of the scene only.
  const std::string text = projection.orthographic ? length_text(metres) : "~ " + length_text(metres);
  painter.text(left + Eigen::Vector2d(0.5 * length, 28.0 * s), text, kTextSize, kInk, Anchor::kCentre);
}

/// Draws the map frame's axes in the lower right corner.
void draw_axes(Painter& painter, const OverlayContent& content) {
  const Projection& projection = content.projection;
  const double s = painter.scale();
  const Eigen::Vector2d origin(projection.width_px - 90.0 * s, 90.0 * s);
  constexpr double kLength = 48.0;
  painter.rectangle(origin - Eigen::Vector2d(72.0 * s, 72.0 * s), {144.0 * s, 144.0 * s}, kGround, 0.6);

  // Near axes cover far ones.
  const std::array<Rgb, 3> colors{{{200, 50, 50}, {40, 150, 60}, {45, 90, 200}}};
  const std::array<const char*, 3> names{"x", "y", "z"};
  std::array<int, 3> order{0, 1, 2};  // sorted below: axes that point away from the viewer first
  std::sort(order.begin(), order.end(),
            [&projection](int a, int b) { return projection.forward[a] > projection.forward[b]; });

  // Each axis as the viewer sees it.
  for (const int axis : order) {
    const Eigen::Vector2d direction(projection.right[axis], projection.up[axis]);
    const Eigen::Vector2d tip = origin + kLength * s * direction;
    const auto i = static_cast<std::size_t>(axis);
    cased_line(painter, {origin, tip}, colors[i], 3.5);

    // An axis along the line of sight is a dot.
    if (direction.norm() < 0.25) {
      painter.disc(tip, 5.0, colors[i]);
      painter.text(origin + Eigen::Vector2d(-18.0 * s, -18.0 * s), names[i], kTextSize, colors[i],
                   Anchor::kCentre);
      continue;
    }

    painter.text(tip + 17.0 * s * direction.normalized(), names[i], kTextSize, colors[i], Anchor::kCentre);
  }
}

/// Draws a vertical bar from `corner` (lower left) upwards, with ticks to its right.
void draw_color_bar(Painter& painter, const ColorScale& scale, const Eigen::Vector2d& corner, double height,
                    double text_px) {
  constexpr int kSteps = 128;
  const double s = painter.scale();
  const double width = text_px * s;
  const double step = height / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const bool last = i + 1 == kSteps;  // overlap, so that no seam shows between the steps
    painter.rectangle(corner + Eigen::Vector2d(0.0, i * step), {width, last ? step : 2.0 * step},
                      sequential_color((i + 0.5) / kSteps));
  }

  const double span = scale.high - scale.low;
  for (const Tick& tick : nice_ticks(scale.low, scale.high, span / 5.0)) {
    const double y = corner.y() + height * (tick.value - scale.low) / span;
    painter.polyline({{corner.x() + width, y}, {corner.x() + width + 6.0 * s, y}}, kInk, 1.5);
    painter.text({corner.x() + width + 11.0 * s, y}, tick.label, 0.88 * text_px, kInk);
  }
}

/// Colour bar in the upper right corner; none for colours without values.
void draw_value_scale(Painter& painter, const OverlayContent& content) {
  const ColorScale& scale = content.color_scale;
  if (!scale.shown) return;
  const double s = painter.scale();
  const double height = 0.42 * content.projection.height_px;
  const Eigen::Vector2d corner(content.projection.width_px - 140.0 * s,
                               content.projection.height_px - 100.0 * s - height);
  painter.rectangle(corner - Eigen::Vector2d(16.0 * s, 22.0 * s), {136.0 * s, height + 90.0 * s}, kGround,
                    0.8);
  draw_color_bar(painter, scale, corner, height, kTextSize);
  painter.text({content.projection.width_px - 28.0 * s, corner.y() + height + 34.0 * s}, scale.label,
               kTextSize, kInk, Anchor::kRight);
}

}  // namespace

std::string length_text(double metres) {
  if (metres >= 1000.0) return fmt::format("{:g} km", metres / 1000.0);
  if (metres >= 1.0) return fmt::format("{:g} m", metres);
  if (metres >= 0.01) return fmt::format("{:g} cm", std::round(metres * 1e5) / 1e3);
  return fmt::format("{:g} mm", std::round(metres * 1e6) / 1e3);
}

void draw_paths(Painter& painter, const OverlayContent& content) {
  for (const CameraPath& path : content.scene->paths) draw_path(painter, content.projection, path);
}

void draw_annotations(Painter& painter, const OverlayContent& content) {
  // An empty map is named even without annotations.
  if (content.empty) {
    painter.text({0.5 * content.projection.width_px, 0.5 * content.projection.height_px}, "empty map", 48.0,
                 kFaint, Anchor::kCentre);
  }
  if (!content.options->annotations) return;
  draw_title_and_legend(painter, content);
  draw_value_scale(painter, content);
  if (content.empty) return;
  draw_scale_bar(painter, content);
  draw_axes(painter, content);
}

}  // namespace plumbline::viz
