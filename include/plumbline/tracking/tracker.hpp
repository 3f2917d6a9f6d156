// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pose of every frame against the map: predict, hypothesise, associate, estimate from points, lines, surfaces
// and intensity together. docs/method/tracking.md; sections 3.1 and 3.2 of Xia, Wu, Ma, Zhu, Cheng, Zhu,
// "Multi-Robot Collaborative Mapping with Integrated Point-Line Features for Visual SLAM", Sensors 2024,
// 24(17), 5743. Reads a const map; the module mapping changes it.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/optimize/pose_solver.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/sensor/recalibration.hpp"
#include "plumbline/tracking/association.hpp"
#include "plumbline/tracking/local_map.hpp"
#include "plumbline/tracking/motion_model.hpp"
#include "plumbline/tracking/photometric_alignment.hpp"
#include "plumbline/tracking/relocalise.hpp"

namespace plumbline::tracking {

enum class TrackState { kInitialising, kTracked, kLost };
const char* to_string(TrackState state);

/// Why a frame has no pose. Of several poses that were tried the reason is that of the one with most support.
enum class Loss {
  kNone,           ///< it has a pose
  kFewAgree,       ///< too few features, and too little of the surface, agree with any pose
  kFreeDirection,  ///< measurements leave a direction free, and the motion model has held it for too long
  kUnlikely,       ///< after a gap the pose must fit most of what should be seen, and does not
  kNoPlace,        ///< the motion is not known any more, and no place looks like the image
  kUnconfirmed,    ///< found at a place that later frames did not confirm
  kInaccurate      ///< the pose is known to centimetres only
};
/// The text of frames.csv; "" for kNone.
const char* to_string(Loss loss);

struct TrackerOptions {
  bool points = true;
  bool lines = true;
  bool depth = true;
  bool photometric = true;
  bool align_stamps = true;
  bool thumbnails = true;    ///< search for the pose with small images
  bool motion_prior = true;  ///< the motion model holds directions that measurements leave free
  bool pnp_start = false;  ///< every frame begins with PnP, where there are matches enough (METHOD section 2)
  /// Time from the first to the last row of an image, s; 0: all at once. The shear is corrected before a
  /// frame is tracked (features::undo_rolling_shutter), by the motion model, and again by the motion that was
  /// found.
  double readout_s = 0.0;
  int min_inliers = 15;
  int min_surface = 300;
  AssociationOptions association;
  LocalMapOptions local_map;
  optimize::PoseSolverOptions solver;
  void declare(core::OptionTable& table);
};

/// Result of tracking one frame.
struct TrackResult {
  TrackState state = TrackState::kLost;
  Loss loss = Loss::kNone;
  core::KeyframeId reference;  ///< keyframe near which the camera is
  geometry::Rigid3 camera_from_world;
  geometry::Rigid3 depth_from_camera;  ///< motion between the stamps of colour and depth
  std::vector<PointMatch> points;      ///< inliers
  /// Matches that look like their landmark but lie too far from it: a wrong camera does that to right ones.
  std::vector<PointMatch> doubtful;
  std::vector<LineMatch> lines;
  std::vector<core::PointId> visible_points;  ///< landmarks that should have been seen
  std::vector<core::LineId> visible_lines;
  optimize::PoseSummary estimate;
  int surface_in_view = 0;     ///< samples of the local surface where the depth image has a measurement
  double surface_share = 0.0;  ///< share of the local surface in view that the depth image confirms
  /// Smallest eigenvalue of the information matrix of the families that are trusted, 1/m^2, rotations scaled
  /// by the scene's depth.
  double min_eigenvalue = 0.0;
  /// The frame before is tracked and no more than a step away: the motion model knew.
  bool continuous = false;
  /// Standard deviation of the motion since the frame before where it is known worst, metres; half as much in
  /// radians. After a gap nothing bears it out: a decimetre.
  [[nodiscard]] double sigma_m() const {
    return continuous ? 1.0 / std::sqrt(std::max(min_eigenvalue, 1.0)) : 0.1;
  }
  int degenerate_directions = 0;  ///< of six, that no trusted family constrains, but the motion model at best
  bool dead_reckoned = false;     ///< the motion model holds the degenerate directions, for 2.5 s at most
  /// Projects a motion (left perturbation of camera_from_world) onto the degenerate directions, or, if it is
  /// not dead reckoned, onto those that are less accurate than the length of a step.
  geometry::Matrix6d onto_degenerate = geometry::Matrix6d::Zero();
  bool motion_contradicted = false;  ///< surfaces, nearly alone, contradict the motion model
  bool relocalised = false;
  double turn_rate = 0.0;  ///< since the frame before, rad/s, where that distorts an image; 0: global shutter
  std::shared_ptr<const features::PhotometricImage> photometric;  ///< of the frame; null: none was made
  /// The frame's features without rolling shutter, points with depth at the colour image's stamp: those that
  /// were matched, and that a keyframe should keep.
  std::shared_ptr<const features::FrameFeatures> features;
};

struct TrackedImage;

/// Everything around the camera that a frame is tracked in.
struct Surroundings {
  LocalMap local_map;
  PhotometricKeyframes photometric;  ///< intensities of the latest keyframes
};

/// A camera that is lost.
struct LostCamera {
  geometry::Rigid3 camera_from_world;  ///< the last pose that was known
  int frames = 0;                      ///< lost in a row
  bool astray = false;                 ///< so many that the camera may be elsewhere by now
};

/// A frame that was found by its appearance.
struct FoundFrame {
  const sensor::RgbdFrame& frame;
  const features::FrameFeatures& features;
  core::KeyframeId keyframe;  ///< near which it was found
  const geometry::Rigid3& camera_from_world;
};

/// Helps a tracker that has lost the camera.
class Relocaliser {
 public:
  virtual ~Relocaliser() = default;
  /// Keyframes of the map that look like an image, best first; they are tried beside the tracker's own.
  [[nodiscard]] virtual std::vector<core::KeyframeId> look_alikes(
      const maps::Map& map, const features::FrameFeatures& image) const = 0;
  /// True if the image was taken where it was found, and not at a place that looks the same.
  [[nodiscard]] virtual bool is_place(const maps::Map& map, const LostCamera& lost,
                                      const FoundFrame& found) const = 0;
};

class Tracker {
 public:
  Tracker(const TrackerOptions& options, const sensor::Pinhole& camera);

  using Features = std::shared_ptr<const features::FrameFeatures>;
  /// Localises a frame in `map`. An empty map gives kInitialising. The local map moves to where a lost camera
  /// is found by its appearance, if `relocaliser` accepts that; null: always.
  TrackResult track(const maps::Map& map, Surroundings& around, const sensor::RgbdFrame& frame,
                    const Features& features, const Relocaliser* relocaliser = nullptr);

  /// The same in a map that is not empty, from the motion model alone: a frame that is not found so is lost,
  /// and not looked for by its appearance.
  TrackResult follow(const maps::Map& map, Surroundings& around, const sensor::RgbdFrame& frame,
                     const Features& features);

  /// Sets the readout time from the camera's file (sensor::Camera::readout_s), in place of the option; none:
  /// unchanged. A readout of 0 is a global shutter's.
  void set_shutter(std::optional<double> readout_s);

  /// Sets the sensors of the body that carries the camera, asked for each frame; empty: none.
  void set_motion_sensor(MotionSensor sensor) { sensor_ = std::move(sensor); }

  /// Sets the new position of the last pose, because the map has changed.
  void set_camera_from_world(const geometry::Rigid3& pose) { motion_.set_camera_from_world(pose); }

  /// The frame that was just lost was taken at `camera_from_world`, as others know: the motion model begins
  /// there. The result names no reference; the caller makes a keyframe of the frame, and that the reference.
  TrackResult begin_at(const geometry::Rigid3& camera_from_world, const sensor::RgbdFrame& frame,
                       const Features& features);

  /// Continues where another tracker stopped that had just tracked this keyframe, with this motion of
  /// camera_from_world per second.
  void restore(const maps::Keyframe& keyframe, const geometry::Rigid3& camera_from_world,
               const geometry::Vector6d& velocity);

  /// Pose of the last tracked frame, in the map as it is now.
  [[nodiscard]] const geometry::Rigid3& camera_from_world() const { return motion_.camera_from_world(); }
  /// The camera as it is after the last frame: lost, unless its `frames` are 0.
  [[nodiscard]] LostCamera lost() const {
    return {motion_.camera_from_world(), motion_.lost_frames(), motion_.outdated()};
  }
  /// The frames since `lost_frames` were lost are taken back: they are lost, too.
  void take_back(int lost_frames) { motion_.lost_since(lost_frames); }

 private:
  /// The map in which a frame is looked for.
  struct Scene {
    const maps::Map& map;
    Surroundings& around;
    const Relocaliser* relocaliser;  ///< null: none
  };
  struct PoseHypotheses {
    std::vector<geometry::Rigid3> camera_from_world;  ///< the likeliest first
    bool searched = false;  ///< the first was searched for in the image: it may be a look-alike
  };
  struct PlaceHypothesis {
    core::KeyframeId keyframe;
    geometry::Rigid3 camera_from_world;
    bool coarse = false;  ///< supported by the thumbnail only
  };

  [[nodiscard]] TrackResult initialise(const sensor::RgbdFrame& frame, const Features& features);
  [[nodiscard]] TrackResult missed(const sensor::RgbdFrame& frame, Loss loss);
  [[nodiscard]] TrackedImage image_of(const sensor::RgbdFrame& frame, const Features& features) const;
  void sense(const sensor::RgbdFrame& frame);
  /// A tracked frame, or why there is none.
  using Found = tl::expected<TrackResult, Loss>;
  /// Tracks from the predicted pose; none if no pose found there can be trusted.
  [[nodiscard]] Found track_with_motion_model(const Scene& scene, const TrackedImage& image) const;
  /// Finds the pose by the image's appearance; the local map moves there.
  [[nodiscard]] Found relocalise(const Scene& scene, const TrackedImage& image);
  /// The frame's result, lost if there is none.
  TrackResult concluded(const Scene& scene, const TrackedImage& image, Found found);
  void record(const sensor::RgbdFrame& frame, TrackResult& result);

  [[nodiscard]] PoseHypotheses pose_hypotheses(const Scene& scene, const sensor::RgbdFrame& frame,
                                               const features::FrameFeatures& features) const;
  void rank_by_intensity(const Scene& scene, const PhotometricView& view, PoseHypotheses& hypotheses) const;
  [[nodiscard]] std::vector<PlaceHypothesis> place_hypotheses(const Scene& scene,
                                                              const features::FrameFeatures& features) const;
  /// `search_radius_px`: as FrameAligner's.
  [[nodiscard]] TrackResult align(const Scene& scene, const TrackedImage& image,
                                  const geometry::Rigid3& hypothesis, double search_radius_px) const;
  [[nodiscard]] bool jumps(double stamp, const geometry::Rigid3& camera_from_world) const;
  [[nodiscard]] double support(const TrackResult& result) const;
  [[nodiscard]] bool passes_strict_check(const TrackResult& result,
                                         const features::FrameFeatures& features) const;

  /// Time from the colour image to the depth image; 0 if they are taken as of one moment.
  [[nodiscard]] double depth_delay_s(const sensor::RgbdFrame& frame) const;

  TrackerOptions options_;
  sensor::Pinhole camera_;
  bool global_shutter_ = false;  ///< known to be one
  MotionModel motion_;
  MotionSensor sensor_;
  cv::Mat thumbnail_;  ///< of the last tracked frame
  cv::Mat thumbnail_depth_;
};

/// Share of the visible surface that must be confirmed if little else supports the pose.
constexpr double kMostOfTheSurface = 0.75;

}  // namespace plumbline::tracking
