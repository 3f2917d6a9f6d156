// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The pose of one frame from one hypothesis, coarse to fine (docs/method/tracking.md; the paper's
// section 3.2).
#include <memory>
#include <optional>

#include "alignment/image_motion.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {

/// Everything that a frame is aligned with.
struct AlignmentInput {
  const TrackerOptions& options;
  const sensor::Pinhole& camera;
  const maps::Map& map;
  const Surroundings& around;
  const MotionModel& motion;
  const TrackedImage& image;
  double depth_delay_s = 0.0;  ///< of the depth image after the colour image's stamp
};

struct AlignmentRound {
  double search_radius_px;  ///< of features around their projection; 0: the hypothesis's
  double max_plane_distance_m;
  int surface_samples;
  std::size_t pyramid_level;  ///< of intensity
  bool rematch;
  bool reject_outliers;
};

constexpr double kFineRadius_px = 6.0;  ///< of the search once the pose is roughly known

/// For one run.
class FrameAligner {
 public:
  /// `search_radius_px`: around the hypothesis, of the first round; 0: the fine rounds alone.
  FrameAligner(const AlignmentInput& input, const geometry::Rigid3& hypothesis, double search_radius_px);
  TrackResult run();

 private:
  void align(const AlignmentRound& round);
  void align_finely();
  bool correct_image_motion();
  void match_landmarks(const AlignmentRound& round);
  void associate_surface(const AlignmentRound& round);
  void associate_intensity(const AlignmentRound& round);
  void solve();
  void constrain_degenerate_directions();
  void reject_outliers();
  [[nodiscard]] bool contradicts_motion_prior();
  [[nodiscard]] geometry::Matrix6d trusted_information(bool by_features, bool by_surface);
  void judge();
  [[nodiscard]] const sensor::RgbdFrame& frame() const { return in_.image.frame; }
  [[nodiscard]] const features::FrameFeatures& features() const {
    return result_.features != nullptr ? *result_.features : *in_.image.synchronised;
  }
  [[nodiscard]] bool uses_features() const {
    return features().extracted() && (in_.options.points || in_.options.lines);
  }
  [[nodiscard]] int feature_inliers() const;

  const AlignmentInput& in_;
  double search_radius_px_;
  geometry::Rigid3 predicted_;
  ImageMotion motion_;  ///< with which the features were synchronised
  optimize::PoseProblem problem_;
  TrackResult result_;  ///< its camera_from_world is the estimate so far; features: where they were corrected
  std::optional<std::size_t> intensity_level_;  ///< pyramid level of problem_.photometric
  bool use_motion_prior_;
  bool surface_only_ = false;  ///< only surfaces constrain the pose
};

}  // namespace plumbline::tracking
