// SPDX-License-Identifier: BSD-3-Clause
// Cost of a run: time and memory; its configuration and files.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <system_error>

#include "plumbline/core/numbers.hpp"
#include "report_fill.hpp"
#include "report_sections.hpp"

namespace plumbline::report {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct TimedColumn {
  std::string name;
  std::vector<double> values;
  double median = 0.0;
};

std::vector<double> values_of(const CsvTable& table, std::size_t column) {
  std::vector<double> values;
  for (std::size_t row = 0; row < table.rows(); ++row) values.push_back(table.number(row, column));
  return values;
}

/// The stages that take most time per frame.
std::vector<TimedColumn> slowest_stages(const CsvTable& table) {
  constexpr std::size_t kMost = 5;
  constexpr double kWorthShowing_ms = 0.5;
  std::vector<TimedColumn> columns;
  for (std::size_t c = 0; c < table.columns().size(); ++c) {
    const std::string& name = table.columns()[c];

    // Whole stages, not their parts.
    const bool stage =
        name.size() > 3 && name.substr(name.size() - 3) == "_ms" && name.find('.') == std::string::npos;
    if (!stage) continue;

    // Only stages that take noticeable time.
    TimedColumn column{name.substr(0, name.size() - 3), values_of(table, c), 0.0};
    column.median = core::quantile(column.values, 0.5);
    if (core::quantile(column.values, 0.95) >= kWorthShowing_ms) columns.push_back(std::move(column));
  }

  // The slowest ones first.
  const auto slower = [](const TimedColumn& a, const TimedColumn& b) { return a.median > b.median; };
  std::stable_sort(columns.begin(), columns.end(), slower);
  if (columns.size() > kMost) columns.resize(kMost);
  return columns;
}

std::string time_charts(const ReportData& data) {
  if (!data.timing_table) return {};
  const CsvTable& table = *data.timing_table;
  std::vector<double> time_s = values_of(table, table.column("stamp"));
  const double start_s = core::quantile(time_s, 0.0);
  for (double& t : time_s) t -= start_s;

  // One curve per stage.
  viz::SvgChart chart;
  chart.title = "Milliseconds of each stage per frame";
  chart.y_label = "a frame (ms)";
  chart.height_px = 180;

  // Quantiles, to notice rare peaks.
  double usual = 0.0, most = 0.0;
  for (TimedColumn& column : slowest_stages(table)) {
    usual = std::max(usual, core::quantile(column.values, 0.98));
    most = std::max(most, core::quantile(column.values, 1.0));
    chart.lines.push_back({column.name, robot_kind(chart.lines.size()), time_s, std::move(column.values)});
  }

  // Peaks must not flatten the rest.
  std::string out;
  if (most > 3.0 * usual) chart.y_range = viz::AxisRange{0.0, 2.0 * usual};
  if (!chart.lines.empty()) out += svg_chart(chart);
  if (chart.y_range)
    out += note(fmt::format("Peaks are cut off; the highest is {}.", number_text(most, 0, "ms")));

  // Memory, if it was measured.
  viz::SvgChart memory;
  memory.title = "Memory over time";
  memory.x_label = "time (s)";
  memory.y_label = "memory (MB)";
  memory.lines.push_back(
      {"memory held when a frame was done", "k5", time_s, values_of(table, table.column("rss_mb"))});
  const bool known = core::quantile(memory.lines[0].y, 1.0) > 0.0;
  return known ? out + svg_chart(memory) : out;
}

std::string stages_table(const Json& summary) {
  JsonTable table({{"stage", ""},
                   {">a frame, median (ms)", "{/median:2}"},
                   {">95 % of frames (ms)", "{/p95:2}"},
                   {">at the end (ms)", "{/finish:0}"},
                   {">times", ""}});
  for (const auto& [name, stage] : list_at(summary, "/timing/stages_ms").items()) table.row(stage, {name});

  // Parts of stages, in grey.
  for (const auto& [name, part] : list_at(summary, "/timing/parts_ms").items()) {
    table.row(part,
              {name, filled(part, "{/median:2}"), filled(part, "{/p95:2}"), "", filled(part, "{/times}")},
              "no");
  }
  return table.html();
}

/// Description of a file of the result, found by the end of its name.
std::string what_is(const std::string& name) {
  struct Known {
    const char* name;
    const char* what;
  };

  static constexpr std::array<Known, 15> kKnown{
      {{"map.ply", "merged cloud: position, normal, colour, confidence, observations, sigma"},
       {"map.pcd", "the same for PCL"},
       {"map.db", "the map itself: for fuse, export, render and --resume"},
       {"trajectory.txt", "camera poses of the tracked frames, TUM format"},
       {"keyframes.txt", "camera poses of the keyframes, TUM format"},
       {"keyframes.csv", "the same with their accuracy and number of constraints"},
       {"pose_samples.npy", "errors that the keyframes' poses may have, for lengths with their 95 %"},
       {"lines.ply", "3D lines as edges"},
       {"frames.csv", "one line a frame: what tracking saw and decided"},
       {"timing.csv", "one line a frame: milliseconds by stage, memory"},
       {"summary.json", "counts, times, evidence, whether to trust the result"},
       {"config.yaml", "the effective configuration, itself a pipeline file"},
       {".png", "picture"},
       {".ply", "cloud"},
       {".pcd", "cloud"}}};

  // The first that fits: names precede endings.
  for (const Known& known : kKnown) {
    const std::string end = known.name;
    if (name.size() >= end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0)
      return known.what;
  }

  return {};
}

}  // namespace

std::string cost_html(const ReportData& data) {
  const Json& s = data.summary;
  Facts facts = filled_facts(
      s,
      {{"The whole run", "{/timing/wall_s:2 s}: {/timing/fps:1} frames a second without the time for export"},
       {"Mapping, first frame read to last change of the map", "{/timing/map_s:2 s}"},
       {"Clouds, pictures and tables", "{/timing/export_s:2 s}"}});
  const auto add = [&](const char* label, const char* pattern) {
    facts.emplace_back(label, filled(s, pattern));
  };

  // Only some runs have a pace or a live source.
  if (number_at(s, "/timing/pace_hz") > 0.0)
    add("Played at", "{/timing/pace_hz:1} a second; {/timing/behind_s:2 s} behind at most");
  if (number_at(s, "/live/kept_frames") > 0.0)
    add("Pictures kept",
        "{/live/kept_frames}, packed {/live/kept_bytes} bytes, to be read with another camera");

  // Known of every run.
  add("Threads", "{/timing/threads}");
  add("Memory at most", "{/memory/peak_rss_mb:0 MB}");
  if (number_at(s, "/frames/resumed") > 0.0) {
    add("Not counted", "{/frames/resumed} frames that an earlier run had mapped before it was interrupted");
  }

  return facts_html(facts) + stages_table(s) + time_charts(data);
}

std::string configuration_html(const ReportData& data) {
  const std::string text = read_bytes(data.folder / "config.yaml");
  if (text.empty()) return note("config.yaml is empty.");
  return note("Every option with its value, defaults included; itself a pipeline file for -p.") +
         folded("config.yaml", "<pre>" + viz::markup_text(text) + "</pre>\n");
}

std::string files_html(const ReportData& data, const fs::path& left_out) {
  constexpr std::size_t kMost = 400;
  std::vector<std::pair<std::string, double>> files;
  double all = 0.0;

  // All files of the result, with their sizes.
  std::error_code ec;
  for (fs::recursive_directory_iterator it(data.folder, ec), end; !ec && it != end; it.increment(ec)) {
    std::error_code problem;
    const std::string name = it->path().lexically_relative(data.folder).generic_string();

    // Neither hidden files nor this report.
    const bool hidden = it->path().filename().string().front() == '.' || name == "report.html";
    if (hidden || !it->is_regular_file(problem) || fs::equivalent(it->path(), left_out, problem)) continue;
    files.emplace_back(name, static_cast<double>(it->file_size(problem)));
    all += files.back().second;
  }

  // In order of names, up to a limit.
  std::sort(files.begin(), files.end());
  HtmlTable table("file|>size|>bytes|what it is");
  for (std::size_t i = 0; i < std::min(kMost, files.size()); ++i) {
    table.row(
        {files[i].first, bytes_text(files[i].second), count_text(files[i].second), what_is(files[i].first)});
  }

  return table.html() +
         note(fmt::format("{} files, {} in all{}.", files.size(), bytes_text(all),
                          files.size() > kMost ? fmt::format("; the first {} are listed", kMost) : ""));
}

}  // namespace plumbline::report
