// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/summary.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "plumbline/core/output_file.hpp"
#include "plumbline/core/version.hpp"
#include "run/summary_json.hpp"

namespace plumbline::pipeline {
namespace {

constexpr double kMostLostPercent = 10.0;

/// Every candidate that was verified: what was found, and why it is no loop.
Json trials_of(const RunSummary& summary) {
  Json list = Json::array();
  for (const mapping::LoopTrial& trial : summary.loops.trials) {
    const mapping::PlaceVerification& e = trial.loop.evidence;
    list.push_back({{"query", trial.loop.query.index},
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
                    {"path_m", rounded(trial.path_m)}});
  }
  return list;
}

Json disputes_of(const RunSummary& summary) {
  Json list = Json::array();
  for (const mapping::LoopDispute& dispute : summary.loops.disputes) {
    const mapping::LoopTrial& strongest = dispute.strongest;
    list.push_back({{"loops", dispute.loops.size()},
                    {"query", strongest.loop.query.index},
                    {"match", strongest.loop.match.index},
                    {"points", strongest.loop.evidence.points},
                    {"lines", strongest.loop.evidence.lines},
                    {"correction_m", rounded(strongest.correction_m)},
                    {"correction_rad", rounded(strongest.correction_rad)},
                    {"path_m", rounded(strongest.path_m)}});
  }
  return list;
}

/// The loops that speak against the path, in words; there is at least one such dispute.
std::string dispute_text(const RunSummary& summary) {
  const mapping::LoopDispute& worst = *std::max_element(
      summary.loops.disputes.begin(), summary.loops.disputes.end(),
      [](const auto& x, const auto& y) { return x.strongest.correction_m < y.strongest.correction_m; });
  const mapping::LoopTrial& loop = worst.strongest;
  return fmt::format(
      "{} loops agree that keyframe {} lies {:.2f} m from where the map has it, beside keyframe {}; that is "
      "more "
      "than drift explains on {:.1f} m: the path is wrong between them, or two places look alike",
      worst.loops.size(), loop.loop.query.index, loop.correction_m, loop.loop.match.index, loop.path_m);
}

Json robots_of(const RunSummary& summary) {
  Json list = Json::array();
  for (const RunSummary::Robot& robot : summary.robots)
    list.push_back({{"name", robot.name}, {"keyframes", robot.keyframes}});
  return list;
}

Json components_of(const RunSummary& summary) {
  Json list = Json::array();
  for (const RunSummary::Component& c : summary.components) {
    Json one = {{"name", c.name}, {"frames", c.frames}, {"keyframes", c.keyframes}, {"joined", c.joined}};
    if (c.joined) {
      one["joined_s"] = c.joined_s < 0.0 ? Json() : Json(rounded(c.joined_s));
      one["agreeing_keyframes"] = c.agreeing;
    } else {
      one["why_not"] = c.why_not;
    }
    list.push_back(std::move(one));
  }
  return {
      {"list", list}, {"dropped", summary.dropped.components}, {"dropped_frames", summary.dropped.frames}};
}

/// Components that are not part of the result, in words; empty: none.
std::string apart_text(const RunSummary& summary) {
  const std::size_t all = summary.frames.read + summary.frames.unreadable;
  std::size_t apart = 0;
  std::size_t frames = 0;
  std::string names;
  for (const RunSummary::Component& c : summary.components) {
    if (c.joined) continue;
    ++apart;
    frames += c.frames;
    names += (names.empty() ? "" : ", ") + c.name;
  }
  if (apart == 0) return {};
  const double percent = all > 0 ? 100.0 * static_cast<double>(frames) / static_cast<double>(all) : 0.0;
  const std::string which =
      apart == 1 ? "a second map that shares" : fmt::format("{} more maps that share", apart);
  return fmt::format(
      "{:.0f} % of the frames form {} no place with the first: film a place of both (components/: {})",
      percent, which, names);
}

Json sigma_json(const Sigma& sigma) {
  const auto rounded_finely = [](double value) { return std::round(value * 1e6) / 1e6; };
  return {{"median", rounded_finely(sigma.median)}, {"p90", rounded_finely(sigma.p90)}};
}

Json cloud_of(const RunSummary& summary) {
  const auto list_of = [](const std::vector<RunSummary::LeftOut>& parts) {
    Json list = Json::array();
    for (const auto& part : parts) list.push_back({{"by", part.by}, {"points", part.points}});
    return list;
  };
  Json cloud = {{"points", summary.cloud_points}, {"voxel_m", summary.voxel_m}};
  if (!summary.left_out_of_map.empty()) cloud["left_out_of_map"] = list_of(summary.left_out_of_map);
  if (summary.cloud_sigma_m.median > 0.0) cloud["sigma_m"] = sigma_json(summary.cloud_sigma_m);
  if (summary.measured_points == 0) return cloud;
  cloud["measured"] = summary.measured_points;
  cloud["left_out"] = list_of(summary.left_out);
  return cloud;
}

/// What keyframes measured and the cloud does not hold, in words; empty: hardly anything.
std::string left_out_text(const RunSummary& summary) {
  constexpr double kWorthReporting_percent = 1.0;
  std::string text;
  for (const RunSummary::LeftOut& part : summary.left_out) {
    const double percent = 100.0 * static_cast<double>(part.points) /
                           static_cast<double>(std::max<std::size_t>(1, summary.measured_points));
    if (percent < kWorthReporting_percent) continue;
    text += fmt::format("{}{:.0f} % by {}", text.empty() ? "" : ", ", percent, part.by);
  }
  return text.empty() ? text : text + ", of what keyframes measured (stage cloud)";
}

/// What the merged cloud's filters took from it, in words; empty: nothing.
std::string left_out_of_map_text(const RunSummary& summary) {
  std::string text;
  for (const RunSummary::LeftOut& part : summary.left_out_of_map) {
    if (part.points > 0) {
      text += fmt::format("{}{} points by {}", text.empty() ? "" : ", ", part.points, part.by);
    }
  }
  return text.empty() ? text : text + ", of the merged cloud";
}

Json fits_of(const optimize::BundleFits& fits) {
  Json all = Json::object();
  for (const auto& [name, fit] :
       {std::pair{"points", fits.points}, std::pair{"lines", fits.lines}, std::pair{"edges", fits.edges}}) {
    if (fit.all > 0) all[name] = {{"all", fit.all}, {"fitting", fit.fitting}, {"rms", rounded(fit.rms)}};
  }
  return all;
}

Json path_of(const RunSummary& summary) {
  Json tears = Json::array();
  for (const maps::PathStep& step : summary.path.check.tears) {
    tears.push_back({{"stamp", step.stamp},
                     {"robot", step.to.robot},
                     {"from_keyframe", step.from.index},
                     {"to_keyframe", step.to.index},
                     {"off_m", rounded(step.off_m)},
                     {"off_rad", rounded(step.off_rad)}});
  }
  return {{"largest_step_m", rounded(summary.path.check.largest_m)},
          {"largest_step_rad", rounded(summary.path.check.largest_rad)},
          {"refused_adjustments", summary.path.refused},
          {"tears", tears}};
}

Json frames_of(const RunSummary::Frames& frames) {
  return {{"available", frames.available},
          {"read", frames.read},
          {"resumed", frames.resumed},
          {"unreadable", frames.unreadable},
          {"odometry", frames.odometry},
          {"tracked", frames.tracked},
          {"lost", frames.lost},
          {"longest_loss", frames.longest_loss},
          {"tracked_percent", rounded(frames.tracked_percent())}};
}

Json loops_of(const RunSummary& summary) {
  return {{"candidates", summary.loops.candidates},
          {"verified", summary.loops.verified},
          {"accepted", summary.loops.accepted},
          {"rejected", summary.loops.rejected},
          {"relocalisations_taken_back", summary.loops.taken_back},
          {"disputes", disputes_of(summary)},
          {"list", trials_of(summary)}};
}

Json feedback_of(const RunSummary::Feedback& feedback) {
  return {{"on", true},
          {"keyframes_received", feedback.keyframes},
          {"relocalised", feedback.relocalised},
          {"loops", feedback.loops},
          {"note", "this map depends on what the network brought and when: another run gives other bytes"}};
}

Json refine_of(const RunSummary& s) {
  const mapping::RefinementSummary& refine = s.refine;
  return {{"local_maps", refine.local_maps},
          {"tried", refine.tried},
          {"accepted", refine.accepted},
          {"rejected", refine.rejected},
          {"mean_rms", rounded(refine.mean_rms)},
          {"mean_shift_m", rounded(refine.mean_shift_m)},
          {"max_shift_m", rounded(refine.max_shift_m)},
          {"sigma_position_m", sigma_json(s.sigma_position_m)},
          {"sigma_rotation_rad", sigma_json(s.sigma_rotation_rad)},
          {"before", fits_of(refine.before)},
          {"after", fits_of(refine.after)}};
}

Json timing_of(const RunSummary& summary) {
  Json stages = Json::object();
  for (const StageTiming& stage : summary.stages) {
    stages[stage.name] = {{"median", rounded(stage.quantile_ms(0.5))},
                          {"p95", rounded(stage.quantile_ms(0.95))},
                          {"finish", rounded(stage.finish_ms)}};
  }
  Json parts = Json::object();
  for (const StageTiming& part : summary.parts) {
    const auto times =
        std::count_if(part.frame_ms.begin(), part.frame_ms.end(), [](float ms) { return !std::isnan(ms); });
    parts[part.name] = {{"times", times},
                        {"median", rounded(part.quantile_ms(0.5))},
                        {"p95", rounded(part.quantile_ms(0.95))}};
  }
  return {{"wall_s", rounded(summary.wall_s)},
          {"pace_hz", rounded(summary.pace_hz)},
          {"behind_s", rounded(summary.behind_s)},
          {"map_s", rounded(summary.map_s)},
          {"fps", rounded(summary.fps())},
          {"export_s", rounded(summary.export_s)},
          {"stages_ms", stages},
          {"parts_ms", parts},
          {"threads", summary.threads}};
}

/// The worst place where the path is torn, and how many there are.
std::string torn_text(const maps::PathCheck& check) {
  const auto& worst = *std::max_element(check.tears.begin(), check.tears.end(),
                                        [](const auto& a, const auto& b) { return a.off_m < b.off_m; });
  return fmt::format(
      "the map is torn: at {:.3f} s, between keyframes {} and {}, the path jumps by {:.1f} cm and {:.1f} "
      "degrees that the tracker did not see{}",
      worst.stamp, worst.from.index, worst.to.index, 100.0 * worst.off_m, worst.off_rad * 180.0 / M_PI,
      check.tears.size() > 1 ? fmt::format("; {} such places in all", check.tears.size()) : "");
}

}  // namespace

double RunSummary::Frames::tracked_percent() const {
  const std::size_t all = read + unreadable;
  return all == 0 ? 0.0 : 100.0 * static_cast<double>(tracked) / static_cast<double>(all);
}

double RunSummary::fps() const {
  const double seconds = wall_s - export_s;
  return seconds > 0.0 ? static_cast<double>(frames.read - frames.resumed) / seconds : 0.0;
}

void judge(RunSummary& summary) {
  const RunSummary::Frames& frames = summary.frames;
  const std::size_t all = frames.read + frames.unreadable;
  const double lost_percent = 100.0 - frames.tracked_percent();
  const std::string apart = apart_text(summary);
  summary.reason.clear();
  if (all > 0 && lost_percent > kMostLostPercent) {
    summary.reason = fmt::format(
        "{} of {} frames have no pose ({:.1f} %; up to {:.0f} % would be trusted): {} lost, {} unreadable; "
        "the longest loss is {} frames",
        all - frames.tracked, all, lost_percent, kMostLostPercent, frames.lost, frames.unreadable,
        frames.longest_loss);
    if (!apart.empty()) summary.reason += "; " + apart;
  } else if (!apart.empty()) {
    summary.reason = apart;
  } else if (!summary.path.check.tears.empty()) {
    summary.reason = torn_text(summary.path.check);
  } else if (!summary.loops.disputes.empty()) {
    summary.reason = dispute_text(summary);
  } else if (all > 0 && summary.voxel_m > 0.0 && summary.cloud_points == 0) {
    const std::string of_map = left_out_of_map_text(summary);
    const std::string without = of_map.empty() ? left_out_text(summary) : of_map;
    summary.reason = "the cloud is empty: " +
                     (without.empty() ? "no keyframe had usable depth" : "left out were " + without);
  } else {
    summary.reason = summary.unconnected;
  }
  if (summary.reason.empty()) summary.reason = summary.input_doubt;
  for (const RunSummary::Camera& camera : summary.cameras) {
    if (summary.reason.empty()) summary.reason = camera.doubt;
  }
}

core::Result<void> write_summary(const std::filesystem::path& file, const RunSummary& s) {
  Json json = {
      {"input", s.input},
      {"pipeline", s.pipeline},
      {"trustworthy", s.reason.empty()},
      {"reason", s.reason},
      {"stopped", s.stopped},
      {"frames", frames_of(s.frames)},
      {"keyframes", s.keyframes},
      {"keyframe_causes", {{"cone", s.causes.cone}, {"urgent", s.causes.urgent}, {"plain", s.causes.plain}}},
      {"landmarks", {{"points", s.points}, {"lines", s.lines}}},
      {"loops", loops_of(s)},
      {"refine", refine_of(s)},
      {"path", path_of(s)},
      {"merges", merges_of(s)},
      {"meetings", meetings_of(s)},
      {"robots", robots_of(s)},
      {"components", components_of(s)},
      {"cloud", cloud_of(s)},
      {"frame", {{"up", s.up}, {"yaw", s.yaw}, {"output_from_map", rows(s.output_from_map)}}},
      {"camera", cameras_of(s)},
      {"timing", timing_of(s)},
      {"memory", {{"peak_rss_mb", rounded(s.peak_rss_mb)}}},
      {"version", core::version()},
      {"seed", s.seed}};
  if (s.feedback.on) json["feedback"] = feedback_of(s.feedback);
  // Names of files need not be UTF-8: replace what JSON cannot hold.
  return core::write_file(file, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

core::Result<void> write_timing(const std::filesystem::path& file, const RunReport& report,
                                const std::vector<StageTiming>& parts, const dataset::FrameSource& source) {
  std::vector<const StageTiming*> columns;
  for (const StageTiming& stage : report.stages) columns.push_back(&stage);
  for (const StageTiming& part : parts) columns.push_back(&part);
  std::string text = "frame,stamp";
  for (const StageTiming* column : columns) text += "," + column->name + "_ms";
  text += ",rss_mb\n";
  for (std::size_t f = 0; f < report.frames; ++f) {
    text += fmt::format("{},{:.6f}", f, source.info(f).stamp);
    for (const StageTiming* column : columns) {
      const bool worked = f < column->frame_ms.size() && !std::isnan(column->frame_ms[f]);
      text += worked ? fmt::format(",{:.3f}", column->frame_ms[f]) : ",";
    }
    const bool known = f < report.rss_mb.size() && !std::isnan(report.rss_mb[f]);
    text += known ? fmt::format(",{:.1f}", report.rss_mb[f]) : ",";
    text += '\n';
  }
  return core::write_file(file, text);
}

std::string to_text(const RunSummary& s) {
  std::string text;
  if (s.stopped) {
    text += fmt::format("stopped after {} of {} frames; what was mapped so far is written\n",
                        s.frames.read + s.frames.unreadable, s.frames.available);
  }
  text += fmt::format("frames     {} read, {} tracked ({:.1f} %), {} unreadable\n", s.frames.read,
                      s.frames.tracked, s.frames.tracked_percent(), s.frames.unreadable);
  if (s.frames.odometry > 0) {
    text += fmt::format("poses      of the recorder's own odometry started the search in {} frames\n",
                        s.frames.odometry);
  }
  text += fmt::format("map        {} keyframes, {} points, {} lines, {} loops\n", s.keyframes, s.points,
                      s.lines, s.loops.accepted);
  text += fmt::format("cloud      {} points, {:g} mm voxels\n", s.cloud_points, s.voxel_m * 1000.0);
  for (const std::string& without : {left_out_text(s), left_out_of_map_text(s)}) {
    if (!without.empty()) text += fmt::format("left out   {}\n", without);
  }
  text +=
      fmt::format("time       {:.1f} s in all, {:.1f} s of it export: {:.1f} frames a second without that\n",
                  s.wall_s, s.export_s, s.fps());
  if (s.pace_hz > 0.0) {
    text += fmt::format("pace       {:g} frames a second; {:.2f} s behind at most\n", s.pace_hz, s.behind_s);
  }
  text += fmt::format("memory     {:.0f} MB at most\n", s.peak_rss_mb);
  return text;
}

double peak_rss_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;  // Linux counts in kB
}

double rss_mb() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) return std::numeric_limits<double>::quiet_NaN();
  long all = 0;
  long resident = 0;
  const int fields = std::fscanf(file, "%ld %ld", &all, &resident);  // pages
  std::fclose(file);
  if (fields != 2) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

}  // namespace plumbline::pipeline
