// SPDX-License-Identifier: BSD-3-Clause
#include "robots/robot_merge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "robots/robot_components.hpp"

namespace plumbline::pipeline {
namespace {

std::vector<mapping::MapPart> maps_of(const std::vector<RobotMap>& parts) {
  std::vector<mapping::MapPart> maps;
  for (const RobotMap& part : parts) {
    mapping::MapPart& map = maps.emplace_back();
    map.map = part.map.get();
    for (const RobotInfo& robot : part.robots) map.cameras[robot.number] = robot.camera.color;
  }
  return maps;
}

/// The first part of the group that has most keyframes.
std::size_t largest_group(const std::vector<RobotMap>& parts, const std::vector<std::size_t>& group) {
  std::vector<std::size_t> keyframes(parts.size(), 0);
  for (std::size_t p = 0; p < parts.size(); ++p) keyframes[group[p]] += parts[p].map->keyframe_count();
  return static_cast<std::size_t>(std::max_element(keyframes.begin(), keyframes.end()) - keyframes.begin());
}

using PartPair = std::pair<std::size_t, std::size_t>;

/// True if both put b's cameras at the same place, but for the drift of a robot's path.
bool agree(const mapping::Alignment& places, const mapping::Alignment& rig, const maps::Map& b) {
  constexpr double kApart_m = 0.5, kTurned_rad = 0.2;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  const std::vector<core::KeyframeId> ids = b.keyframe_ids();
  for (const core::KeyframeId id : ids)
    middle += b.camera_from_world(id).inverse().translation / static_cast<double>(ids.size());
  return (places.a_from_b * middle - rig.a_from_b * middle).norm() < kApart_m &&
         geometry::rotation_angle(places.a_from_b.rotation.transpose() * rig.a_from_b.rotation) < kTurned_rad;
}

/// Puts known merges into the evidence; returns the pairs of parts that a rig joins.
std::set<PartPair> put_in(const std::vector<KnownMerge>& known, const std::vector<RobotMap>& parts,
                          std::vector<mapping::MergeEvidence>& evidence, core::Log& log) {
  std::set<PartPair> by_rig;
  for (const KnownMerge& one : known) {
    const mapping::MergeEvidence& merge = one.evidence;
    const auto found = std::find_if(evidence.begin(), evidence.end(), [&](const mapping::MergeEvidence& e) {
      return e.a == merge.a && e.b == merge.b;
    });
    if (found == evidence.end()) continue;

    // Things that one camera sees later than the other tie them beyond the rig, unless it is another place.
    std::vector<mapping::VerifiedPair> seen;
    const bool again = one.by == KnownMerge::By::kRig && found->accepted;
    if (again && agree(found->alignment, merge.alignment, *parts[merge.b].map)) {
      seen = found->pairs;
    } else if (again) {
      log.info(fmt::format("{} and {}: places that look alike contradict the rig and are not used",
                           parts[merge.a].name, parts[merge.b].name));
    }

    *found = merge;
    found->pairs.insert(found->pairs.end(), seen.begin(), seen.end());
    if (one.by == KnownMerge::By::kRig) by_rig.emplace(merge.a, merge.b);
  }
  return by_rig;
}

void report(const RobotMerge& merge, core::Log& log) {
  const mapping::MergeEvidence& e = merge.evidence;
  if (merge.by_rig && e.accepted) {
    log.info(fmt::format("{} and {} are cameras of one rig: {} pairs of keyframes, {} rejected", merge.a,
                         merge.b, e.pairs.size(), e.rejected));
    return;
  }
  const std::string tried =
      fmt::format("{} pairs of keyframes look alike, {} were tried, {} show the same place", e.candidates,
                  e.tried, e.consistency.verified);
  if (e.accepted) {
    log.info(fmt::format("{} and {} overlap: {}; {} keyframes agree to {:.0f} mm ({} points and lines)",
                         merge.a, merge.b, tried, e.consistency.agreeing, 1e3 * e.alignment.spread_m,
                         e.totals().inliers));
  } else {
    log.info(fmt::format("{} and {} are not merged: {}: {}", merge.a, merge.b, e.refused, tried));
  }
}

std::string left_out(const std::vector<RobotMap>& parts, const std::vector<std::size_t>& used,
                     const std::vector<RobotMerge>& merges) {
  // Robots are named once, and those of which a component was used are not left out.
  std::string names;
  std::set<std::int32_t> known;

  for (const std::size_t p : used) {
    for (const RobotInfo& robot : parts[p].robots) known.insert(robot.number);
  }

  for (const RobotMap& part : parts) {
    if (known.insert(part.robots.front().number).second) names += (names.empty() ? "" : ", ") + part.name;
  }

  if (names.empty()) return {};
  std::string text = fmt::format("{} of {} maps do not connect and are left out: {}",
                                 parts.size() - used.size(), parts.size(), names);

  for (const RobotMerge& merge : merges) {
    const mapping::MergeEvidence& e = merge.evidence;
    if (e.accepted) continue;
    text += fmt::format("; {} with {}: {} ({} look-alikes, {} tried, {} verified)", merge.b, merge.a,
                        e.refused, e.candidates, e.tried, e.consistency.verified);
  }

  return text;
}

/// Components that are not connected with any other.
std::vector<std::shared_ptr<const MapResult>> components_apart(const std::vector<RobotMap>& parts,
                                                               const std::vector<std::size_t>& used) {
  std::vector<std::shared_ptr<const MapResult>> apart;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (!parts[p].component || std::binary_search(used.begin(), used.end(), p)) continue;
    auto map = std::make_shared<MapResult>();
    map->name = parts[p].name;
    map->map = parts[p].map;
    map->robots = parts[p].robots;
    map->frame_poses = parts[p].frame_poses;
    take_poses_from_map(*map);
    apart.push_back(std::move(map));
  }
  return apart;
}

Json overlay_section(const mapping::OverlayFit& fit) {
  return {{"expected", fit.expected},
          {"matched", fit.matched},
          {"chance", rounded(fit.chance)},
          {"seen_through", fit.contradicted},
          {"log_odds", rounded(fit.log_odds)}};
}

/// Adds standard deviations, the whole covariance, and the relative pose of the maps.
void add_alignment(const mapping::Alignment& alignment, Json& entry) {
  Json sigma = Json::array();
  Json covariance = Json::array();
  for (int row = 0; row < 6; ++row) {
    sigma.push_back(rounded(std::sqrt(alignment.covariance(row, row))));
    Json line = Json::array();
    for (int column = 0; column < 6; ++column) line.push_back(alignment.covariance(row, column));
    covariance.push_back(line);
  }
  entry["sigma"] = sigma;
  entry["covariance"] = covariance;
  entry["a_from_b"] = rows(alignment.a_from_b);
}

}  // namespace

Json section_of(const RobotMerge& merge) {
  const mapping::MergeEvidence& e = merge.evidence;
  const mapping::PairTotals totals = e.totals();
  Json refused = Json::object();

  for (const auto& [why, count] : e.refused_pairs) refused[why] = count;

  Json entry = {{"a", merge.a},
                {"b", merge.b},
                {"accepted", e.accepted},
                {"reason", e.refused},
                {"candidates", e.candidates},
                {"tried", e.tried},
                {"verified", e.consistency.verified},
                {"refused", refused},
                {"agreeing", e.consistency.agreeing},
                {"alternative", e.ambiguity.alternative},
                {"overlay", overlay_section(e.ambiguity.overlap)},
                {"log_odds_like", rounded(e.ambiguity.against_like + e.validation.against_like)},
                {"expected", e.validation.expected},
                {"confirmed", e.validation.confirmed},
                {"pairs", e.pairs.size()},
                {"rejected", e.rejected},
                {"matches", totals.matches},
                {"inliers", totals.inliers},
                {"rms", rounded(totals.rms_px)},
                {"overlap", rounded(totals.overlap)},
                {"span_m", rounded(e.consistency.span_m)},
                {"span_rad", rounded(e.consistency.span_rad)},
                {"spread_m", rounded(e.alignment.spread_m)}};

  // A second alignment that fits nearly as well shows how ambiguous the place is.
  if (e.ambiguity.alternative_m > 0.0) {
    entry["alternative_m"] = rounded(e.ambiguity.alternative_m);
    entry["alternative_overlay"] = overlay_section(e.ambiguity.alternative_overlap);
  }

  // A refused merge has no relative pose; a negative time is not known, or the merge came after mapping.
  if (e.accepted) add_alignment(e.alignment, entry);
  if (merge.by_rig) entry["by"] = "rig";
  if (merge.time_s >= 0.0) entry["time_s"] = rounded(merge.time_s);
  if (merge.evident_s >= 0.0) entry["evident_s"] = rounded(merge.evident_s);
  return entry;
}

MergedRobots merge_robots(const std::vector<RobotMap>& parts, std::size_t anchor,
                          const mapping::MapFusionOptions& options, const core::Executor& executor,
                          core::Log& log, const std::vector<KnownMerge>& known) {
  const std::vector<mapping::MapPart> maps = maps_of(parts);
  mapping::OverlapFinder places = mapping::learn_places(maps, options);
  std::vector<mapping::MergeEvidence> evidence =
      mapping::find_overlaps(maps, places.look_at_all(maps, executor), options, executor);

  // Merges that are known from elsewhere replace the comparison of their maps, which may have been refused
  // for too little overlap.
  const auto by_rig = put_in(known, parts, evidence, log);
  if (anchor >= parts.size()) {
    anchor = largest_group(parts, mapping::connected_parts(parts.size(), evidence));
  }

  mapping::FusedMap fused = mapping::fuse_maps(maps, evidence, anchor, options);

  // Evidence is reported after the fusion, whose pose graph may have rejected a merge that was accepted.
  MergedRobots result;
  for (mapping::MergeEvidence& merge : evidence) {
    const std::string& a = parts[merge.a].name;
    const std::string& b = parts[merge.b].name;
    const bool rigid = by_rig.count({merge.a, merge.b}) != 0;
    result.merges.push_back({a, b, -1.0, -1.0, std::move(merge), rigid});
    report(result.merges.back(), log);
  }

  result.unconnected = left_out(parts, fused.parts, result.merges);
  auto map = std::make_shared<MapResult>();
  map->map = std::make_shared<maps::Map>(std::move(fused.map));

  // Components of one robot are parts of their own; the robot is listed once.
  std::vector<const RobotMap*> used;
  for (const std::size_t p : fused.parts) {
    used.push_back(&parts[p]);
    for (const RobotInfo& robot : parts[p].robots) {
      const auto same = [&](const RobotInfo& other) { return other.number == robot.number; };
      if (std::none_of(map->robots.begin(), map->robots.end(), same)) map->robots.push_back(robot);
    }
  }

  map->frame_poses = frames_of(used);
  take_poses_from_map(*map);
  map->apart = components_apart(parts, fused.parts);
  log.debug(
      fmt::format("fused {} maps: {} pairs of keyframes, {} rejected; {} points and {} lines were duplicates",
                  fused.parts.size(), fused.edges, fused.rejected, fused.merged_points, fused.merged_lines));

  result.refused = static_cast<std::size_t>(fused.refused);
  if (fused.refused > 0)
    log.warning("merge: maps are moved into one frame, but not deformed: " + fused.refusal);
  result.map = map;
  return result;
}

std::shared_ptr<MapResult> kept_map(const std::vector<RobotMap>& parts, const maps::FusionState& state) {
  auto kept = std::make_shared<MapResult>();
  kept->map = parts.front().map;
  kept->robots = parts.front().robots;
  kept->frame_poses = parts.front().frame_poses;
  take_poses_from_map(*kept);
  kept->apart = components_apart(parts, {0});

  // Poses are not estimated again, so their accuracy is that of the run that made the map.
  if (state.covariances.empty()) {
    kept->accuracy.missing = "the map was made without refine";
    return kept;
  }

  // The lists of keyframes and of their accuracies correspond: NaN stands for a covariance that is not known.
  for (const maps::KeyframePose& keyframe : kept->keyframes) {
    const auto known = state.covariances.find({keyframe.id.robot, keyframe.stamp});
    mapping::KeyframeAccuracy& accuracy = kept->accuracy.keyframes.emplace_back();
    accuracy.keyframe = keyframe.id;
    accuracy.covariance = known != state.covariances.end()
                              ? known->second
                              : geometry::Matrix6d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return kept;
}

}  // namespace plumbline::pipeline
