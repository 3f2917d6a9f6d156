// SPDX-License-Identifier: BSD-3-Clause
// plumbline evaluate trajectory EST... GT
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "app.hpp"
#include "option_flags.hpp"
#include "paths.hpp"
#include "plumbline/dataset/recording_poses.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/evaluate/companions.hpp"
#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "plumbline/viz/trajectory_plots.hpp"
#include "terminal/print.hpp"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

struct TrajectoryRequest {
  std::vector<fs::path> files;  ///< estimates, then the truth
  fs::path frames;
  fs::path plots;
  bool json = false;
  evaluate::TrajectoryOptions options;
  OptionFlags flags;
};

/// Name of an estimate: its result folder or robot, else the file.
std::string estimate_name(const fs::path& file) {
  if (file.filename() == "trajectory.txt") return display_name(fs::absolute(file).parent_path());
  return file.stem().string();
}

/// Names of all estimates; the given paths if two would have the same name.
std::vector<std::string> estimate_names(const std::vector<fs::path>& given) {
  std::vector<std::string> names;
  names.reserve(given.size());
  for (const fs::path& path : given) names.push_back(estimate_name(file_in(path, "trajectory.txt")));
  std::vector<std::string> result = names;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::count(names.begin(), names.end(), names[i]) > 1) result[i] = given[i].string();
  }
  return result;
}

/// Charts of every estimate against its truth.
core::Result<void> write_plots(const std::vector<evaluate::NamedReport>& reports, const fs::path& folder) {
  std::vector<viz::TrajectoryComparison> comparisons;
  for (const evaluate::NamedReport& named : reports) {
    viz::TrajectoryComparison& comparison = comparisons.emplace_back();
    comparison.name = named.name;
    comparison.whole_truth = named.report.truth;
    for (const evaluate::PoseError& pose : named.report.poses) {
      comparison.estimate.push_back({pose.stamp, pose.estimate});
      comparison.truth.push_back({pose.stamp, pose.truth});
      comparison.error_m.push_back(pose.distance_m);
    }
  }
  return viz::write_trajectory_plots(comparisons, folder);
}

/// The error with both files in front, for it may be about either.
tl::unexpected<core::Error> about(const fs::path& estimate, const fs::path& truth, core::Error error) {
  error.message = fmt::format("{} against {}: {}", estimate.string(), truth.string(), error.message);
  return tl::unexpected<core::Error>(std::move(error));
}

/// The trajectory that a file or a result folder holds.
core::Result<dataset::TrajectoryReading> read_estimate(const fs::path& given) {
  const fs::path file = file_in(given, "trajectory.txt");
  std::error_code ignored;
  if (file == given || fs::exists(file, ignored)) return dataset::read_trajectory_file(file);

  const std::vector<fs::path> robots = maps::ResultFolder{given}.robot_folders();
  if (robots.size() == 1) return dataset::read_trajectory_file(robots.front() / "trajectory.txt");
  return core::input_error(
      fmt::format("{}: has a path for each of its {} robots; name one of them, such as {}", given.string(),
                  robots.size(), robots.front().string()));
}

/// Frames of the run that wrote a result folder; 0: not known.
std::size_t frames_of(const fs::path& result) {
  std::ifstream table(result / "frames.csv");
  std::size_t lines = 0;
  for (std::string line; std::getline(table, line);) ++lines;
  return lines > 0 ? lines - 1 : 0;
}

/// Components of a result that never joined its map, each measured by itself.
std::vector<evaluate::ComponentReport> measure_components(const fs::path& result,
                                                          const geometry::Trajectory& truth,
                                                          const evaluate::TrajectoryOptions& options) {
  // The components' folders, by name
  std::error_code ignored;
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(result / "components", ignored))
    folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());

  // Each is aligned by itself
  const std::size_t frames = frames_of(result);
  std::vector<evaluate::ComponentReport> components;
  for (const fs::path& folder : folders) {
    const auto way = dataset::read_trajectory(folder / "trajectory.txt");
    if (!way) continue;

    // Share of all frames, if they are counted
    evaluate::ComponentReport component;
    component.name = folder.filename().string();
    component.poses = way->size();
    if (frames > 0)
      component.percent = 100.0 * static_cast<double>(way->size()) / static_cast<double>(frames);
    if (const auto measured = evaluate::evaluate_trajectory(*way, truth, options))
      component.ate_m = measured->ate_m;
    components.push_back(std::move(component));
  }

  return components;
}

core::Result<std::vector<evaluate::NamedReport>> measure_paths(const TrajectoryRequest& request,
                                                               Console& console) {
  // The last file is the truth
  const std::vector<fs::path> estimates(request.files.begin(), std::prev(request.files.end()));
  const fs::path& given = request.files.back();
  const fs::path in_folder = file_in(given, "groundtruth.txt");
  std::error_code ignored;
  const bool by_layout = fs::is_directory(given, ignored) && !fs::exists(in_folder, ignored);

  // Truth from a recording, or from a file
  const fs::path& truth_file = by_layout ? given : in_folder;
  const auto truth =
      by_layout ? dataset::recording_poses(given, console) : dataset::read_trajectory_file(truth_file);
  if (!truth) return tl::unexpected<core::Error>(truth.error());
  for (const std::string& note : truth->notes)
    console.warning(fmt::format("{}: {}", truth_file.string(), note));

  // Other truths might have been meant
  const std::vector<std::string> others = evaluate::other_truths(truth_file);
  if (!others.empty()) {
    console.info(fmt::format("the truth is {}; beside it there are {}: name a file to take another",
                             truth_file.string(), fmt::join(others, ", ")));
  }

  // Frames for the share that was tracked
  std::vector<double> stamps;
  if (!request.frames.empty()) {
    auto read = evaluate::read_frame_stamps(request.frames);
    if (!read) return tl::unexpected<core::Error>(read.error());
    stamps = std::move(*read);
  }

  // Every estimate against its own truth
  const std::vector<std::string> names = estimate_names(estimates);
  std::vector<evaluate::NamedReport> reports;
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    const fs::path file = file_in(estimates[i], "trajectory.txt");
    auto estimate = read_estimate(estimates[i]);
    if (!estimate) return tl::unexpected<core::Error>(estimate.error());

    // KITTI has no stamps: poses are paired by number
    dataset::TrajectoryReading fitting_truth = *truth;
    if (auto paired = dataset::pair_by_number(*estimate, fitting_truth); !paired)
      return about(file, truth_file, paired.error());

    // Errors with the given alignment
    for (const std::string& note : estimate->notes)
      console.warning(fmt::format("{}: {}", file.string(), note));
    auto report =
        evaluate::evaluate_trajectory(estimate->poses, fitting_truth.poses, request.options, stamps);
    if (!report) return about(file, truth_file, report.error());

    evaluate::TrajectoryOptions of_components = request.options;
    if (report->body && report->body->removed)  // too short to fit it to
      of_components.body = evaluate::body_text(report->body->body_from_camera);
    report->components = measure_components(estimates[i], fitting_truth.poses, of_components);
    reports.push_back({names[i], std::move(*report)});
  }
  return reports;
}

core::Result<void> evaluate_paths(TrajectoryRequest& request, Console& console) {
  // All estimates are measured before anything is printed
  if (auto applied = request.flags.apply(); !applied) return applied;
  const auto reports = measure_paths(request, console);
  if (!reports) return tl::unexpected<core::Error>(reports.error());

  // Text for each, or warnings only
  const bool single = reports->size() == 1;
  for (const evaluate::NamedReport& named : *reports) {
    if (request.json) {  // the printed table contains them
      for (const std::string& warning : named.report.warnings) {
        console.warning(single ? warning : named.name + ": " + warning);
      }
      continue;
    }

    // A title for each of several paths
    print("{}{}\n", single ? "" : "== " + named.name + "\n", evaluate::to_text(named.report));
  }

  // One JSON document, or a table of all
  if (request.json) {
    print("{}", single ? evaluate::to_json(reports->front().report) : evaluate::to_json(*reports));
  } else if (!single) {
    print("{}", evaluate::to_text(*reports));
  }

  return request.plots.empty() ? core::Result<void>{} : write_plots(*reports, request.plots);
}

void add_trajectory(CLI::App& group, Session& session) {
  // Estimates and truth
  const auto request = std::make_shared<TrajectoryRequest>();
  CLI::App* command =
      add_command(group, session, "trajectory", "Absolute and relative pose error against truth",
                  [&session, request] { return evaluate_paths(*request, session.console()); });

  command
      ->add_option("EST... GT", request->files,
                   "One or more estimates (TUM, EuRoC or KITTI format, or result folders), then the true "
                   "poses (the same formats, or a recording)")
      ->required()
      ->expected(2, CLI::detail::expected_max_vector_size);

  // Frames and outputs
  command->add_option("--frames", request->frames, "The recording's rgb.txt, for the share of frames tracked")
      ->type_name("LIST");
  command->add_flag("--json", request->json, "Print JSON");
  command
      ->add_option("--plot", request->plots,
                   "Write charts into this folder as SVG: path, error, poses, error_distribution")
      ->type_name("DIR");
  request->flags.add(*command, request->options);
}

}  // namespace

void add_evaluate(CLI::App& app, Session& session) {
  CLI::App* group = add_group(app, "evaluate", "Measure a trajectory or a cloud against truth");
  add_trajectory(*group, session);
  add_evaluate_cloud(*group, session);
}

}  // namespace plumbline::cli
