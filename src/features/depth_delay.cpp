// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/depth_delay.hpp"

#include "plumbline/features/line_depth.hpp"

namespace plumbline::features {
namespace {

using geometry::Rigid3;

constexpr double kNearest_m = 0.05;  // metres; nearer is behind the camera or inside it

class Delay {
 public:
  Delay(const cv::Mat& depth, const sensor::Pinhole& camera, const Rigid3& depth_from_camera)
      : depth_(depth),
        camera_(camera),
        depth_from_camera_(depth_from_camera),
        camera_from_depth_(depth_from_camera.inverse()) {}

  /// Pixel of the depth image that shows what the colour image shows at `pixel`, `z` metres away.
  [[nodiscard]] Eigen::Vector2f in_depth(const Eigen::Vector2f& pixel, double z) const {
    const Eigen::Vector3d p = depth_from_camera_ * ray(pixel, z);
    return p.z() < kNearest_m ? pixel : Eigen::Vector2f(camera_.project(p).cast<float>());
  }
  [[nodiscard]] CornerDepth point_depth(const PointFeature& point) const {
    const Eigen::Vector2f there = in_depth(point.pixel, static_cast<double>(point.depth));
    const CornerDepth found = corner_depth(depth_, there.x(), there.y());
    if (!(found.z > 0.0F)) return {};

    // Depth at the time of the colour image
    const double back = (camera_from_depth_ * ray(there, static_cast<double>(found.z))).z();
    if (back < kNearest_m) return {};
    return {static_cast<float>(back), found.slant};
  }
  [[nodiscard]] std::optional<Line3> line_depth(const LineFeature& line,
                                                const LineDepthOptions& options) const {
    // Ends of the segment in the depth image
    LineSegment there = line.segment;
    there.start = in_depth(there.start, line.line3->start.z());
    there.end = in_depth(there.end, line.line3->end.z());
    std::optional<Line3> fit = fit_line_depth(there, depth_, camera_, options);
    if (!fit) return fit;

    // In the camera at the time of the colour image
    fit->start = camera_from_depth_ * fit->start;
    fit->end = camera_from_depth_ * fit->end;
    if (fit->start.z() < kNearest_m || fit->end.z() < kNearest_m) return std::nullopt;
    return fit;
  }

 private:
  [[nodiscard]] Eigen::Vector3d ray(const Eigen::Vector2f& pixel, double z) const {
    return camera_.unproject(static_cast<double>(pixel.x()), static_cast<double>(pixel.y()), z);
  }

  const cv::Mat& depth_;
  const sensor::Pinhole& camera_;
  Rigid3 depth_from_camera_;
  Rigid3 camera_from_depth_;
};

}  // namespace

void undo_point_depth_delay(FrameFeatures& features, const cv::Mat& depth, const sensor::Pinhole& camera,
                            const Rigid3& depth_from_camera) {
  if (depth.empty()) return;
  const Delay delay(depth, camera, depth_from_camera);

  // Slants change with the depths
  features.slants.resize(features.points.size(), Eigen::Vector2f::Zero());
  for (std::size_t i = 0; i < features.points.size(); ++i) {
    PointFeature& point = features.points[i];
    if (!(point.depth > 0.0F)) continue;
    const CornerDepth found = delay.point_depth(point);
    point.depth = found.z;
    features.slants[i] = found.slant;
  }
}

void undo_line_depth_delay(FrameFeatures& features, const cv::Mat& depth, const sensor::Pinhole& camera,
                           const Rigid3& depth_from_camera, const LineDepthOptions& options) {
  if (depth.empty()) return;
  const Delay delay(depth, camera, depth_from_camera);

  // Only lines with depth are affected
  for (LineFeature& line : features.lines) {
    if (line.line3) line.line3 = delay.line_depth(line, options);
  }
}

}  // namespace plumbline::features
