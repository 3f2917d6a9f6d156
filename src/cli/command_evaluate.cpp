// SPDX-License-Identifier: BSD-3-Clause
// plumbline evaluate trajectory|cloud
#include <fmt/format.h>

#include <memory>
#include <system_error>
#include <vector>

#include "app.hpp"
#include "option_flags.hpp"
#include "paths.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/evaluate/cloud.hpp"
#include "plumbline/evaluate/companions.hpp"
#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/viz/trajectory_plots.hpp"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

/// The file itself, or `name` in it when it is a folder.
fs::path file_in(const fs::path& path, const char* name) {
  std::error_code ec;
  return fs::is_directory(path, ec) ? path / name : path;
}

// ---- trajectory

struct TrajectoryRequest {
  fs::path estimate;
  fs::path truth;
  fs::path frames;
  fs::path plots;
  bool json = false;
  evaluate::TrajectoryOptions options;
  core::OptionTable table;
  std::unique_ptr<OptionFlags> flags;
};

core::Result<void> write_plots(const evaluate::TrajectoryReport& report, const fs::path& folder,
                               const std::string& name) {
  viz::TrajectoryComparison comparison;
  comparison.name = name;
  for (const evaluate::PoseError& pose : report.poses) {
    comparison.estimate.push_back({pose.stamp, pose.estimate});
    comparison.truth.push_back({pose.stamp, pose.truth});
    comparison.error_m.push_back(pose.distance_m);
  }
  return viz::write_trajectory_plots(comparison, folder);
}

core::Result<void> evaluate_paths(TrajectoryRequest& request, Console& console) {
  if (auto applied = request.flags->apply(); !applied) return applied;
  const fs::path estimate_file = file_in(request.estimate, "trajectory.txt");
  const auto estimate = dataset::read_trajectory(estimate_file);
  if (!estimate) return tl::unexpected<core::Error>(estimate.error());
  const auto truth = dataset::read_trajectory(file_in(request.truth, "groundtruth.txt"));
  if (!truth) return tl::unexpected<core::Error>(truth.error());
  std::vector<double> stamps;
  if (!request.frames.empty()) {
    auto read = evaluate::read_frame_stamps(request.frames);
    if (!read) return tl::unexpected<core::Error>(read.error());
    stamps = std::move(*read);
  }
  const auto report = evaluate::evaluate_trajectory(*estimate, *truth, request.options, stamps);
  if (!report) return tl::unexpected<core::Error>(report.error());
  for (const std::string& warning : report->warnings) console.warning(warning);
  fmt::print("{}\n", request.json ? evaluate::to_json(*report) : evaluate::to_text(*report));
  if (request.plots.empty()) return {};
  return write_plots(*report, request.plots, display_name(estimate_file.parent_path()));
}

void add_trajectory(CLI::App& group, Session& session) {
  const auto request = std::make_shared<TrajectoryRequest>();
  request->options.declare(request->table);
  CLI::App* command = add_command(group, session, "trajectory",
                                  "Absolute and relative pose error against truth", [&session, request] {
                                    const auto done = evaluate_paths(*request, session.console());
                                    return done ? 0 : session.fail(done.error());
                                  });
  command->add_option("EST", request->estimate, "Estimated poses (TUM format), or a result folder")
      ->required();
  command->add_option("GT", request->truth, "True poses (TUM format), or a recording with groundtruth.txt")
      ->required();
  command->add_option("--frames", request->frames, "The recording's rgb.txt, for the share of frames tracked")
      ->type_name("LIST");
  command->add_flag("--json", request->json, "Print JSON");
  command->add_option("--plots", request->plots, "Write charts into this folder")->type_name("DIR");
  request->flags = std::make_unique<OptionFlags>(*command, request->table);
}

// ---- cloud

struct CloudRequest {
  fs::path cloud;
  fs::path reference;
  std::vector<fs::path> trajectories;
  std::vector<fs::path> truths;
  bool json = false;
  evaluate::CloudOptions options;
  core::OptionTable table;
  std::unique_ptr<OptionFlags> flags;
};

/// What the user named, else what lies beside cloud and reference.
core::Result<std::vector<evaluate::TrajectoryPair>> read_pairs(const CloudRequest& request,
                                                               const fs::path& cloud) {
  std::vector<evaluate::TrajectoryFiles> files;
  if (request.trajectories.size() != request.truths.size()) {
    return core::usage_error("--trajectory and --truth belong together: give as many of one as of the other");
  }
  for (std::size_t i = 0; i < request.trajectories.size(); ++i) {
    files.push_back({"", request.trajectories[i], request.truths[i]});
  }
  const bool aligns = request.options.align != evaluate::CloudAlignment::kNone && !request.reference.empty();
  if (files.empty() && aligns) files = evaluate::find_trajectories(cloud, request.reference);
  std::vector<evaluate::TrajectoryPair> pairs;
  for (const evaluate::TrajectoryFiles& pair : files) {
    auto estimate = dataset::read_trajectory(file_in(pair.estimate, "trajectory.txt"));
    if (!estimate) return tl::unexpected<core::Error>(estimate.error());
    auto truth = dataset::read_trajectory(file_in(pair.truth, "groundtruth.txt"));
    if (!truth) return tl::unexpected<core::Error>(truth.error());
    pairs.push_back({std::move(*estimate), std::move(*truth)});
  }
  return pairs;
}

core::Result<void> evaluate_surfaces(CloudRequest& request, Session& session) {
  if (auto applied = request.flags->apply(); !applied) return applied;
  const fs::path cloud_file = file_in(request.cloud, "map.ply");
  const auto cloud = evaluate::load_cloud(cloud_file);
  if (!cloud) return tl::unexpected<core::Error>(cloud.error());
  core::Result<evaluate::Reference> reference;
  if (!request.reference.empty()) {
    reference = evaluate::load_reference(file_in(request.reference, "reference.ply"));
    if (!reference) return tl::unexpected<core::Error>(reference.error());
  }
  const auto pairs = read_pairs(request, cloud_file);
  if (!pairs) return tl::unexpected<core::Error>(pairs.error());
  const auto report = evaluate::evaluate_cloud(*cloud, request.reference.empty() ? nullptr : &*reference,
                                               request.options, *pairs, session.executor());
  if (!report) return tl::unexpected<core::Error>(report.error());
  for (const std::string& warning : report->warnings) session.console().warning(warning);
  fmt::print("{}\n", request.json ? evaluate::to_json(*report) : evaluate::to_text(*report));
  return {};
}

void add_cloud(CLI::App& group, Session& session) {
  const auto request = std::make_shared<CloudRequest>();
  request->options.declare(request->table);
  CLI::App* command = add_command(group, session, "cloud",
                                  "Accuracy, completeness, wall thickness of a cloud", [&session, request] {
                                    const auto done = evaluate_surfaces(*request, session);
                                    return done ? 0 : session.fail(done.error());
                                  });
  command->add_option("CLOUD", request->cloud, "A PLY file, or a result folder")->required();
  command->add_option(
      "REFERENCE", request->reference,
      "The true surface (PLY, mesh or samples); without it only what the cloud tells of itself");
  command->add_option("--trajectory", request->trajectories, "Estimated path to start the alignment from")
      ->type_name("EST")
      ->allow_extra_args(false);
  command->add_option("--truth", request->truths, "Its truth, in the reference's frame")
      ->type_name("GT")
      ->allow_extra_args(false);
  command->add_flag("--json", request->json, "Print JSON");
  request->flags = std::make_unique<OptionFlags>(*command, request->table);
}

}  // namespace

void add_evaluate(CLI::App& app, Session& session) {
  CLI::App* group = add_group(app, "evaluate", "Measure a trajectory or a cloud against truth");
  add_trajectory(*group, session);
  add_cloud(*group, session);
}

}  // namespace plumbline::cli
