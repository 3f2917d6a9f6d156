// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/measurement.hpp"

#include <algorithm>
#include <cmath>

#include "plumbline/features/rolling_shutter.hpp"

namespace plumbline::features {
namespace {

using geometry::Vector6d;

/// Position of a point in the image at `share` of the readout after the middle row was read.
Eigen::Vector2d moved_pixel(const PixelDepth& from, double share, const Vector6d& shutter_motion,
                            const sensor::Pinhole& image, double& depth) {
  const RowMotion motion(shutter_motion, share, from.depth > 0.0);
  const Eigen::Vector3d p =
      motion(image.unproject(from.pixel.x(), from.pixel.y(), from.depth > 0.0 ? from.depth : 1.0));
  depth = from.depth > 0.0 ? p.z() : 0.0;
  return image.project(p);
}

/// The feature as it was when its row was read; which row that is depends on its position at that time.
PixelDepth with_shutter(const PixelDepth& feature, const Vector6d& shutter_motion,
                        const sensor::Pinhole& image) {
  constexpr int kRounds = 3;  // each leaves a hundredth of the error
  if (shutter_motion.isZero(0.0)) return feature;
  PixelDepth read = feature;
  for (int i = 0; i < kRounds; ++i) {
    const double share = read.pixel.y() / image.height - 0.5;
    read.pixel = moved_pixel(feature, share, shutter_motion, image, read.depth);
  }
  return read;
}

PixelDepth without_shutter(const PixelDepth& read, const Vector6d& shutter_motion,
                           const sensor::Pinhole& image) {
  if (shutter_motion.isZero(0.0)) return read;
  PixelDepth feature;

  // Rows are read before or after the middle one
  const double share = read.pixel.y() / image.height - 0.5;
  feature.pixel = moved_pixel(read, -share, shutter_motion, image, feature.depth);
  return feature;
}

}  // namespace

PixelDepth measurement_of(const PixelDepth& feature, const Vector6d& shutter_motion,
                          const sensor::ImageModel& model) {
  const PixelDepth read = with_shutter(feature, shutter_motion, model.image());
  return {model.lens_pixel(read.pixel),
          read.depth > 0.0 ? model.measured_depth(read.pixel, read.depth) : 0.0};
}

PixelDepth feature_of(const PixelDepth& measurement, const Vector6d& shutter_motion,
                      const sensor::ImageModel& model) {
  PixelDepth read;
  read.pixel = model.rectified_pixel(measurement.pixel);
  read.depth = measurement.depth > 0.0 ? model.true_depth(read.pixel, measurement.depth) : 0.0;
  return without_shutter(read, shutter_motion, model.image());
}

double depth_rate(const Eigen::Vector3d& p, const Eigen::Vector3d& normal, const Vector6d& velocity) {
  constexpr double kLeastCosine = 0.3;  // between ray and normal
  const double along = normal.dot(p);
  if (!(std::abs(along) > kLeastCosine * p.norm())) return 0.0;
  return p.z() * normal.dot(velocity.head<3>() + velocity.tail<3>().cross(p)) / along;
}

void recalibrate(FrameFeatures& features, const sensor::Recalibration& change, const Vector6d& velocity,
                 const std::vector<double>& depth_rates) {
  const sensor::Pinhole& image = change.before().image();
  const Vector6d motion_before = features.shutter_motion;
  const Vector6d motion_after = change.after().camera().readout_s.value_or(0.0) * velocity;

  // Back to the measurement, then with the new camera
  const auto made_anew = [&](const Eigen::Vector2f& pixel, double depth) {
    const PixelDepth seen = measurement_of({pixel.cast<double>(), depth}, motion_before, change.before());
    return feature_of(seen, motion_after, change.after());
  };

  // Points, and the patches around them
  for (std::size_t i = 0; i < features.points.size(); ++i) {
    PointFeature& point = features.points[i];
    PixelDepth now = made_anew(point.pixel, static_cast<double>(point.depth));
    if (now.depth > 0.0 && !depth_rates.empty()) now.depth -= change.delay_s() * depth_rates[i];
    point.pixel = now.pixel.cast<float>();
    point.depth = static_cast<float>(std::max(now.depth, 0.0));
    if (!features.patches.empty()) features.patches[i].middle = point.pixel - features.patches[i].offset;
  }

  // Ends of lines, with their depth at the new delay
  for (LineFeature& line : features.lines) {
    const auto move_end = [&](Eigen::Vector2f& pixel, Eigen::Vector3d* end) {
      const PixelDepth now = made_anew(pixel, end != nullptr ? end->z() : 0.0);
      pixel = now.pixel.cast<float>();
      if (end == nullptr || !(now.depth > 0.0)) return;
      const Eigen::Vector3d p = image.unproject(now.pixel.x(), now.pixel.y(), now.depth);
      const double towards = velocity(2) + velocity(3) * p.y() - velocity(4) * p.x();
      *end = p * (1.0 - change.delay_s() * towards / p.z());
    };

    move_end(line.segment.start, line.line3 ? &line.line3->start : nullptr);
    move_end(line.segment.end, line.line3 ? &line.line3->end : nullptr);
  }

  features.shutter_motion = motion_after;
  features.grid = PointGrid(features.points, image.width, image.height);
}

}  // namespace plumbline::features
