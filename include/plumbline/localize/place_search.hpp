// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The place in a finished map where one image was taken: place recognition over the keyframes of all robots,
// verified as loops are (docs/method/localization.md).
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/localize/localization_map.hpp"
#include "plumbline/mapping/loop_closing/place_verification.hpp"
#include "plumbline/places/database.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/tracking/surface_sampler.hpp"

namespace plumbline::localize {

struct PlaceSearchOptions {
  int candidates = 4;            ///< places that are verified, at most
  double min_score = 0.015;      ///< least similarity of the images
  double max_alternative = 0.5;  ///< largest share of the evidence that a second place may have
  std::uint64_t seed = 1;
  places::VocabularyOptions vocabulary;
  mapping::VerificationOptions verify;
  PlaceSearchOptions() { verify.rounds = 200; }
  void declare(core::OptionTable& table);
};

/// Answer for one image.
struct PlaceAnswer {
  std::optional<core::KeyframeId> keyframe;  ///< keyframe that shows the place; none: it was not found
  geometry::Rigid3 camera_from_world;        ///< in the map's own frame
  std::string reason;                        ///< why not found, for people
};

class PlaceSearch {
 public:
  /// `map` outlives this. Learns the words of all keyframes: some milliseconds each.
  PlaceSearch(const LocalizationMap& map, const PlaceSearchOptions& options, const sensor::Pinhole& camera);

  using Features = std::shared_ptr<const features::FrameFeatures>;
  /// Two places that fit about as well are none.
  [[nodiscard]] PlaceAnswer find(const sensor::RgbdFrame& frame, const Features& features) const;
  /// True if the image passes as one of the place of `keyframe`, seen from about `camera_from_world`.
  [[nodiscard]] bool confirms(const sensor::RgbdFrame& frame, const Features& features,
                              core::KeyframeId keyframe, const geometry::Rigid3& camera_from_world) const;

 private:
  [[nodiscard]] mapping::PlaceVerification verify(const maps::Map& image, core::KeyframeId match) const;
  [[nodiscard]] maps::Map image_of(const sensor::RgbdFrame& frame, const Features& features) const;

  const LocalizationMap& map_;
  PlaceSearchOptions options_;
  sensor::Pinhole camera_;
  places::Database database_;
};

}  // namespace plumbline::localize
