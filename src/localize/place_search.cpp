// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/localize/place_search.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "plumbline/mapping/loop_closing/relocalisation.hpp"

namespace plumbline::localize {

using core::KeyframeId;
using geometry::Rigid3;

namespace {

constexpr std::size_t kHits = 20;    // keyframes that are looked at
constexpr int kSamePlace = 20;       // shared landmarks
constexpr double kSamePose_m = 0.2;  // poses of one place
constexpr double kSamePose_rad = 0.2;

int evidence_of(const mapping::PlaceVerification& place) { return place.points + 2 * place.lines; }

}  // namespace

void PlaceSearchOptions::declare(core::OptionTable& table) {
  table.integer("place.candidates", candidates, {1, 20}, "", "Largest number of places that are verified");
  table.number("place.min_score", min_score, {0.0, 1.0}, "", "Smallest similarity of the images of a place");
  table.number("place.max_alternative", max_alternative, {0.0, 1.0}, "",
               "Largest share of the agreeing landmarks that may agree with another place");
  vocabulary.declare(table);
  verify.declare(table);
}

PlaceSearch::PlaceSearch(const LocalizationMap& map, const PlaceSearchOptions& options,
                         const sensor::Pinhole& camera)
    : map_(map), options_(options), camera_(camera), database_(places::Vocabulary(options.vocabulary)) {
  for (const KeyframeId id : map.map.keyframe_ids()) {
    if (map.map.keyframe(id).features != nullptr) database_.add(id, map.map.keyframe(id).features);
  }
}

maps::Map PlaceSearch::image_of(const sensor::RgbdFrame& frame, const Features& features) const {
  return mapping::image_map(frame, features, camera_, {});
}

mapping::PlaceVerification PlaceSearch::verify(const maps::Map& image, KeyframeId match) const {
  const sensor::Pinhole theirs = maps::camera_of(map_.robots, match.robot).color;
  return mapping::verify_place({&image, image.keyframe_ids().front(), camera_}, {&map_.map, match, theirs},
                               options_.verify, options_.seed);
}

/// The place that the image shows: candidates by appearance, verified by geometry, refused if ambiguous.
PlaceAnswer PlaceSearch::find(const sensor::RgbdFrame& frame, const Features& features) const {
  PlaceAnswer answer;
  const std::vector<places::Hit> hits = database_.query(*features).best(kHits, {});
  const maps::Map image = image_of(frame, features);
  std::vector<KeyframeId> tried;
  int best = 0;
  int alternative = 0;

  // Candidates of a place that has been tried add nothing
  for (const places::Hit& hit : hits) {
    if (hit.score < options_.min_score || static_cast<int>(tried.size()) >= options_.candidates) break;
    const auto same = [&](KeyframeId id) { return map_.map.shared(id, hit.keyframe) >= kSamePlace; };
    if (best > 0 && std::any_of(tried.begin(), tried.end(), same)) continue;
    tried.push_back(hit.keyframe);

    // Geometry must confirm the similar appearance
    const mapping::PlaceVerification place = verify(image, hit.keyframe);
    if (!place.accepted) {
      if (answer.reason.empty()) answer.reason = "looks like a place, but " + place.refused;
      continue;
    }

    // Two accepted poses far apart are alternatives
    const Rigid3 pose = place.query_from_match * map_.map.camera_from_world(hit.keyframe);
    if (answer.keyframe && mapping::is_near(pose, answer.camera_from_world, kSamePose_m, kSamePose_rad))
      continue;
    alternative = std::max(alternative, std::min(best, evidence_of(place)));
    if (evidence_of(place) <= best) continue;
    best = evidence_of(place);
    answer.keyframe = hit.keyframe;
    answer.camera_from_world = pose;
  }

  // A place that is not clearly better is refused
  if (tried.empty()) answer.reason = "looks like no place of the map";
  if (!answer.keyframe || alternative <= options_.max_alternative * best) return answer;
  answer.keyframe.reset();
  answer.reason = "two places of the map look like it";
  return answer;
}

bool PlaceSearch::confirms(const sensor::RgbdFrame& frame, const Features& features, KeyframeId keyframe,
                           const Rigid3& camera_from_world) const {
  const mapping::PlaceVerification place = verify(image_of(frame, features), keyframe);
  return place.accepted &&
         mapping::is_near(camera_from_world, place.query_from_match * map_.map.camera_from_world(keyframe),
                          0.1, 0.05);
}

}  // namespace plumbline::localize
