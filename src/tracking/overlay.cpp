// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/overlay.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <string>

#include "plumbline/geometry/plucker.hpp"

namespace plumbline::tracking {
namespace {

using Pixel = Eigen::Vector2d;

const cv::Scalar kFaint(150, 150, 150);
const cv::Scalar kMeasured(255, 230, 120);   // light blue
const cv::Scalar kPredicted(255, 255, 255);  // white
const cv::Scalar kFlatLine(255, 90, 200);    // violet: lines without depth
const cv::Scalar kText(240, 240, 240);
const cv::Scalar kLostText(80, 80, 255);
const cv::Scalar kTrackedText(120, 255, 120);
constexpr double kWorst_px = 3.0;  // residuals from here on are red
constexpr double kNear_m = 0.05;   // map lines are cut off this far in front of the camera

/// Fixed-point pixel for OpenCV's sub-pixel drawing; far-away coordinates are brought into its range.
constexpr int kShift = 4;
cv::Point fixed(const Pixel& p) {
  const auto bounded = [](double x) {
    return static_cast<int>(std::lround(std::clamp(x, -3e4, 3e4) * (1 << kShift)));
  };
  return {bounded(p.x()), bounded(p.y())};
}

void stroke(cv::Mat& image, const Pixel& a, const Pixel& b, const cv::Scalar& color, int width = 1) {
  if (!a.allFinite() || !b.allFinite()) return;
  cv::line(image, fixed(a), fixed(b), color, width, cv::LINE_AA, kShift);
}

void disc(cv::Mat& image, const Pixel& p, double radius, const cv::Scalar& color, int width) {
  if (!p.allFinite()) return;
  cv::circle(image, fixed(p), static_cast<int>(std::lround(radius * (1 << kShift))), color, width,
             cv::LINE_AA, kShift);
}

/// Green - yellow - red.
cv::Scalar residual_color(double px) {
  const double t = std::clamp(px / kWorst_px, 0.0, 1.0);
  return {40.0, 230.0 * std::min(1.0, 2.0 - 2.0 * t), 255.0 * std::min(1.0, 2.0 * t)};
}

void draw_residual(cv::Mat& image, const Pixel& measured, const Pixel& predicted) {
  const Pixel error = predicted - measured;
  if (!error.allFinite()) return;
  stroke(image, measured, measured + kResidualZoom * error, residual_color(error.norm()), 2);
}

/// The image, dimmed so that colours on it stand out.
cv::Mat canvas(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera) {
  cv::Mat image;
  if (!frame.color.empty()) {
    image = frame.color.clone();
  } else if (!frame.gray.empty()) {
    cv::cvtColor(frame.gray, image, cv::COLOR_GRAY2BGR);
  } else {
    image = cv::Mat(std::max(camera.height, 1), std::max(camera.width, 1), CV_8UC3, cv::Scalar::all(0));
  }
  image *= 0.6;
  return image;
}

/// Everything that was found and not tracked, at half strength.
void draw_untracked(cv::Mat& image, const features::FrameFeatures& features, const TrackResult& track) {
  std::vector<bool> point_used(features.points.size(), false);
  std::vector<bool> line_used(features.lines.size(), false);
  for (const PointMatch& m : track.points) point_used.at(static_cast<std::size_t>(m.feature)) = true;
  for (const LineMatch& m : track.lines) line_used.at(static_cast<std::size_t>(m.feature)) = true;
  cv::Mat layer = image.clone();
  for (std::size_t i = 0; i < features.lines.size(); ++i) {
    if (line_used[i]) continue;
    const features::LineFeature& line = features.lines[i];
    stroke(layer, line.segment.start.cast<double>(), line.segment.end.cast<double>(),
           line.line3 ? kFaint : kFlatLine);
  }
  for (std::size_t i = 0; i < features.points.size(); ++i) {
    if (!point_used[i]) disc(layer, features.points[i].pixel.cast<double>(), 1.2, kFaint, 1);
  }
  cv::addWeighted(image, 0.5, layer, 0.5, 0.0, image);
}

/// The map's segment as it should appear, cut off at the camera; nothing when it is behind.
void draw_projected_segment(cv::Mat& image, Eigen::Vector3d a, Eigen::Vector3d b,
                            const sensor::Pinhole& camera) {
  if (a.z() > b.z()) std::swap(a, b);
  if (b.z() <= kNear_m) return;
  if (a.z() < kNear_m) a += (b - a) * ((kNear_m - a.z()) / (b.z() - a.z()));
  stroke(image, camera.project(a), camera.project(b), kPredicted);
}

void draw_lines(cv::Mat& image, const features::FrameFeatures& features, const TrackResult& track,
                const maps::Map& map, const sensor::Pinhole& camera) {
  const Eigen::Matrix3d projection = geometry::line_projection(camera.fx, camera.fy, camera.cx, camera.cy);
  for (const LineMatch& match : track.lines) {
    const features::LineFeature& feature = features.lines[static_cast<std::size_t>(match.feature)];
    const Pixel ends[] = {feature.segment.start.cast<double>(), feature.segment.end.cast<double>()};
    stroke(image, ends[0], ends[1], feature.line3 ? kMeasured : kFlatLine, 2);
    const maps::MapLine* landmark = map.find(match.line);
    if (landmark == nullptr) continue;

    // The landmark at the estimated pose
    const Eigen::Vector3d a = track.camera_from_world * landmark->start;
    const Eigen::Vector3d b = track.camera_from_world * landmark->end;
    draw_projected_segment(image, a, b, camera);
    const Eigen::Vector3d l = projection * geometry::line_through(a, b).n;
    const Eigen::Vector2d normal = l.head<2>();
    if (!(normal.squaredNorm() > 0.0)) continue;  // through the camera's centre: no image

    // Distances of the measured ends from the projected line
    for (const Pixel& end : ends) {
      const double distance = l.dot(end.homogeneous()) / normal.norm();
      draw_residual(image, end, end - distance * normal.normalized());
      disc(image, end, 2.0, residual_color(std::abs(distance)), cv::FILLED);
    }
  }
}

void draw_points(cv::Mat& image, const features::FrameFeatures& features, const TrackResult& track,
                 const maps::Map& map, const sensor::Pinhole& camera) {
  for (const PointMatch& match : track.points) {
    const Pixel measured = features.points[static_cast<std::size_t>(match.feature)].pixel.cast<double>();
    const maps::MapPoint* landmark = map.find(match.point);
    disc(image, measured, 2.5, kMeasured, 1);
    if (landmark == nullptr) continue;

    // The landmark at the estimated pose
    const Eigen::Vector3d p = track.camera_from_world * landmark->position;
    if (p.z() <= kNear_m) continue;
    const Pixel predicted = camera.project(p);
    draw_residual(image, measured, predicted);
    disc(image, predicted, 0.8, kPredicted, cv::FILLED);
  }
}

/// Writes text of a size relative to the image: 1 at 640 px width.
class Writer {
 public:
  explicit Writer(cv::Mat& image) : image_(image), scale_(std::max(0.25, image.cols / 640.0)) {}

  [[nodiscard]] int px(double at_640) const { return static_cast<int>(std::lround(at_640 * scale_)); }
  /// Darkens rows [top, top + height).
  void panel(int top, int height) {
    const cv::Rect rows = cv::Rect(0, top, image_.cols, height) & cv::Rect(0, 0, image_.cols, image_.rows);
    if (rows.area() > 0) image_(rows) *= 0.3;
  }
  /// Writes at (x, baseline) and returns where the text ends.
  int text(int x, int baseline, const std::string& words, const cv::Scalar& color) {
    const double size = 0.42 * scale_;
    const int width = std::max(1, px(1.0));
    cv::putText(image_, words, {x, baseline}, cv::FONT_HERSHEY_SIMPLEX, size, color, width, cv::LINE_AA);
    return x + cv::getTextSize(words, cv::FONT_HERSHEY_SIMPLEX, size, width, nullptr).width;
  }
  cv::Mat& image() { return image_; }

 private:
  cv::Mat& image_;
  double scale_;
};

std::string family(const char* name, const optimize::FamilySummary& f) {
  if (f.terms == 0) return std::string(name) + " -";
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "%s %d/%d rms %.2f", name, f.inliers, f.terms, f.rms);
  return buffer;
}

void write_state(Writer& out, const sensor::RgbdFrame& frame, const TrackResult& track) {
  out.panel(0, out.px(36));
  const bool lost = track.state == TrackState::kLost;
  int x = out.text(out.px(6), out.px(14), "frame " + std::to_string(frame.index), kText);
  x = out.text(x + out.px(14), out.px(14), to_string(track.state), lost ? kLostText : kTrackedText);
  if (track.relocalised) x = out.text(x + out.px(14), out.px(14), "relocalised", kTrackedText);
  if (track.state == TrackState::kInitialising) return;
  const cv::Scalar weak_color = track.degenerate_directions > 0 ? kLostText : kText;
  out.text(x + out.px(14), out.px(14),
           "weak directions " + std::to_string(track.degenerate_directions) + " of 6", weak_color);

  // Inliers and residuals of each family
  x = out.px(6);
  for (const std::string& words :
       {family("points", track.estimate.points), family("lines", track.estimate.lines),
        family("depth", track.estimate.planes)}) {
    x = out.text(x, out.px(30), words, kText) + out.px(14);
  }
}

void write_legend(Writer& out) {
  cv::Mat& image = out.image();
  const int top = image.rows - out.px(20);
  out.panel(top, out.px(20));

  const int baseline = image.rows - out.px(6);
  const double middle = baseline - out.px(4);

  // A stroke, then its meaning
  const auto sample = [&](int& x, const char* words, const cv::Scalar& color, int width) {
    stroke(image, {x, middle}, {x + out.px(14), middle}, color, width);
    x = out.text(x + out.px(18), baseline, words, kText) + out.px(12);
  };

  int x = out.px(6);
  sample(x, "measured", kMeasured, 2);
  sample(x, "from the map", kPredicted, 1);
  sample(x, "2D only", kFlatLine, 1);
  sample(x, "untracked", kFaint, 1);
  char zoom[32];
  std::snprintf(zoom, sizeof zoom, "residual x%.0f: 0", kResidualZoom);
  x = out.text(x, baseline, zoom, kText) + out.px(5);

  // Colours of the residuals
  const int length = out.px(60);
  for (int i = 0; i < length; ++i) {
    stroke(image, {x + i, middle - out.px(3)}, {x + i, middle + out.px(3)},
           residual_color(kWorst_px * i / length));
  }

  out.text(x + length + out.px(5), baseline, "3 px", kText);
}

}  // namespace

cv::Mat draw_overlay(const sensor::RgbdFrame& frame, const features::FrameFeatures& features,
                     const TrackResult& track, const maps::Map& map, const sensor::Pinhole& camera) {
  cv::Mat image = canvas(frame, camera);
  draw_untracked(image, features, track);
  draw_lines(image, features, track, map, camera);
  draw_points(image, features, track, map, camera);
  Writer out(image);
  write_state(out, frame, track);
  write_legend(out);

  // Lost: a frame around the image
  if (track.state == TrackState::kLost) {
    cv::rectangle(image, {0, 0, image.cols, image.rows}, kLostText, std::max(2, out.px(3)));
  }
  return image;
}

}  // namespace plumbline::tracking
