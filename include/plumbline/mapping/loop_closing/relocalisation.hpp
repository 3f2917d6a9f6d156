// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Check that a lost camera really is where it was found by appearance.
#include <memory>
#include <optional>
#include <utility>

#include "plumbline/mapping/slam_options.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/tracking/surface_sampler.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::mapping {

/// A map of one single frame, as keyframe 0 of `robot` in the origin; for verifying places.
maps::Map image_map(const sensor::RgbdFrame& frame, std::shared_ptr<const features::FrameFeatures> features,
                    const sensor::Pinhole& camera, const tracking::SurfaceSamplerOptions& surface);

/// True if two cameras (camera_from_world) lie within `most_m` metres and are turned by less than `most_rad`.
inline bool is_near(const geometry::Rigid3& a, const geometry::Rigid3& b, double most_m, double most_rad) {
  return (a.inverse().translation - b.inverse().translation).norm() < most_m &&
         geometry::rotation_angle(a.rotation * b.rotation.transpose()) < most_rad;
}

/// Finds places for a lost camera and decides whether it is there. A camera that turns up far from where it
/// was lost, or after several frames, must pass as a loop would: corridors look alike from both ends. Near by
/// there is nothing to confuse. After a longer loss it is on probation for some frames, which have no pose.
class Relocalisation : public tracking::Relocaliser {
 public:
  /// Options and loops must outlive this.
  Relocalisation(const SlamOptions& options, const sensor::Pinhole& camera, const LoopCloser& loops)
      : options_(options), camera_(camera), loops_(loops) {}

  [[nodiscard]] std::vector<core::KeyframeId> look_alikes(
      const maps::Map& map, const features::FrameFeatures& image) const override {
    return loops_.look_alikes(map, image, kLookAlikes);
  }
  [[nodiscard]] bool is_place(const maps::Map& map, const tracking::LostCamera& lost,
                              const tracking::FoundFrame& found) const override;

  /// Puts a camera that was found after `lost_before` lost frames on probation: `track` is lost until
  /// surfaces around it confirm its place several frames in a row, during which no keyframe changes the map.
  /// Returns the number of frames since the loss if they do not: the camera was never found.
  std::optional<int> judge(const maps::Map& map, const sensor::RgbdFrame& frame,
                           const features::FrameFeatures& features, int lost_before,
                           tracking::TrackResult& track);
  /// True once after each time that the camera was found again.
  [[nodiscard]] bool take_found_again() { return std::exchange(found_again_, false); }

 private:
  static constexpr std::size_t kLookAlikes = 12;
  struct Probation {
    int lost_before = 0;  ///< frames in a row
    int frames = 0;       ///< since it was found
  };
  [[nodiscard]] bool verified(const maps::Map& map, const tracking::FoundFrame& found) const;

  const SlamOptions& options_;
  sensor::Pinhole camera_;
  const LoopCloser& loops_;
  std::optional<Probation> probation_;
  bool found_again_ = false;  ///< and no keyframe made since
};

}  // namespace plumbline::mapping
