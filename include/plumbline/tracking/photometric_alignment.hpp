// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Direct alignment with keyframes: selects those of their samples that a camera sees, and tests whether
// intensities agree.
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "plumbline/core/ids.hpp"
#include "plumbline/features/photometric.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/optimize/photometric_terms.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/recalibration.hpp"

namespace plumbline::tracking {

/// An image to align, and the depth image that came with it.
struct PhotometricView {
  const features::PhotometricImage* image = nullptr;
  const cv::Mat* depth = nullptr;  ///< CV_32FC1, metres
  geometry::Rigid3 depth_from_camera;
  sensor::Pinhole camera;  ///< of the full image
};

/// The samples of a level that the view shows from a pose: in the image, and not hidden according to its
/// depth image. None if there are fewer than kMinPhotometric. Gain and noise are those found at the pose.
std::optional<optimize::PhotometricFamily> associate_photometric(const features::PhotometricSamples& samples,
                                                                 std::size_t level,
                                                                 const PhotometricView& view,
                                                                 const geometry::Rigid3& reference_from_world,
                                                                 const geometry::Rigid3& camera_from_world);
constexpr int kMinPhotometric = 500;

/// Samples of the keyframes that were made last; those of older ones are erased, so that memory does not grow
/// with the map.
class PhotometricKeyframes {
 public:
  void add(core::KeyframeId id, std::shared_ptr<const features::PhotometricSamples> samples);
  /// Moves the samples to their positions for another camera.
  void recalibrate(const sensor::Recalibration& change);
  /// Null: not known, or erased.
  [[nodiscard]] std::shared_ptr<const features::PhotometricSamples> find(core::KeyframeId id) const;
  /// associate_photometric() with the first of `keyframes` that has enough in view.
  [[nodiscard]] std::optional<optimize::PhotometricFamily> associate(
      const maps::Map& map, const std::vector<core::KeyframeId>& keyframes, std::size_t level,
      const PhotometricView& view, const geometry::Rigid3& camera_from_world) const;

 private:
  static constexpr std::size_t kMost = 24;
  std::vector<std::pair<core::KeyframeId, std::shared_ptr<const features::PhotometricSamples>>> kept_;
};

/// Gain, noise and weights as they are at a pose; false when fewer than kMinPhotometric terms are in view.
/// A term weighs less the further an error of its depth would move it across its gradient.
bool update_photometric(optimize::PhotometricFamily& family, const geometry::Rigid3& camera_from_world);

/// True if the image is the expected one, as far as that can be determined at a pose.
bool photometric_agrees(const optimize::PhotometricFamily& family, const geometry::Rigid3& camera_from_world);

struct ShiftedPose {
  geometry::Rigid3 camera_from_world;
  double correlation = -1.0;
};
/// The pose, up to six pixels of the family's image to the side of this one, at which the image fits
/// best.
ShiftedPose search_shift(const optimize::PhotometricFamily& family,
                         const geometry::Rigid3& camera_from_world);

constexpr double kGoodAgreement = 0.8;  ///< correlation of grey values at a guess that needs no search
/// Advantage in agreement that another guess needs to be tried first.
constexpr double kBetterAgreement = 0.05;
/// Which of some hypotheses to try first, by how well grey values agree at each (correlation; none: nothing
/// that can be compared is in view from there). The first, unless another agrees better; one of which nothing
/// is known gives way to a good one only. `agreement` must not be empty.
std::size_t best_hypothesis(const std::vector<std::optional<double>>& agreement);

}  // namespace plumbline::tracking
