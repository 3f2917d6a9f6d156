// SPDX-License-Identifier: BSD-3-Clause
// Tracking over time, frame by frame.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "plumbline/core/numbers.hpp"
#include "report_fill.hpp"
#include "report_sections.hpp"

namespace plumbline::report {
namespace {

/// Charts of one robot; all share the axis of time.
class RobotCharts {
 public:
  RobotCharts(const ReportData& data, const ReportFrames& frames)
      : data_(data),
        table_(*data.frame_table),
        frames_(frames),
        end_s_(std::max(1e-3, data.end_s - data.start_s)) {
    find_bands();
  }

  std::string draw() {
    return states() +
           chart("features that fit", "inliers",
                 {line("points", column("points"), "k0"), line("lines", column("lines"), "k1")}) +
           chart("samples of surfaces that fit", "surface", {line("", column("surface"), "k2")}) +
           chart("accuracy of the pose in its weakest direction", "1 σ (mm)", {line("", weakest_mm(), "k3")},
                 true, true);
  }

  void report(RobotTable& table) const {
    std::size_t tracked = 0, weak = 0, found_again = 0, keyframes = 0;
    const std::vector<double> weak_directions = column("weak_directions");
    const std::vector<double> relocalised = column("relocalised");
    const std::vector<double> keyframe = column("keyframe");

    // Counts of frames.
    for (std::size_t i = 0; i < frames_.rows.size(); ++i) {
      tracked += is_tracked(i) ? 1U : 0U;
      weak += weak_directions[i] > 0.0 ? 1U : 0U;
      found_again += relocalised[i] > 0.0 ? 1U : 0U;
      keyframes += keyframe[i] >= 0.0 ? 1U : 0U;
    }

    // Counts with their share of all frames.
    const auto count = [](std::size_t n) { return count_text(static_cast<double>(n)); };
    const auto share = [&](std::size_t n) {
      return fmt::format(
          "{} ({})", count(n),
          number_text(100.0 * static_cast<double>(n) / static_cast<double>(frames_.rows.size()), 1, "%"));
    };

    // Number of features that fit, and their residuals.
    const auto family = [&](const char* name) {
      return fmt::format("{}; rms {}", number_text(core::quantile(column(name), 0.5), 0),
                         number_text(core::quantile(column(std::string(name) + "_rms"), 0.5), 2, "σ"));
    };

    // Frames and their states.
    table.robot(frames_.robot);
    table.value("Frames", count(frames_.rows.size()));
    table.value("Tracked", share(tracked));
    table.value("Made keyframes", count(keyframes));

    table.value("Found again by appearance", count(found_again));
    table.value("Held to no better than 2 cm in some direction", share(weak));
    table.value("Points that fit, median", family("points"));
    table.value("Lines that fit, median", family("lines"));
    table.value("Samples of surfaces that fit, median", family("surface"));
    table.value("Standard deviation in the weakest direction, median",
                number_text(core::quantile(weakest_mm(), 0.5), 2, "mm"));
  }

 private:
  [[nodiscard]] bool is_tracked(std::size_t i) const {
    return table_.text(frames_.rows[i], table_.column("state")) == "tracked";
  }
  /// NaN if the frame was not tracked, or has no value: the first frame has no residuals.
  [[nodiscard]] std::vector<double> column(const std::string& name) const {
    std::vector<double> values;
    const std::size_t index = table_.column(name);
    for (std::size_t i = 0; i < frames_.rows.size(); ++i) {
      const bool first =
          table_.number(frames_.rows[i], table_.column("min_eigenvalue")) == 0.0 && name != "keyframe";
      values.push_back(is_tracked(i) && !first ? table_.number(frames_.rows[i], index) : kNaN);
    }
    return values;
  }
  /// Standard deviation of the pose along the least constrained direction, rotations scaled to 2 m.
  [[nodiscard]] std::vector<double> weakest_mm() const {
    std::vector<double> values = column("min_eigenvalue");
    for (double& v : values) v = v > 0.0 ? 1e3 / std::sqrt(v) : kNaN;
    return values;
  }

  [[nodiscard]] viz::SvgLine line(const std::string& label, std::vector<double> values,
                                  const std::string& kind) const {
    return {label, kind, frames_.time_s, std::move(values)};
  }

  /// Each stretch of frames of one state.
  void find_bands() {
    const std::size_t state = table_.column("state");
    for (std::size_t i = 0; i < frames_.rows.size(); ++i) {
      const std::string_view what = table_.text(frames_.rows[i], state);
      const char* kind = what == "tracked" ? "tracked" : what == "unreadable" ? "unreadable" : "lost";
      const double to = i + 1 < frames_.rows.size() ? frames_.time_s[i + 1] : end_s_;
      if (!bands_.empty() && bands_.back().kind == kind) {
        bands_.back().to = to;
      } else {
        bands_.push_back({kind, frames_.time_s[i], to});
      }
    }
  }

  [[nodiscard]] std::string states() const {
    viz::SvgChart chart;
    chart.title = "State of tracking over time";
    chart.height_px = 64;
    chart.y_ticks = false;
    chart.y_label = "state";
    chart.y_range = viz::AxisRange{0.0, 1.0};
    chart.x_range = viz::AxisRange{0.0, end_s_};
    chart.bands = bands_;

    viz::SvgDots keyframes{"keyframes", "plain", {}, {}, 2.5, false};
    viz::SvgDots found{"found again by appearance", "k1", {}, {}, 4.5, true};

    // Marks in the middle of the band.
    for (std::size_t i = 0; i < frames_.rows.size(); ++i) {
      const auto is = [&](const char* name, double least) {
        return table_.number(frames_.rows[i], table_.column(name)) >= least;
      };

      for (auto& [dots, yes] :
           {std::pair{&keyframes, is("keyframe", 0.0)}, {&found, is("relocalised", 1.0)}}) {
        if (!yes) continue;
        dots->x.push_back(frames_.time_s[i]);
        dots->y.push_back(0.5);
      }
    }

    // Components of the map, then the marks.
    for (viz::SvgLine& component : components()) chart.lines.push_back(std::move(component));
    if (!found.x.empty()) chart.dots.push_back(found);
    chart.dots.push_back(keyframes);
    return svg_chart(chart);
  }

  /// Times in which each component of the map was tracked, while there was more than one.
  [[nodiscard]] std::vector<viz::SvgLine> components() const {
    std::map<int, viz::SvgLine> lines;
    const std::size_t column = table_.column("component");
    for (std::size_t i = 0; i < frames_.rows.size(); ++i) {
      const double root = table_.number(frames_.rows[i], column);
      for (auto& [other, line] : lines) {
        line.x.push_back(frames_.time_s[i]);
        line.y.push_back(other == root ? 0.5 : kNaN);
      }
      if (!(root >= 0.0) || lines.count(static_cast<int>(root)) != 0) continue;

      // A component begins.
      viz::SvgLine& line = lines[static_cast<int>(root)];
      line.label = lines.size() == 1 ? "first map" : fmt::format("map of keyframe {:.0f}", root);
      line.kind = fmt::format("k{}", (lines.size() - 1) % 8);
      line.x.push_back(frames_.time_s[i]);
      line.y.push_back(0.5);
    }

    // A single component needs no line.
    std::vector<viz::SvgLine> drawn;
    if (lines.size() < 2) return drawn;
    for (auto& [root, line] : lines) drawn.push_back(std::move(line));
    return drawn;
  }

  [[nodiscard]] std::string chart(const std::string& title, const std::string& y_label,
                                  std::vector<viz::SvgLine> lines, bool cut = false,
                                  bool last = false) const {
    viz::SvgChart chart;
    chart.title = title;
    chart.height_px = last ? 150 : 130;
    chart.y_label = y_label;
    chart.x_range = viz::AxisRange{0.0, end_s_};
    if (last) chart.x_label = "time (s)";

    // Peaks must not flatten the rest.
    const double usual = core::quantile(lines.front().y, 0.98);
    const double most = core::quantile(lines.front().y, 1.0);
    if (cut && most > 3.0 * usual) chart.y_range = viz::AxisRange{0.0, 2.0 * usual};
    for (const viz::SvgBand& band : bands_) {
      if (band.kind != "tracked") chart.bands.push_back(band);
    }
    if (lines.size() == 1) lines[0].label = title;
    chart.lines = std::move(lines);
    return svg_chart(chart);
  }

  const ReportData& data_;
  const CsvTable& table_;
  const ReportFrames& frames_;
  double end_s_;
  std::vector<viz::SvgBand> bands_;
};

}  // namespace

/// Maps that were begun when tracking was lost, with their outcome; empty: there was none.
static std::string components_html(const ReportData& data) {
  const auto& list = list_at(data.summary, "/components/list");
  JsonTable table({{"map", "{/name:text}"},
                   {">frames", "{/frames}"},
                   {">keyframes", "{/keyframes}"},
                   {"", ""},
                   {"why not", "{/why_not:text}"}});

  for (const auto& component : list) {
    const bool joined = flag_at(component, "/joined");
    const double after = number_at(component, "/joined_s");

    // Joined during the run, at its end, or not at all.
    const std::string when = !joined        ? "apart"
                             : after >= 0.0 ? fmt::format("joined after {:.1f} s, {:.0f} keyframes agree",
                                                          after, number_at(component, "/agreeing_keyframes"))
                                            : "joined at the end";
    table.row(component,
              {text_at(component, "/name"), count_text(number_at(component, "/frames")),
               count_text(number_at(component, "/keyframes")), when},
              joined ? "yes" : "bad");
  }

  const double dropped = number_at(data.summary, "/components/dropped");
  if (table.rows() == 0 && !(dropped > 0.0)) return {};

  // Maps, and frames that have none.
  std::string out = "<h3>Maps begun when tracking was lost</h3>\n";
  if (table.rows() > 0) out += table.html();
  if (dropped > 0.0)
    out += note(filled(data.summary,
                       "{/components/dropped} of fewer than five keyframes were dropped; their "
                       "{/components/dropped_frames} frames have no pose."));
  return out;
}

std::string tracking_html(const ReportData& data) {
  if (data.frames.empty()) return {};
  RobotTable summary;
  std::string charts;
  for (const ReportFrames& frames : data.frames) {
    RobotCharts robot(data, frames);
    if (data.frames.size() > 1) charts += "<h3>" + viz::markup_text(frames.robot) + "</h3>\n";
    charts += robot.draw();
    robot.report(summary);
  }
  return summary.html() + components_html(data) +
         note(
             "Rms of the residuals that fit, in standard deviations of the noise model: near 1 when it is "
             "right. Rotations count by what they move 2 m away.") +
         charts + note("Red: tracking was lost. Orange: the frame could not be read.");
}

}  // namespace plumbline::report
