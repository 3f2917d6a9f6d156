// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Locates a camera in a finished map, frame by frame (docs/method/localization.md): found by place
// recognition, confirmed by the frames that follow, then tracked against the map's landmarks and surfaces.
// Nothing is added to the map.
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/localize/localization_map.hpp"
#include "plumbline/localize/place_search.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::localize {

struct LocalizerOptions {
  tracking::TrackerOptions tracker;
  PlaceSearchOptions places;
  int confirm = 5;         ///< frames in a row that must be tracked before a place is believed
  int min_features = 30;   ///< landmarks that must agree; lines count twice
  double min_found = 0.1;  ///< smallest share of those in view that agree; half of it where they are 50
  LocalizerOptions() { tracker.photometric = false; }  ///< maps keep no grey values
  void declare(core::OptionTable& table);
};

/// Outcome of one frame.
struct LocatedFrame {
  std::size_t number = 0;  ///< as it was given
  double stamp = 0.0;      ///< seconds
  bool located = false;
  std::string how;  ///< "place": found by its appearance; "tracked": from the frame before; "": not located
  std::string reason;                ///< why it is not located, for people
  geometry::Rigid3 map_from_camera;  ///< in the frame of the map's results, metres
  double sigma_position_m = 0.0;     ///< root of the trace of the covariance, relative to the map around it
  double sigma_rotation_rad = 0.0;
  core::KeyframeId keyframe;  ///< keyframe of the map near which it is
  int points = 0;             ///< landmarks that agree
  int lines = 0;
  double found = 0.0;          ///< share of the landmarks in view that agree
  double surface_share = 0.0;  ///< share of the surface in view that depth confirms
};

class Localizer {
 public:
  /// `map` outlives this. `camera`: took the images; these are rectified to camera.color.
  Localizer(const LocalizationMap& map, const sensor::Camera& camera, const LocalizerOptions& options);
  ~Localizer();

  using Features = std::shared_ptr<const features::FrameFeatures>;
  /// Frames in order of time. Returns the frames whose outcome is certain now, in order: none while a place
  /// waits for its confirmation, all of these afterwards.
  std::vector<LocatedFrame> process(std::size_t number, const sensor::RgbdFrame& frame,
                                    const Features& features);
  /// After the last frame: those that still wait; their place was never confirmed.
  std::vector<LocatedFrame> finish();

 private:
  enum class State { kSearching, kOnProbation, kLocated };
  void follow(const sensor::RgbdFrame& frame, const Features& features, LocatedFrame& result);
  void search(const sensor::RgbdFrame& frame, const Features& features, LocatedFrame& result);
  void take(const tracking::TrackResult& track, LocatedFrame& result);
  [[nodiscard]] Features without_shutter(const Features& features) const;
  [[nodiscard]] double distance_from_map(const geometry::Rigid3& camera_from_world, double depth_m) const;
  [[nodiscard]] std::string doubt(const tracking::TrackResult& track) const;
  void look_around(core::KeyframeId reference);
  void move_reference(const tracking::TrackResult& track);
  void refuse_waiting(const std::string& reason);

  const LocalizationMap& map_;
  LocalizerOptions options_;
  sensor::Pinhole camera_;
  double readout_s_;  ///< time from the first to the last row of an image; 0: all at once
  PlaceSearch places_;
  tracking::Tracker tracker_;
  tracking::Surroundings around_;
  State state_ = State::kSearching;
  std::deque<std::pair<double, geometry::Rigid3>>
      path_;                           ///< the last frames in a row: stamp, camera_from_world
  int missed_ = 0;                     ///< frames in a row that could not be tracked
  std::vector<LocatedFrame> waiting_;  ///< since the place was found that is on probation
};

}  // namespace plumbline::localize
