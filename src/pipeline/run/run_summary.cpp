// SPDX-License-Identifier: BSD-3-Clause
#include "run/run_summary.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "plumbline/core/csv.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/pipeline/verdict.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {
namespace {

std::vector<StageTiming> parts_of(const Graph& graph) {
  std::vector<StageTiming> parts;
  for (const Node& node : graph.nodes) {
    for (StageTiming& part : node.stage->parts()) parts.push_back(std::move(part));
  }
  return parts;
}

/// Time and memory of the run, as the sections `timing` and `memory` have them.
struct Needs {
  double wall_s = 0.0, export_s = 0.0, behind_s = 0.0;
  double fps = 0.0;  ///< frames read by this run a second, all that is not export included
  double pace_hz = 0.0;
  double peak_rss_mb = 0.0;

  Needs(const FrameCounts& frames, const RunReport& report, const RunFacts& facts)
      : wall_s(rounded(facts.wall_s)),
        export_s(rounded(report.export_s)),
        behind_s(rounded(report.behind_s)),
        pace_hz(rounded(facts.pace_hz)),
        peak_rss_mb(rounded(pipeline::peak_rss_mb())) {
    const double seconds = facts.wall_s - report.export_s;
    if (seconds > 0.0) fps = rounded(static_cast<double>(frames.read - frames.resumed) / seconds);
  }
};

Json timing_of(const Graph& graph, const RunReport& report, const RunFacts& facts, const Needs& needs) {
  Json stages = Json::object();
  for (const StageTiming& stage : report.stages) {
    stages[stage.name] = {{"median", rounded(stage.quantile_ms(0.5))},
                          {"p95", rounded(stage.quantile_ms(0.95))},
                          {"finish", rounded(stage.finish_ms)}};
  }

  // Parts of stages, such as local bundles, run in some frames only, so their number is given too.
  Json parts = Json::object();
  for (const StageTiming& part : parts_of(graph)) {
    const auto times =
        std::count_if(part.frame_ms.begin(), part.frame_ms.end(), [](float ms) { return !std::isnan(ms); });
    parts[part.name] = {{"times", times},
                        {"median", rounded(part.quantile_ms(0.5))},
                        {"p95", rounded(part.quantile_ms(0.95))}};
  }

  return {{"wall_s", needs.wall_s},     {"pace_hz", needs.pace_hz},
          {"behind_s", needs.behind_s}, {"map_s", rounded(report.map_s)},
          {"fps", needs.fps},           {"export_s", needs.export_s},
          {"stages_ms", stages},        {"parts_ms", parts},
          {"threads", facts.threads}};
}

/// One line for each robot with sensors beside its camera.
std::string sensors_text(const Json& summary) {
  std::string text;
  for (const Json& robot : summary.at("sensors")) {
    text += "sensors    ";
    if (summary.at("sensors").size() > 1) text += robot.at("robot").get<std::string>() + ": ";
    if (robot.contains("gyro")) text += "gyroscope " + robot.at("gyro").at("use").get<std::string>();
    if (robot.contains("gyro") && robot.contains("odometry")) text += ", ";
    if (robot.contains("odometry")) {
      const Json& wheels = robot.at("odometry");
      text += "wheels " + wheels.at("use").get<std::string>();
      if (wheels.contains("scale"))
        text += fmt::format(", scale {:.4f} +- {:.4f}", wheels.at("scale").get<double>(),
                            wheels.at("scale_sigma").get<double>());
    }
    text += "\n";
  }
  const std::size_t bridged = FrameCounts(summary).bridged.value_or(0);
  return bridged > 0 ? text + fmt::format("bridged    {} frames by the gyroscope\n", bridged) : text;
}

/// Counts of frames that arrived and were mapped, and of the others.
std::string live_text(const Json& live) {
  const auto count = [&](const char* name) { return live.at(name).get<std::size_t>(); };
  const std::size_t came = count("taken") + count("dropped") + count("stamps_backwards");
  std::string text = fmt::format("{} of {} received frames were mapped", count("taken"), came);
  for (const auto& [name, what] : {std::pair{"dropped", "dropped, because too many were waiting"},
                                   {"stamps_backwards", "left out, because their stamps went back"},
                                   {"unpaired_images", "images without a partner of the other kind"},
                                   {"lost_messages", "messages lost by the network"}}) {
    if (count(name) > 0) text += fmt::format(", {} {}", count(name), what);
  }
  text += fmt::format("; images of {} were kept, {:.1f} MB packed", count("kept_frames"),
                      static_cast<double>(count("kept_bytes")) / 1e6);
  return text;
}

std::string text_of(const Needs& needs) {
  std::string text =
      fmt::format("time       {:.1f} s in all, {:.1f} s of it export: {:.1f} frames a second without that\n",
                  needs.wall_s, needs.export_s, needs.fps);
  if (needs.pace_hz > 0.0) {
    text += fmt::format("pace       {:g} frames a second; {:.2f} s behind at most\n", needs.pace_hz,
                        needs.behind_s);
  }
  return text + fmt::format("memory     {:.0f} MB at most\n", needs.peak_rss_mb);
}

std::string text_of(const Json& summary, const Needs& needs) {
  const FrameCounts frames(summary);
  const auto count = [](const Json& number) { return number.get<std::size_t>(); };

  // The verdict comes first: numbers of a map that must not be trusted mislead.
  std::string text = sentence_of(summary);
  if (!text.empty()) text += "\n";

  if (summary.at("stopped").get<bool>()) {
    text += fmt::format("stopped after {} of {} frames; what was mapped so far is written\n",
                        frames.read + frames.unreadable, frames.available);
  }

  text += fmt::format("frames     {} read, {} tracked ({:.1f} %), {} unreadable{}\n", frames.read,
                      frames.tracked, frames.tracked_percent(), frames.unreadable,
                      frames.missing > 0 ? fmt::format(", {} missing", frames.missing) : "");
  if (frames.odometry > 0) {
    text += fmt::format("poses      of the recorder's own odometry started the search in {} frames\n",
                        frames.odometry);
  }

  if (summary.contains("sensors")) text += sensors_text(summary);
  if (summary.contains("live")) text += fmt::format("live       {}\n", live_text(summary.at("live")));

  // Locating leaves the map as it is, so the map's size is not a result of the run.
  if (summary.contains("localized")) {
    const Json& localized = summary.at("localized");
    return text +
           fmt::format("located    {} frames ({:.1f} %), in a map of {} keyframes; longest gap {} frames\n",
                       count(localized.at("located")), 100.0 * localized.at("share").get<double>(),
                       count(localized.at("keyframes")), count(localized.at("longest_gap"))) +
           text_of(needs);
  }

  const Json& landmarks = summary.at("landmarks");
  text += fmt::format("map        {} keyframes, {} points, {} lines, {} loops\n",
                      count(summary.at("keyframes")), count(landmarks.at("points")),
                      count(landmarks.at("lines")), count(summary.at("loops").at("accepted")));
  const Json& cloud = summary.at("cloud");
  text += fmt::format("cloud      {} points, {:g} mm voxels\n", count(cloud.at("points")),
                      cloud.at("voxel_m").get<double>() * 1000.0);

  for (const std::string& without : {left_out_text(cloud), left_out_of_map_text(cloud)}) {
    if (!without.empty()) text += fmt::format("left out   {}\n", without);
  }

  return text + text_of(needs);
}

}  // namespace

RunSummary summary_of(const Graph& graph, const RunReport& report, const RunFacts& facts) {
  Json summary = empty_sections();
  summary["input"] = facts.input;
  summary["pipeline"] = facts.pipeline;
  summary["stopped"] = report.stopped;
  FrameCounts frames;
  frames.available = report.frames_available;
  frames.write(summary);
  for (const Node& node : graph.nodes) node.stage->report(summary);

  frames = FrameCounts(summary);
  const Needs needs(frames, report, facts);
  summary["timing"] = timing_of(graph, report, facts, needs);
  summary["memory"] = {{"peak_rss_mb", needs.peak_rss_mb}};
  summary["version"] = core::version();
  summary["seed"] = 0;

  RunSummary result;
  std::vector<Doubt> doubts;
  for (const Node& node : graph.nodes) node.stage->doubt(summary, doubts);
  set_verdict(std::move(doubts), summary);
  result.reason = reason_of(summary);
  // Names of files need not be UTF-8: replace what JSON cannot hold.
  result.json = core::json_text(summary);
  result.text = text_of(summary, needs);
  return result;
}

core::Result<void> write_timing(const std::filesystem::path& file, const Graph& graph,
                                const RunReport& report, const dataset::FrameSource& source) {
  const std::vector<StageTiming> parts = parts_of(graph);
  std::vector<const StageTiming*> columns;
  for (const StageTiming& stage : report.stages) columns.push_back(&stage);
  for (const StageTiming& part : parts) columns.push_back(&part);
  std::string text = "frame,stamp";
  for (const StageTiming* column : columns) text += "," + core::csv_field(column->name + "_ms");
  text += ",rss_mb\n";

  // An empty cell is a frame in which the stage had nothing to do, or one that an earlier run has done.
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
