// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/frame_trajectory.hpp"

#include <algorithm>
#include <cmath>

#include "plumbline/core/numbers.hpp"
#include "plumbline/features/measurement.hpp"

namespace plumbline::mapping {

using geometry::Rigid3;

maps::FramePose FrameTrajectory::measured(const maps::Map& map, double stamp,
                                          const tracking::TrackResult& track) const {
  maps::FramePose frame;
  frame.stamp = stamp;
  frame.tracked = track.state == tracking::TrackState::kTracked;
  if (!frame.tracked) return frame;
  frame.step_sigma_m = track.sigma_m();
  if (poses_.empty() || !poses_.back().tracked || !track.reference.valid()) return frame;
  const maps::FramePose& last = poses_.back();  // its pose is relative to its keyframe
  frame.camera_from_previous = track.camera_from_world *
                               (last.camera_from_reference * map.camera_from_world(last.reference)).inverse();
  return frame;
}

void FrameTrajectory::record(const maps::Map& map, const maps::FramePose& frame, core::KeyframeId reference,
                             const Rigid3& camera_from_world) {
  poses_.push_back(frame);
  poses_.back().reference = reference;
  poses_.back().camera_from_reference = camera_from_world * map.camera_from_world(reference).inverse();
}

geometry::Vector6d FrameTrajectory::velocity(const maps::Map& map) const {
  if (poses_.size() < 2) return geometry::Vector6d::Zero();
  const maps::FramePose& now = poses_[poses_.size() - 1];
  const maps::FramePose& before = poses_[poses_.size() - 2];
  constexpr double kLongest_s = 0.5;
  const double dt = now.stamp - before.stamp;
  if (!now.tracked || !before.tracked || !(dt > 1e-4 && dt < kLongest_s)) return geometry::Vector6d::Zero();
  const Rigid3 now_from_world = now.camera_from_reference * map.camera_from_world(now.reference);
  const Rigid3 before_from_world = before.camera_from_reference * map.camera_from_world(before.reference);
  return geometry::log_se3(now_from_world * before_from_world.inverse()) / dt;
}

/// Median accuracy of the poses so far, metres: it depends on the measurements that a pipeline uses. Zero:
/// not known.
double FrameTrajectory::usual_sigma_m() const {
  constexpr double kGap = 0.1;  // TrackResult::sigma_m after a gap
  std::vector<double> sigmas;
  for (const maps::FramePose& frame : poses_) {
    if (frame.tracked && frame.step_sigma_m > 0.0 && frame.step_sigma_m < kGap)
      sigmas.push_back(frame.step_sigma_m);
  }
  return core::quantile(std::move(sigmas), 0.5, 0.0);
}

/// In a turn that is too fast the pose is known to centimetres only: such a frame is as good as lost. If only
/// the motion model constrains a direction, no better pose can be had. Where a pipeline uses few of the
/// measurements, centimetres are usual.
bool FrameTrajectory::is_accurate(const tracking::TrackResult& track) const {
  constexpr double kEnough_m = 0.01;  // in the weakest direction
  constexpr double kUsual = 10.0;     // times what is usual
  const bool is_first = track.min_eigenvalue == 0.0;
  if (is_first || track.degenerate_directions > 0) return true;
  const double sigma_m = 1.0 / std::sqrt(track.min_eigenvalue);
  if (sigma_m <= kEnough_m) return true;
  const double usual_m = usual_sigma_m();
  return usual_m == 0.0 || sigma_m <= kUsual * usual_m;
}

/// Landmarks that the frame was matched with, spread over all of them, including some that do not fit.
std::shared_ptr<const maps::SeenPoints> FrameTrajectory::seen_points(const tracking::TrackResult& track,
                                                                     const sensor::ImageModel& model,
                                                                     const ObservationNoise& noise) const {
  constexpr std::size_t kMost = 150;
  if (track.features == nullptr || track.points.empty()) return nullptr;

  // All of the first 2000 frames are kept, every second of the next 2000, every fourth of the next 4000, and
  // so on: a long run keeps little more than a short one.
  std::size_t every = 1;
  while (poses_.size() >= 2000 * every) every *= 2;
  if (poses_.size() % every != 0) return nullptr;

  auto seen = std::make_shared<maps::SeenPoints>();
  seen->depth_delay_s = model.camera().depth_delay_s;

  const auto keep = [&](const tracking::PointMatch& m, const Eigen::Vector2f& shift) {
    const features::PointFeature& f = track.features->points[static_cast<std::size_t>(m.feature)];
    const Eigen::Vector2f pixel = f.pixel + shift;
    const float depth = track.features->depth_beside(static_cast<std::size_t>(m.feature), shift);
    const auto measured = features::measurement_of({pixel.cast<double>(), static_cast<double>(depth)},
                                                   track.features->shutter_motion, model);
    seen->points.push_back({m.point, measured.pixel.cast<float>(), static_cast<float>(measured.depth),
                            static_cast<float>(noise.of(f, m.aligned).pixel_sigma)});
  };

  const std::size_t all = track.points.size() + track.doubtful.size();
  const std::size_t count = std::min(kMost, all);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t n = i * all / count;
    if (n < track.points.size()) {
      keep(track.points[n], Eigen::Vector2f::Zero());  // it is at its aligned position already
    } else {
      keep(track.doubtful[n - track.points.size()], track.doubtful[n - track.points.size()].shift);
    }
  }

  return seen;
}

}  // namespace plumbline::mapping
