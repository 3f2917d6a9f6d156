// SPDX-License-Identifier: BSD-3-Clause
#include "robots/tracking_sections.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "robots/robot_components.hpp"

namespace plumbline::pipeline {
namespace {

/// A verified candidate: its evidence, and the reason if it is not a loop.
Json section_of(const mapping::LoopTrial& trial) {
  const mapping::PlaceVerification& e = trial.loop.evidence;
  return {{"query", trial.loop.query.index},
          {"match", trial.loop.match.index},
          {"closed", trial.closed},
          {"by_others", trial.by_others},
          {"reason", trial.refused},
          {"score", rounded(trial.score)},
          {"matches", e.matched_points + e.matched_lines},
          {"points", e.points},
          {"lines", e.lines},
          {"found", rounded(e.found)},
          {"rms", rounded(e.rms_px)},
          {"overlap", rounded(e.overlap)},
          {"contradiction", rounded(e.contradiction)},
          {"correction_m", rounded(trial.correction_m)},
          {"correction_rad", rounded(trial.correction_rad)},
          {"path_m", rounded(trial.path_m)}};
}

Json section_of(const mapping::LoopDispute& dispute) {
  const mapping::LoopTrial& strongest = dispute.strongest;
  return {{"loops", dispute.loops.size()},
          {"query", strongest.loop.query.index},
          {"match", strongest.loop.match.index},
          {"points", strongest.loop.evidence.points},
          {"lines", strongest.loop.evidence.lines},
          {"correction_m", rounded(strongest.correction_m)},
          {"correction_rad", rounded(strongest.correction_rad)},
          {"path_m", rounded(strongest.path_m)}};
}

}  // namespace

void report_loops(const mapping::Slam& slam, Json& loops) {
  const mapping::LoopCloser& closer = slam.connections().loops();
  const mapping::LoopCounts& counts = closer.counts();
  add(loops["candidates"], static_cast<std::size_t>(counts.candidates));
  add(loops["verified"], static_cast<std::size_t>(counts.verified));
  add(loops["accepted"], static_cast<std::size_t>(counts.accepted));
  add(loops["rejected"], static_cast<std::size_t>(counts.rejected));
  add(loops["relocalisations_taken_back"],
      static_cast<std::size_t>(slam.connections().components().taken_back()));
  for (const mapping::LoopDispute& dispute : closer.disputes())
    loops["disputes"].push_back(section_of(dispute));
  for (const mapping::LoopTrial& trial : closer.trials()) loops["list"].push_back(section_of(trial));
}

void report_joins(const std::string& robot, const mapping::Slam& slam,
                  const std::map<core::KeyframeId, std::size_t>& frames, Json& list) {
  const double first_s = slam.frame_poses().empty() ? 0.0 : slam.frame_poses().front().stamp;
  for (const mapping::ComponentJoin& join : slam.connections().components().joins()) {
    ComponentFate component;
    component.name = fmt::format("{}, from keyframe {} on", robot, join.overlap.b.index);
    const auto counted = frames.find(join.overlap.b);
    component.frames = counted == frames.end() ? 0 : counted->second;
    component.keyframes = join.keyframes;

    component.joined = true;
    component.joined_s = join.stamp - first_s;
    component.agreeing = join.overlap.evidence.consistency.agreeing;
    list.push_back(section_of(component));
  }
}

Json feedback_section(const Slams& slams, const mapping::OtherMapsInbox& others) {
  int relocalised = 0;
  int loops = 0;
  for (const auto& slam : slams) {
    const mapping::LoopCounts& counts = slam->connections().loops().counts();
    relocalised += counts.located;
    loops += counts.by_others;
  }
  const auto maps = others.get();
  return {{"on", true},
          {"keyframes_received", maps ? maps->map.keyframe_count() : 0},
          {"relocalised", relocalised},
          {"loops", loops},
          {"note",
           "this map depends on the data received from the network and their times: another run gives other "
           "bytes"}};
}

void doubt_disputed_loops(const Json& summary, std::vector<Doubt>& reasons) {
  const Json& disputes = summary.at("loops").at("disputes");
  if (disputes.empty()) return;
  const Json& worst = *std::max_element(disputes.begin(), disputes.end(), [](const Json& x, const Json& y) {
    return x.at("correction_m").get<double>() < y.at("correction_m").get<double>();
  });
  reasons.push_back(
      {Doubt::About::kDisputedLoops,
       fmt::format("{} loops agree that keyframe {} lies {:.2f} m from its pose in the map, relative to "
                   "keyframe {}; that exceeds what drift explains on {:.1f} m: the path is wrong "
                   "between them, or two places look alike",
                   worst.at("loops").get<int>(), worst.at("query").get<int>(),
                   worst.at("correction_m").get<double>(), worst.at("match").get<int>(),
                   worst.at("path_m").get<double>())});
}

}  // namespace plumbline::pipeline
