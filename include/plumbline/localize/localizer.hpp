// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Locates a camera in a finished map, frame by frame (docs/method/localization.md): found by place
// recognition, confirmed by the frames that follow, then tracked against the map's landmarks and surfaces.
// Nothing is added to the map.
#include <memory>
#include <string>
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
  int confirm = 5;        ///< frames in a row that must be tracked before a place is believed
  int min_features = 20;  ///< points, and lines twice, that must agree where a tenth of the view shows some
  double min_found = 0.1;
  LocalizerOptions() { tracker.photometric = false; }  ///< maps keep no grey values
  void declare(core::OptionTable& table);
};

/// Outcome of one frame.
struct LocatedFrame {
  std::size_t number = 0;  ///< as it was given
  double stamp = 0.0;      ///< seconds
  bool located = false;
  std::string how;     ///< "place": found by its appearance; "tracked": from the frame before; "": not located
  std::string reason;  ///< why it is not located, for people
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
  void take(const tracking::TrackResult& track, LocatedFrame& result) const;
  [[nodiscard]] std::string doubt(const tracking::TrackResult& track) const;
  void move_reference(const tracking::TrackResult& track);
  void refuse_waiting(const std::string& reason);

  const LocalizationMap& map_;
  LocalizerOptions options_;
  sensor::Pinhole camera_;
  PlaceSearch places_;
  tracking::Tracker tracker_;
  State state_ = State::kSearching;
  int missed_ = 0;                     ///< frames in a row that could not be tracked
  std::vector<LocatedFrame> waiting_;  ///< since the place was found that is on probation
};

}  // namespace plumbline::localize
