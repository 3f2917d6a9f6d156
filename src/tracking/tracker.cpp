// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/tracker.hpp"

#include "alignment/image_motion.hpp"

namespace plumbline::tracking {
namespace {

/// Features without the image pyramid, to be kept after tracking; corners at their aligned positions.
Tracker::Features without_pyramid(const features::FrameFeatures& features,
                                  const std::vector<PointMatch>& matches, const sensor::Pinhole& camera) {
  auto kept = std::make_shared<features::FrameFeatures>(features);
  kept->levels.clear();
  kept->photometric.reset();
  for (const PointMatch& m : matches) {
    if (m.aligned) kept->move_point(static_cast<std::size_t>(m.feature), m.shift);
  }
  kept->grid = features::PointGrid(kept->points, camera.width, camera.height);
  return kept;
}

}  // namespace

const char* to_string(TrackState state) {
  switch (state) {
    case TrackState::kInitialising:
      return "initialising";
    case TrackState::kTracked:
      return "tracked";
    case TrackState::kLost:
      return "lost";
  }
  return "";
}

const char* to_string(Loss loss) {
  switch (loss) {
    case Loss::kNone:
      return "";
    case Loss::kFewAgree:
      return "too few features and surfaces agree";
    case Loss::kFreeDirection:
      return "a direction is free";
    case Loss::kUnlikely:
      return "fits too little of what should be seen";
    case Loss::kNoPlace:
      return "looks like no known place";
    case Loss::kUnconfirmed:
      return "place not confirmed";
    case Loss::kInaccurate:
      return "known to centimetres only";
  }
  return "";
}

void TrackerOptions::declare(core::OptionTable& table) {
  table.boolean("depth", depth, "Align depth with the surfaces of the local map");
  table.boolean("align_stamps", align_stamps,
                "Synchronise colour and depth with different stamps by the motion model");
  table.boolean("thumbnails", thumbnails, "Search for the camera's pose with small images");
  table.boolean("motion_prior", motion_prior,
                "Constrain directions that measurements leave free by the motion model");
  table.boolean(
      "pnp_start", pnp_start,
      "Start every frame with PnP over descriptors, if there are enough, instead of the motion model");

  table.number("readout", readout_s, {0.0, 0.1}, "s",
               "Rolling shutter: time from the first to the last row of an image; 0: from the camera file");
  table.integer("min_inliers", min_inliers, {3, 1000}, "",
                "Smallest number of features that agree with a trusted pose");
  table.integer("min_surface", min_surface, {10, 100000}, "",
                "Smallest number of depth samples that agree with a pose without enough features");
  association.declare(table);
  local_map.declare(table);
  solver.declare(table);
}

Tracker::Tracker(const TrackerOptions& options, const sensor::Pinhole& camera)
    : options_(options), camera_(camera) {}

/// Passes odometry and inertial measurements of the frame to the motion model.
void Tracker::sense(const sensor::RgbdFrame& frame) {
  motion_.set_odometry(frame.odometry);
  if (sensor_) motion_.set_sensed(sensor_(motion_.last_stamp(), frame.stamp));
}

TrackResult Tracker::track(const maps::Map& map, Surroundings& around, const sensor::RgbdFrame& frame,
                           const Features& features, const Relocaliser* relocaliser) {
  sense(frame);
  if (map.keyframe_count() == 0) return initialise(frame, features);

  // A camera that has been lost for a while is looked for by its appearance first.
  const Scene scene{map, around, relocaliser};
  const TrackedImage image = image_of(frame, features);

  // After a long loss, relocalisation comes first
  const bool outdated = motion_.outdated();
  Found found = outdated ? relocalise(scene, image) : track_with_motion_model(scene, image);
  if (found) return concluded(scene, image, std::move(found));

  // The reason against the pose near by says more than that no place looks like the image
  Found other = outdated ? track_with_motion_model(scene, image) : relocalise(scene, image);
  if (other || found.error() == Loss::kNoPlace) found = std::move(other);
  return concluded(scene, image, std::move(found));
}

TrackResult Tracker::follow(const maps::Map& map, Surroundings& around, const sensor::RgbdFrame& frame,
                            const Features& features) {
  sense(frame);
  const Scene scene{map, around, nullptr};
  const TrackedImage image = image_of(frame, features);
  return concluded(scene, image, track_with_motion_model(scene, image));
}

TrackedImage Tracker::image_of(const sensor::RgbdFrame& frame, const Features& features) const {
  const geometry::Vector6d velocity = motion_.velocity_now();
  const ImageMotion motion{options_.readout_s * velocity,
                           motion_.knows_turn() ? geometry::exp_se3(velocity * depth_delay_s(frame))
                                                : motion_.motion_within(depth_delay_s(frame))};
  return {frame, features, motion, synchronised(features, frame.depth, camera_, motion)};
}

TrackResult Tracker::concluded(const Scene& scene, const TrackedImage& image, Found found) {
  TrackResult result = found ? *std::move(found) : missed(image.frame, found.error());
  if (found) {
    if (result.features == nullptr) result.features = image.synchronised;
    record(image.frame, result);
  }
  result.reference = scene.around.local_map.reference;
  return result;
}

TrackResult Tracker::initialise(const sensor::RgbdFrame& frame, const Features& features) {
  TrackResult result;
  result.state = TrackState::kInitialising;
  result.features = features;
  record(frame, result);
  return result;
}

TrackResult Tracker::missed(const sensor::RgbdFrame& frame, Loss loss) {
  TrackResult result;
  result.loss = loss;
  result.camera_from_world = motion_.predict(frame.stamp);
  motion_.lost();
  return result;
}

void Tracker::record(const sensor::RgbdFrame& frame, TrackResult& result) {
  result.continuous = motion_.reliable(frame.stamp);
  result.photometric = result.features->photometric;

  // Aligned points are moved; the pyramid is not needed any more
  result.features = without_pyramid(*result.features, result.points, camera_);
  motion_.update(frame.stamp, result);
  result.turn_rate = global_shutter_ ? 0.0 : motion_.turn_rate();
  thumbnail_ = result.features->thumbnail;
  thumbnail_depth_ = result.features->thumbnail_depth;
}

TrackResult Tracker::begin_at(const geometry::Rigid3& camera_from_world, const sensor::RgbdFrame& frame,
                              const Features& features) {
  TrackResult result;
  result.state = TrackState::kTracked;
  result.camera_from_world = camera_from_world;
  result.relocalised = true;
  result.features = features;

  // Motion does not continue from the frame before
  motion_.reset();
  record(frame, result);
  return result;
}

void Tracker::restore(const maps::Keyframe& keyframe, const geometry::Rigid3& camera_from_world,
                      const geometry::Vector6d& velocity) {
  motion_.set_camera_from_world(camera_from_world);
  if (keyframe.features == nullptr) return;

  // The next frame is aligned with this keyframe
  motion_.restore(keyframe.stamp, velocity);
  thumbnail_ = keyframe.features->thumbnail;
  thumbnail_depth_ = keyframe.features->thumbnail_depth;
}

}  // namespace plumbline::tracking
