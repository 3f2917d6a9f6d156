// SPDX-License-Identifier: BSD-3-Clause
// The paths of a report against the truth, and evaluations that were put into the folder.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <system_error>

#include "plumbline/core/json.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/evaluate/companions.hpp"
#include "report_fill.hpp"
#include "report_sections.hpp"

namespace plumbline::report {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Truths = std::vector<std::pair<std::size_t, fs::path>>;  ///< of which path

/// One file for all robots, or each robot's own.
Truths truths_of(const fs::path& truth, const ReportData& data) {
  std::error_code ec;
  Truths truths;
  const fs::path file = fs::is_directory(truth, ec) ? truth / "groundtruth.txt" : truth;
  if (fs::is_regular_file(file, ec)) {
    // One file for all robots.
    for (std::size_t i = 0; i < data.paths.size(); ++i) truths.emplace_back(i, file);
    return truths;
  }

  // Else as the evaluation finds them.
  for (const auto& pair : evaluate::find_trajectories(data.folder / "map.ply", truth / "reference.ply")) {
    for (std::size_t i = 0; i < data.paths.size(); ++i) {
      if (pair.robot == data.paths[i].robot || pair.robot.empty()) truths.emplace_back(i, pair.truth);
    }
  }

  // Else by the robots' names.
  for (std::size_t i = 0; i < data.paths.size() && truths.empty();
       ++i) {  // one robot's map, of several recordings
    const fs::path own = truth / data.paths[i].robot / "groundtruth.txt";
    if (fs::is_regular_file(own, ec)) truths.emplace_back(i, own);
  }

  return truths;
}

/// All robots as one path, so that one alignment must do for all: their stamps are set far apart.
std::optional<evaluate::Statistics> joint_error(
    const std::vector<std::pair<geometry::Trajectory, geometry::Trajectory>>& pairs) {
  constexpr double kApart_s = 1e7;
  geometry::Trajectory estimate, truth;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto append = [&](const geometry::Trajectory& from, geometry::Trajectory& to) {
      for (geometry::StampedPose pose : from) {
        pose.stamp += kApart_s * static_cast<double>(i) - pairs[i].second.front().stamp;
        to.push_back(pose);
      }
    };
    append(pairs[i].first, estimate);
    append(pairs[i].second, truth);
  }
  const auto report = evaluate::evaluate_trajectory(estimate, truth);
  return report ? std::optional(report->ate_m) : std::nullopt;
}

/// "29.5 mm; median 24.4, at most 62.8"
std::string distances(const evaluate::Statistics& m) {
  return fmt::format("{}; median {}, at most {}", number_text(1e3 * m.rmse, 1, "mm"),
                     number_text(1e3 * m.median, 1), number_text(1e3 * m.max, 1));
}

std::string relative(const evaluate::RelativeError& e) {
  if (e.pairs == 0) return {};
  return fmt::format("{}, {}", number_text(1e3 * e.translation_m.rmse, 1, "mm"),
                     number_text(e.rotation_deg.rmse, 3, "deg"));
}

/// Accuracy of each robot, and of all with one alignment.
std::string errors_table(const ReportData& data) {
  RobotTable table;
  for (const ReportPath& path : data.paths) {
    if (!path.accuracy) continue;
    const evaluate::TrajectoryReport& r = *path.accuracy;
    table.robot(path.robot);
    table.value("Poses with truth", count_text(static_cast<double>(r.matched)) + " of " +
                                        count_text(static_cast<double>(r.estimated)));

    table.value("ATE, rmse", distances(r.ate_m));
    table.value("Share of the path's length",
                number_text(r.path_m > 0.0 ? 100.0 * r.ate_m.rmse / r.path_m : NAN, 3, "%"));
    table.value("Orientation, rmse", number_text(r.rotation_deg.rmse, 3, "deg"));
    table.value("RPE over a frame, rmse", relative(r.rpe_frame));
    table.value("RPE over a second, rmse", relative(r.rpe_second));
    table.value("Path, true", number_text(r.path_m, 2, "m"));
  }

  // Together, errors between robots count too.
  if (data.joint_m) {
    table.robot("all, one alignment");
    table.value("ATE, rmse", distances(*data.joint_m));
  }

  return table.html();
}

std::string error_chart(const ReportData& data) {
  viz::SvgChart chart;
  chart.title = "Distance to the truth over time";
  chart.x_label = "time (s)";
  chart.y_label = "error (mm)";
  chart.height_px = 190;
  for (const ReportPath& path : data.paths) {
    if (!path.accuracy) continue;
    viz::SvgLine line{
        path.robot.empty() ? "distance to the truth" : path.robot, robot_kind(path.number), {}, {}};

    // Millimetres, from the first frame on.
    for (const evaluate::PoseError& pose : path.accuracy->poses) {
      line.x.push_back(pose.stamp - data.start_s);
      line.y.push_back(1e3 * pose.distance_m);
    }
    chart.lines.push_back(std::move(line));
  }
  return svg_chart(chart);
}

void add_saved_path(const std::string& file, const Json& json, JsonTable& table) {
  const std::string name = text_at(json, "/name");
  table.row(json, {name.empty() ? file : file + ": " + name});
}

/// Section of evaluation*.json files in the folder, printed by plumbline evaluate --json.
std::string saved_html(const ReportData& data) {
  std::vector<std::string> names;
  std::error_code ec;
  for (fs::directory_iterator it(data.folder, ec), end; !ec && it != end; it.increment(ec)) {
    const std::string name = it->path().filename().string();
    if (name.rfind("evaluation", 0) == 0 && it->path().extension() == ".json") names.push_back(name);
  }
  std::sort(names.begin(), names.end());

  // Columns and where their values are in the files.
  JsonTable paths({{"evaluation of a path", ""},
                   {">ATE rmse (mm)", "{/ate_m/rmse:1mm}"},
                   {">median (mm)", "{/ate_m/median:1mm}"},
                   {">max (mm)", "{/ate_m/max:1mm}"},
                   {">orientation rmse (deg)", "{/rotation_deg/rmse:3}"},
                   {">RPE per frame (mm)", "{/rpe/per_frame/translation_m/rmse:1mm}"},
                   {">RPE per second (mm)", "{/rpe/per_second/translation_m/rmse:1mm}"},
                   {">tracked (%)", "{/tracked_percent:1}"}});

  // Columns of cloud evaluations.
  JsonTable clouds({{"evaluation of a cloud", ""},
                    {">accuracy median (mm)", "{/accuracy_mm/median:1}"},
                    {">rmse (mm)", "{/accuracy_mm/rmse:1}"},
                    {">completeness median (mm)", "{/completeness_mm/median:1}"},
                    {">rmse (mm)", "{/completeness_mm/rmse:1}"},
                    {">F at 10 mm", "{/at/10mm/f:3}"},
                    {">walls' thickness, rms (mm)", "{/wall_thickness_mm/rms:1}"}});

  std::string out;

  // The keys show which evaluation it was.
  for (const std::string& name : names) {
    const Json json = core::read_json(data.folder / name).value_or(Json());

    if (json.is_object() && json.contains("ate_m")) {
      add_saved_path(name, json, paths);
    } else if (json.is_object() && json.contains("estimates")) {
      for (const Json& one : list_at(json, "/estimates")) add_saved_path(name, one, paths);
    } else if (json.is_object() && (json.contains("accuracy_mm") || json.contains("wall_thickness_mm"))) {
      clouds.row(json, {name});
    } else {
      out += note(name + " is not output of plumbline evaluate --json.");
    }
  }

  return paths.html() + clouds.html() + out;
}

}  // namespace

/// Adds the name of a true path, and of others beside it that were not taken.
static void name_truth(const std::string& robot, const fs::path& file, ReportData& data) {
  const std::string name = file.filename().string();
  std::string text = robot.empty() ? name : fmt::format("{} of {}", name, robot);
  const std::vector<std::string> others = evaluate::other_truths(file);
  if (!others.empty())
    text += fmt::format(" (beside it: {}; --truth FILE takes another)", fmt::join(others, ", "));
  data.truth += (data.truth.empty() ? "" : "; ") + text;
}

core::Result<void> add_truth(const fs::path& truth, ReportData& data) {
  std::vector<std::pair<geometry::Trajectory, geometry::Trajectory>> pairs;
  for (const auto& [index, file] : truths_of(truth, data)) {
    ReportPath& path = data.paths[index];
    if (path.poses.empty()) continue;
    auto poses = dataset::read_trajectory(file);
    if (!poses) return tl::unexpected<core::Error>(poses.error());

    // Errors after rigid alignment.
    auto report = evaluate::evaluate_trajectory(path.poses, *poses);
    if (!report) {
      return core::input_error(fmt::format("--truth {}: {}", file.string(), report.error().message));
    }

    // Kept for the joint alignment.
    path.accuracy = std::move(*report);
    name_truth(path.robot, file, data);
    pairs.emplace_back(path.poses, std::move(*poses));
  }

  // The message names all files tried.
  if (pairs.empty()) {
    std::string looked_for = (truth / "groundtruth.txt").string();
    for (const ReportPath& path : data.paths) {
      if (!path.robot.empty()) looked_for += ", " + (truth / path.robot / "groundtruth.txt").string();
    }

    return core::input_error(
        fmt::format("--truth {}: there is no groundtruth.txt that fits; looked for {}; name a recording with "
                    "truth, a folder with one for each robot, named like it, or a file in TUM format",
                    truth.string(), looked_for));
  }

  // One alignment of all robots.
  if (pairs.size() > 1) data.joint_m = joint_error(pairs);
  return {};
}

std::string accuracy_html(const ReportData& data) {
  const bool measured =
      std::any_of(data.paths.begin(), data.paths.end(), [](const auto& p) { return p.accuracy.has_value(); });
  std::string out;
  if (measured) {
    out += paragraph("Compared with " + data.truth + ".") + errors_table(data) + error_chart(data);

    // Warnings of the evaluation.
    for (const ReportPath& path : data.paths) {
      if (!path.accuracy) continue;
      for (const std::string& warning : path.accuracy->warnings) {
        out += note((path.robot.empty() ? "" : path.robot + ": ") + warning + ".");
      }
    }

    // Terms of the table.
    out += note(
        "ATE: distance of the positions after rigid alignment (Horn 1987). RPE: error of the motion over a "
        "frame and over a second, rmse. The truth is good to what it was measured with.");
  }
  return out + saved_html(data);
}

}  // namespace plumbline::report
