// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/adjustment/map_recalibration.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "plumbline/features/measurement.hpp"
#include "plumbline/geometry/velocity.hpp"
#include "plumbline/maps/camera_history.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using geometry::Vector6d;

constexpr double kNearest_m = 0.1;     // nearest point that is used
constexpr std::size_t kSamples = 240;  // surface samples of a keyframe for relative poses
constexpr std::size_t kLeastSamples = 20;

/// Effect of a camera change on one image.
struct ImageChange {
  const sensor::Recalibration* change = nullptr;
  Vector6d velocity = Vector6d::Zero();
  Vector6d shutter_before = Vector6d::Zero();  ///< FrameFeatures::shutter_motion

  /// Present position of a surface point that was seen at `p`, with the surface's normal (camera frame).
  [[nodiscard]] Eigen::Vector3d place(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const {
    Eigen::Vector3d now = change->point(p);
    const Vector6d shutter = change->after().camera().readout_s.value_or(0.0) * velocity - shutter_before;
    if (!shutter.isZero(0.0)) {
      const sensor::Pinhole& image = change->before().image();
      const double share = std::clamp(image.project(now).y() / image.height - 0.5, -0.5, 0.5);
      now = geometry::exp_se3(-share * shutter) * now;
    }
    const double rate = change->delay_s() != 0.0 ? features::depth_rate(p, normal, velocity) : 0.0;
    return now * (1.0 - change->delay_s() * rate / p.z());
  }
};

/// The position of one place in the camera frames of two images.
struct SharedPlace {
  Eigen::Vector3d in_a;
  Eigen::Vector3d in_b;
  Eigen::Vector3d normal_in_b;
};

/// b_from_a that best aligns the places according to images and depth: Gauss-Newton from `start`.
Rigid3 aligned(const std::vector<SharedPlace>& places, const sensor::Pinhole& image, const Rigid3& start) {
  constexpr int kIterations = 3;
  constexpr double kSigma_px = 0.5;
  Rigid3 b_from_a = start;
  for (int i = 0; i < kIterations; ++i) {
    geometry::Matrix6d normal = geometry::Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();
    for (const SharedPlace& place : places) {
      const Eigen::Vector3d y = b_from_a * place.in_a;
      if (y.z() < kNearest_m) continue;

      // Each place gives three residuals, in standard deviations: its distance along the surface's normal
      // and its two pixel coordinates.
      Eigen::Matrix<double, 3, 6> moves;
      moves << Eigen::Matrix3d::Identity(), -geometry::skew(y);
      Eigen::Matrix3d by_place;
      by_place.row(0) = place.normal_in_b.transpose() / sensor::depth_sigma(y.z());
      by_place.row(1) << image.fx / y.z(), 0.0, -image.fx * y.x() / (y.z() * y.z());
      by_place.row(2) << 0.0, image.fy / y.z(), -image.fy * y.y() / (y.z() * y.z());
      by_place.bottomRows<2>() /= kSigma_px;

      Eigen::Vector3d residual;
      residual(0) = by_place.row(0) * (y - place.in_b);
      residual.tail<2>() = (image.project(y) - image.project(place.in_b)) / kSigma_px;
      const Eigen::Matrix<double, 3, 6> jacobian = by_place * moves;
      normal += jacobian.transpose() * jacobian;
      gradient += jacobian.transpose() * residual;
    }

    b_from_a = geometry::exp_se3(-normal.ldlt().solve(gradient)) * b_from_a;
  }

  return b_from_a;
}

/// The measurements of another camera between the images of a map, which is not changed.
class NewMeasurements {
 public:
  NewMeasurements(const sensor::Recalibration& change, const maps::Map& map,
                  const std::vector<maps::FramePose>& frames)
      : change_(change), path_(maps::trajectory(frames, map)) {
    for (const KeyframeId id : map.keyframe_ids()) {
      images_[id] = image_of(map.keyframe(id).stamp, map.keyframe(id).features.get());
      samples_[id] = samples_of(map.keyframe(id));
    }
  }

  [[nodiscard]] const std::map<KeyframeId, ImageChange>& images() const { return images_; }
  [[nodiscard]] const ImageChange& image(KeyframeId id) const { return images_.at(id); }
  /// For frames that are not keyframes: their own motion corrected the rolling shutter.
  [[nodiscard]] ImageChange image_of(const maps::FramePose& frame) const {
    ImageChange image = image_of(frame.stamp, nullptr);
    image.shutter_before = change_.before().camera().readout_s.value_or(0.0) * image.velocity;
    return image;
  }
  /// Surface that a keyframe saw with the camera before.
  [[nodiscard]] const std::vector<maps::SurfaceSample>& surface(KeyframeId id) const {
    return samples_.at(id);
  }

  /// The relative pose that the new camera would have measured: places seen in both images stay aligned, in
  /// the image and along the surface's normal.
  [[nodiscard]] Rigid3 corrected(const Rigid3& b_from_a, const ImageChange& a, const ImageChange& b,
                                 const std::vector<maps::SurfaceSample>& seen_by_a) const {
    const sensor::Pinhole& image = change_.before().image();
    std::vector<SharedPlace> places;

    for (const maps::SurfaceSample& s : seen_by_a) {
      const Eigen::Vector3d p = s.point.cast<double>();
      const Eigen::Vector3d normal = s.normal.cast<double>();
      const Eigen::Vector3d q = b_from_a * p;
      if (p.z() < kNearest_m || q.z() < kNearest_m || !image.contains(image.project(q))) continue;

      const Eigen::Vector3d normal_in_b = b_from_a.rotation * normal;
      places.push_back({a.place(p, normal), b.place(q, normal_in_b), normal_in_b});
    }

    return places.size() < kLeastSamples ? b_from_a : aligned(places, image, b_from_a);
  }

  [[nodiscard]] Rigid3 corrected(const Rigid3& b_from_a, KeyframeId a, KeyframeId b) const {
    return corrected(b_from_a, images_.at(a), images_.at(b), samples_.at(a));
  }

  /// The map's own relative poses, corrected.
  [[nodiscard]] std::vector<PoseEdge> relative_poses(const maps::Map& map) const {
    std::vector<PoseEdge> edges = map_edges(map);
    for (PoseEdge& edge : edges) edge.b_from_a = corrected(edge.b_from_a, edge.a, edge.b);
    return edges;
  }

 private:
  [[nodiscard]] ImageChange image_of(double stamp, const features::FrameFeatures* features) const {
    ImageChange image;
    image.change = &change_;
    image.velocity = geometry::velocity_at(path_, stamp);
    if (features != nullptr) image.shutter_before = features->shutter_motion;
    return image;
  }

  [[nodiscard]] static std::vector<maps::SurfaceSample> samples_of(const maps::Keyframe& keyframe) {
    const std::size_t step = std::max<std::size_t>(1, keyframe.surface.size() / kSamples);
    std::vector<maps::SurfaceSample> samples;
    for (std::size_t i = 0; i < keyframe.surface.size(); i += step) samples.push_back(keyframe.surface[i]);
    return samples;
  }

  const sensor::Recalibration& change_;
  geometry::Trajectory path_;  ///< before the change
  std::map<KeyframeId, ImageChange> images_;
  std::map<KeyframeId, std::vector<maps::SurfaceSample>> samples_;  ///< surfaces before the change
};

class MapRecalibration {
 public:
  MapRecalibration(const sensor::Recalibration& change, maps::Map& map, std::vector<maps::FramePose>& frames)
      : change_(change), map_(map), frames_(frames), now_(change, map, frames) {
    for (const KeyframeId id : map.keyframe_ids()) before_[id] = map.camera_from_world(id);
  }

  void run() {
    const std::vector<PoseEdge> relative = now_.relative_poses(map_);
    correct_edges();
    correct_frames();

    recalibrate_keyframes();
    move_keyframes(relative);
    move_landmarks();
  }

 private:
  void correct_edges() {
    for (auto [number, edge] : map_.edges()) {
      edge.b_from_a = now_.corrected(edge.b_from_a, edge.a, edge.b);
      map_.replace_edge(number, edge);
    }

    std::vector<maps::LoopEdge> loops = map_.loops();
    for (maps::LoopEdge& loop : loops) loop.b_from_a = now_.corrected(loop.b_from_a, loop.a, loop.b);
    map_.set_loops(std::move(loops));
  }

  /// Corrects each frame's pose relative to its keyframe and to the frame before it.
  void correct_frames() {
    const maps::FramePose* previous = nullptr;
    Rigid3 previous_before;
    for (maps::FramePose& frame : frames_) {
      // A lost frame interrupts the chain of steps.
      if (!frame.tracked || !map_.has_keyframe(frame.reference)) {
        previous = nullptr;
        continue;
      }

      const ImageChange image = now_.image_of(frame);
      const Rigid3 before = frame.camera_from_reference;

      // Frames between keyframes store no surface: that of the previous frame's keyframe is
      // used, moved to the previous frame.
      if (frame.camera_from_previous && previous != nullptr) {
        const std::vector<maps::SurfaceSample> seen =
            tracking::transformed(now_.surface(previous->reference), previous_before);
        frame.camera_from_previous =
            now_.corrected(*frame.camera_from_previous, now_.image_of(*previous), image, seen);
      }

      if (maps::is_between_keyframes(frame, map_)) {
        frame.camera_from_reference =
            now_.corrected(before, now_.image(frame.reference), image, now_.surface(frame.reference));
      }

      previous = &frame;
      previous_before = before;
    }
  }

  void recalibrate_keyframes() {
    for (const auto& [id, image] : now_.images()) {
      auto keyframe = std::make_shared<maps::Keyframe>(map_.keyframe(id));
      if (keyframe->features != nullptr) {
        auto features = std::make_shared<features::FrameFeatures>(*keyframe->features);
        features::recalibrate(*features, change_, image.velocity, depth_rates(id, image));
        keyframe->features = std::move(features);
      }

      for (maps::SurfaceSample& sample : keyframe->surface)
        maps::recalibrate(change_, image.velocity, sample);
      if (keyframe->reference.valid() && map_.has_keyframe(keyframe->reference)) {
        keyframe->camera_from_reference =
            now_.corrected(keyframe->camera_from_reference, keyframe->reference, id);
      }

      map_.replace_keyframe(std::move(keyframe));
    }
  }

  /// Depth rate of each point feature, m/s, from the surface of the landmark that it sees.
  [[nodiscard]] std::vector<double> depth_rates(KeyframeId id, const ImageChange& image) const {
    std::vector<double> rates;
    if (change_.delay_s() == 0.0) return rates;

    const Rigid3& camera_from_world = before_.at(id);
    for (const core::PointId seen : map_.points_of(id)) {
      const maps::MapPoint* point = map_.find(seen);
      rates.push_back(point == nullptr
                          ? 0.0
                          : features::depth_rate(camera_from_world * point->position,
                                                 camera_from_world.rotation * point->normal, image.velocity));
    }
    return rates;
  }

  void move_keyframes(const std::vector<PoseEdge>& relative) {
    for (const auto& [id, pose] : solve_trusted_graph(map_, relative)) map_.set_pose(id, pose);
  }

  /// Moves a landmark to the mean of the positions at which its keyframes see it now.
  template <typename Place>
  void move_place(const std::vector<maps::Observation>& seen, const Eigen::Vector3d& normal,
                  Place& place) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (const maps::Observation& o : seen) {
      const Rigid3& before = before_.at(o.keyframe);
      const Eigen::Vector3d p = before * Eigen::Vector3d(place);
      if (p.z() < kNearest_m) continue;

      sum += map_.camera_from_world(o.keyframe).inverse() *
             now_.image(o.keyframe).place(p, before.rotation * normal);
      ++count;
    }

    if (count > 0) place = sum / count;
  }

  void move_landmarks() {
    for (const core::PointId id : map_.point_ids()) {
      maps::MapPoint& point = map_.point(id);
      move_place(point.observations, point.normal, point.position);
      map_.refresh_point(id);
    }

    for (const core::LineId id : map_.line_ids()) {
      maps::MapLine& line = map_.line(id);
      move_place(line.observations, Eigen::Vector3d::Zero(), line.start);
      move_place(line.observations, Eigen::Vector3d::Zero(), line.end);
    }
  }

  const sensor::Recalibration& change_;
  maps::Map& map_;
  std::vector<maps::FramePose>& frames_;
  NewMeasurements now_;
  std::map<KeyframeId, Rigid3> before_;  ///< poses before the change
};

}  // namespace

void recalibrate_map(const sensor::Recalibration& change, maps::Map& map,
                     std::vector<maps::FramePose>& frames) {
  MapRecalibration(change, map, frames).run();
}

KeyframePoses recalibrated_poses(const sensor::Recalibration& change, const maps::Map& map,
                                 const std::vector<maps::FramePose>& frames) {
  return solve_trusted_graph(map, NewMeasurements(change, map, frames).relative_poses(map));
}

GlobalAdjustmentSummary adjust_recalibrated_map(const sensor::Pinhole& camera, const FusionOptions& fusion,
                                                const GlobalAdjustmentOptions& adjustment, maps::Map& map) {
  for (const KeyframeId id : map.keyframe_ids()) {
    const std::vector<KeyframeId> neighbours = map.neighbours(id, static_cast<std::size_t>(fusion.keyframes));
    fuse_points(map, id, neighbours, {{id.robot, camera}}, fusion);
    fuse_lines(map, id, neighbours, {{id.robot, camera}}, fusion);
  }

  const core::KeyframeId first = map.keyframe_ids().front();
  return adjust_map(map, {{first.robot, camera}}, loop_edges(map), adjustment);
}

}  // namespace plumbline::mapping
