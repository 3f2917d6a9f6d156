// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pose of every frame against the map: predict, guess, associate, estimate points, lines and depth together
// (METHOD sections 1 and 2). Sees a const map; what changes the map is in mapping.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/optimize/pose_solver.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/tracking/association.hpp"
#include "plumbline/tracking/local_map.hpp"
#include "plumbline/tracking/photometric_alignment.hpp"
#include "plumbline/tracking/relocalise.hpp"

namespace plumbline::tracking {

enum class TrackState { kInitialising, kTracked, kLost };
const char* to_string(TrackState state);

struct TrackerOptions {
  bool points = true;
  bool lines = true;
  bool depth = true;
  bool photometric = true;
  bool align_stamps = true;
  bool thumbnails = true;    ///< small pictures tell where the camera may be
  bool motion_prior = true;  ///< the motion model holds what measurements leave open
  bool pnp_start = false;  ///< every frame begins with PnP, where there are matches enough (METHOD section 2)
  /// Time from the first to the last row of a picture, s; 0: all at once. What it shears is put right before
  /// a frame is tracked (features::undo_rolling_shutter), with the motion model's turn, and again with the
  /// turn that was found where that differs.
  double readout_s = 0.0;
  int min_inliers = 15;
  int min_surface = 300;
  AssociationOptions association;
  LocalMapOptions local_map;
  optimize::PoseSolverOptions solver;
  void declare(core::OptionTable& table);
};

/// What the tracker found out about one frame.
struct TrackResult {
  TrackState state = TrackState::kLost;
  geometry::Rigid3 camera_from_world;
  geometry::Rigid3 depth_from_camera;  ///< motion between the stamps of colour and depth
  std::vector<PointMatch> points;      ///< inliers
  std::vector<LineMatch> lines;
  std::vector<core::PointId> visible_points;  ///< landmarks that should have been seen
  std::vector<core::LineId> visible_lines;
  optimize::PoseSummary estimate;
  int surface_in_view = 0;     ///< samples of the local surface where the depth image has a measurement
  double surface_share = 0.0;  ///< share of the local surface in view that the depth image confirms
  /// Of the information matrix of the families that are trusted, 1/m^2, rotations scaled by the scene's
  /// depth.
  double min_eigenvalue = 0.0;
  bool continuous =
      false;  ///< the frame before is tracked and no more than a step away: the motion model knew
  /// Standard deviation of the motion since the frame before where it is known worst, metres; half as much in
  /// radians. After a gap nothing bears it out: a decimetre.
  [[nodiscard]] double sigma_m() const {
    return continuous ? 1.0 / std::sqrt(std::max(min_eigenvalue, 1.0)) : 0.1;
  }
  int weak_directions = 0;      ///< of six, that no trusted family holds, but the motion model at best
  bool held_by_motion = false;  ///< the weak directions are the motion model's, for 2.5 s at most
  /// What these directions have of a motion (left perturbation of camera_from_world), to multiply it with;
  /// zero unless held_by_motion.
  geometry::Matrix6d unheld = geometry::Matrix6d::Zero();
  bool motion_refuted = false;  ///< surfaces are all but alone, and have spoken against the motion model
  bool relocalised = false;
  std::shared_ptr<const features::PhotometricImage> photometric;  ///< of the frame; null: none was made
  /// The frame's features, freed of the rolling shutter, points with the depth of the colour image's stamp:
  /// what was matched, and what a keyframe should keep.
  std::shared_ptr<const features::FrameFeatures> features;
};

class Tracker {
 public:
  Tracker(const TrackerOptions& options, const sensor::Pinhole& camera);

  using Features = std::shared_ptr<const features::FrameFeatures>;
  /// The frame is localised against `map`; `reference` is the keyframe whose surroundings are expected in
  /// view. An empty map gives kInitialising.
  TrackResult track(const maps::Map& map, const sensor::RgbdFrame& frame, const Features& features);

  /// Replaces the option; before the first frame.
  void set_readout(double readout_s) { options_.readout_s = readout_s; }

  /// The map has changed (keyframe added, poses corrected). `corrected_from_old`: where the last pose went.
  void map_changed(const maps::Map& map, core::KeyframeId reference,
                   const geometry::Rigid3& last_camera_from_world);

  /// A keyframe's samples, for direct alignment of what comes next.
  void add_photometric(core::KeyframeId id, std::shared_ptr<const features::PhotometricSamples> samples) {
    photometric_.add(id, std::move(samples));
  }
  [[nodiscard]] const PhotometricKeyframes& photometric() const { return photometric_; }

  /// Goes on where another tracker left `map`: it had just tracked the keyframe `reference` at
  /// `camera_from_world`, with this motion of camera_from_world per second.
  void restore(const maps::Map& map, core::KeyframeId reference, const geometry::Rigid3& camera_from_world,
               const geometry::Vector6d& velocity);

  /// Who knows which keyframes of the map look like a picture, best first. Asked when tracking is lost,
  /// beside what the tracker finds by itself.
  using PlaceFinder = std::function<std::vector<core::KeyframeId>(const features::FrameFeatures&)>;
  void set_place_finder(PlaceFinder finder) { find_places_ = std::move(finder); }

  /// Who can tell whether a pose that was found by looks, near `keyframe`, is where the picture was taken and
  /// not a place that looks the same. Asked before such a pose is believed; without one it is believed.
  using PlaceJudge =
      std::function<bool(const sensor::RgbdFrame&, const features::FrameFeatures&, core::KeyframeId keyframe,
                         const geometry::Rigid3& camera_from_world)>;
  void set_place_judge(PlaceJudge judge) { is_place_ = std::move(judge); }

  /// How the camera turned between the last two frames, rad/s in its frame:
  /// camera_from_world(t + dt) = Exp(turning dt) camera_from_world(t). Zero when that is not known.
  [[nodiscard]] Eigen::Vector3d turning() const {
    return last_.valid && lost_frames_ == 0 ? Eigen::Vector3d(velocity_.tail<3>()) : Eigen::Vector3d::Zero();
  }
  /// How fast the camera turned between the last two frames, rad/s.
  [[nodiscard]] double turn_rate() const { return velocity_.tail<3>().norm(); }
  [[nodiscard]] core::KeyframeId reference() const { return local_map_.reference; }
  [[nodiscard]] const LocalMap& local_map() const { return local_map_; }

 private:
  static constexpr double kFineRadius_px =
      6.0;  ///< of the search for features once the pose is roughly known
  struct Last {
    double stamp = 0.0;
    geometry::Rigid3 camera_from_world;
    cv::Mat thumbnail;
    cv::Mat thumbnail_depth;
    bool valid = false;
  };
  /// Where the camera may be; `rough`: only the small picture says so.
  struct Guess {
    core::KeyframeId keyframe;
    geometry::Rigid3 camera_from_world;
    bool rough = false;
  };

  [[nodiscard]] geometry::Rigid3 predict(double stamp) const;
  /// Whether the motion model can tell where the camera is: not after frames that are missing.
  [[nodiscard]] bool knows_motion(double stamp) const {
    constexpr double kLonger = 1.5;
    return last_.valid && lost_frames_ == 0 && steps_ >= 2 && stamp - last_.stamp < kLonger * step_s_;
  }
  void stand() {
    velocity_.setZero();
    steps_ = 0;
  }
  /// Where the camera may be by now, the likeliest first.
  struct Guesses {
    std::vector<geometry::Rigid3> poses;
    bool sought = false;  ///< the first was looked for in the picture: it may be a look-alike
  };
  [[nodiscard]] Guesses guesses(const maps::Map& map, const sensor::RgbdFrame& frame,
                                const features::FrameFeatures& features) const;
  void put_likeliest_first(const maps::Map& map, const PhotometricView& view, Guesses& guesses) const;
  [[nodiscard]] double evidence(const TrackResult& result) const;
  /// `radius`: px around the guess in which features are looked for at first; 0: the fine rounds alone.
  [[nodiscard]] TrackResult estimate(const maps::Map& map, const sensor::RgbdFrame& frame,
                                     const features::FrameFeatures& features, const geometry::Rigid3& guess,
                                     double radius) const;
  [[nodiscard]] bool leaps(double stamp, const geometry::Rigid3& camera_from_world) const;
  /// From where the camera should be by now; none when nothing there can be trusted.
  [[nodiscard]] std::optional<TrackResult> by_motion(const maps::Map& map, const sensor::RgbdFrame& frame,
                                                     const features::FrameFeatures& features) const;
  [[nodiscard]] std::vector<Guess> guesses_by_picture(const maps::Map& map,
                                                      const features::FrameFeatures& features) const;
  /// From what the picture looks like; the local map moves there.
  [[nodiscard]] std::optional<TrackResult> by_picture(const maps::Map& map, const sensor::RgbdFrame& frame,
                                                      const features::FrameFeatures& features);
  [[nodiscard]] geometry::Rigid3 depth_from_camera(const sensor::RgbdFrame& frame) const;
  [[nodiscard]] bool uses_features() const { return options_.points || options_.lines; }
  /// After a while without a pose the last one says little: surfaces near it fit by chance.
  [[nodiscard]] bool stale() const {
    constexpr int kStaleFrames = 5;
    return lost_frames_ >= kStaleFrames;
  }
  [[nodiscard]] bool beyond_doubt(const TrackResult& result) const;
  [[nodiscard]] Features at_one_moment(const sensor::RgbdFrame& frame, const Features& features,
                                       const Eigen::Vector3d& turn_rate) const;
  void settle_shutter(const maps::Map& map, const sensor::RgbdFrame& frame, const Features& features,
                      TrackResult& found) const;
  [[nodiscard]] bool refutes_motion(optimize::PoseProblem problem, const optimize::PoseSummary& held,
                                    const geometry::Rigid3& predicted, geometry::Rigid3& pose) const;
  void judge(optimize::PoseProblem problem, TrackResult& result) const;
  [[nodiscard]] std::optional<optimize::PhotometricFamily> photometric_family(
      const maps::Map& map, const PhotometricView& view, std::size_t level,
      const geometry::Rigid3& camera_from_world) const;
  void remember(const sensor::RgbdFrame& frame, const features::FrameFeatures& features,
                const TrackResult& result);

  TrackerOptions options_;
  sensor::Pinhole camera_;
  LocalMap local_map_;
  PhotometricKeyframes photometric_;
  PlaceFinder find_places_;
  PlaceJudge is_place_;
  Last last_;
  geometry::Vector6d velocity_ = geometry::Vector6d::Zero();  ///< of camera_from_world, per second
  int steps_ = 0;        ///< between frames, one after the other, that it was found from
  double step_s_ = 0.0;  ///< how long the last one was
  int lost_frames_ = 0;
  double coasting_s_ = 0.0;      ///< how long the motion model has held what nothing else does
  bool motion_refuted_ = false;  ///< by what is seen, since surfaces have been all but alone
};

}  // namespace plumbline::tracking
