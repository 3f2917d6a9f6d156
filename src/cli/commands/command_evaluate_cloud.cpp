// SPDX-License-Identifier: BSD-3-Clause
// plumbline evaluate cloud CLOUD [REFERENCE]
#include <fmt/format.h>

#include <memory>
#include <vector>

#include "app.hpp"
#include "error_cloud.hpp"
#include "option_flags.hpp"
#include "paths.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/evaluate/cloud.hpp"
#include "plumbline/evaluate/companions.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "terminal/print.hpp"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

struct CloudRequest {
  fs::path cloud;
  fs::path reference;
  std::vector<fs::path> trajectories;
  std::vector<fs::path> truths;
  fs::path output;
  bool json = false;
  evaluate::CloudOptions options;
  OptionFlags flags;
  const CLI::App* command = nullptr;
};

/// Pairs of trajectories that the user named, else those beside cloud and reference.
core::Result<std::vector<evaluate::TrajectoryPair>> read_pairs(const CloudRequest& request,
                                                               const fs::path& cloud) {
  // Both lists must have the same length
  std::vector<evaluate::TrajectoryFiles> files;
  if (request.trajectories.size() != request.truths.size()) {
    return core::usage_error("--trajectory and --truth belong together: give as many of one as of the other");
  }
  for (std::size_t i = 0; i < request.trajectories.size(); ++i) {
    files.push_back({"", request.trajectories[i], request.truths[i]});
  }

  // Without names, trajectories near the clouds
  if (files.empty()) files = evaluate::find_trajectories(cloud, file_in(request.reference, "reference.ply"));
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

/// The upward direction in the reference's frame: the reference's, else that of the aligned cloud. None: the
/// picture estimates it, from the cameras' paths if there are any.
std::optional<Eigen::Vector3d> up_of(const evaluate::Reference& reference, const cloud::CloudFrame& of_cloud,
                                     const geometry::Rigid3& reference_from_cloud, bool cameras) {
  if (reference.frame.up() == cloud::Up::kZ) return Eigen::Vector3d::UnitZ();
  if (cameras || reference.frame.up() != cloud::Up::kUnknown || of_cloud.up() != cloud::Up::kZ)
    return std::nullopt;
  return Eigen::Vector3d(reference_from_cloud.rotation.col(2));
}

/// The cloud by its distance to the truth and, if that was sampled, the truth by its distance to the cloud.
core::Result<void> write_error_clouds(const evaluate::SurfaceSamples& cloud,
                                      const evaluate::Reference& reference,
                                      const evaluate::CloudReport& report,
                                      const std::vector<evaluate::TrajectoryPair>& pairs,
                                      const fs::path& folder) {
  // Cameras and coordinates of the reference
  const Eigen::Vector3d& shift = reference.shift;
  geometry::Rigid3 placed = report.alignment.reference_from_cloud;  // of the files' coordinates
  ErrorView view;
  view.up = up_of(reference, cloud.frame, placed, !pairs.empty());
  for (const evaluate::TrajectoryPair& pair : pairs) view.cameras.push_back(pair.truth);
  for (geometry::Trajectory& camera : view.cameras) {
    for (geometry::StampedPose& pose : camera) pose.world_from_camera.translation -= shift;
  }

  // The cloud, aligned with the reference
  evaluate::SurfaceSamples moved = cloud;
  placed.translation += placed.rotation * cloud.shift - shift;
  evaluate::move(placed, moved);
  moved.shift = shift;
  if (report.alignment.align != evaluate::CloudAlignment::kNone || reference.frame.known())
    moved.frame = reference.frame;

  // Accuracy, from the cloud's side
  if (auto done = write_error_cloud(folder / "accuracy", "Distance of the cloud to the reference", moved,
                                    report.error_m, view);
      !done) {
    return done;
  }

  // Completeness, from the reference's side
  return write_error_cloud(folder / "completeness", "Distance of the reference to the cloud",
                           {report.reference_samples, report.reference_normals, {}, shift, moved.frame},
                           report.reference_error_m, view);
}

core::Result<void> evaluate_surfaces(CloudRequest& request, Session& session) {
  // Options that imply or exclude each other
  if (auto applied = request.flags.apply(); !applied) return applied;
  if (!request.trajectories.empty() && request.command->count("--align") == 0) {
    request.options.align = evaluate::CloudAlignment::kSe3;  // a given start implies alignment
  }
  if (!request.output.empty() && request.reference.empty()) {
    return core::usage_error("-o: colours by error need a REFERENCE to measure against");
  }

  // The cloud in its own frame
  const fs::path cloud_file = file_in(request.cloud, "map.ply");
  auto cloud = evaluate::load_cloud(cloud_file);
  if (!cloud) return tl::unexpected<core::Error>(cloud.error());
  cloud->frame = maps::frame_of_cloud(cloud_file, cloud->frame);

  // The reference may be absent
  core::Result<evaluate::Reference> reference;
  if (!request.reference.empty()) {
    const fs::path file = file_in(request.reference, "reference.ply");
    reference = evaluate::load_reference(file);
    if (!reference) return tl::unexpected<core::Error>(reference.error());
    reference->frame = maps::frame_of_cloud(file, reference->frame);
  }

  // Trajectories start the alignment or set the view
  std::vector<evaluate::TrajectoryPair> pairs;
  const bool aligns = request.options.align != evaluate::CloudAlignment::kNone;
  if (!request.reference.empty() &&
      (aligns || !request.output.empty() || !request.trajectories.empty() || !request.truths.empty())) {
    auto read = read_pairs(request, cloud_file);
    if (!read) return tl::unexpected<core::Error>(read.error());
    pairs = std::move(*read);
  }

  // All measures at once
  if (!cloud->shift.isZero(0.0)) session.console().info("shift: " + shift_text(cloud->shift));
  const auto report = evaluate::evaluate_cloud(*cloud, request.reference.empty() ? nullptr : &*reference,
                                               request.options, pairs, session.executor());
  if (!report) {  // not about the reference, which has been read
    core::Error error = report.error();
    error.message = fmt::format("{}: {}", cloud_file.string(), error.message);
    return tl::unexpected<core::Error>(std::move(error));
  }

  // JSON keeps standard output, warnings use stderr
  if (request.json) {  // the printed table contains them
    for (const std::string& warning : report->warnings) session.console().warning(warning);
  }
  print("{}", request.json ? evaluate::to_json(*report) : evaluate::to_text(*report));
  if (!request.output.empty()) {
    auto done = write_error_clouds(*cloud, *reference, *report, pairs, request.output);
    if (!done) return done;
  }

  // A failed alignment is no measurement
  if (!report->alignment.failed) return {};
  return core::failure(core::ErrorKind::kUntrustworthy,
                       fmt::format("{}: could not be aligned with {}", cloud_file.string(), reference->name));
}

}  // namespace

void add_evaluate_cloud(CLI::App& group, Session& session) {
  // Cloud and reference
  const auto request = std::make_shared<CloudRequest>();
  CLI::App* command =
      add_command(group, session, "cloud", "Accuracy, completeness, wall thickness of a cloud",
                  [&session, request] { return evaluate_surfaces(*request, session); });
  command->add_option("CLOUD", request->cloud, "PLY file or result folder")->required();
  command->add_option("REFERENCE", request->reference,
                      "True surface (PLY, mesh or samples); without it only measures of the cloud itself");

  // Paths to start from
  command
      ->add_option("--trajectory", request->trajectories,
                   "Estimated path to start the alignment from; sets --align to se3 unless it is given")
      ->type_name("EST")
      ->allow_extra_args(false);
  command->add_option("--truth", request->truths, "True path, in the reference's frame")
      ->type_name("GT")
      ->allow_extra_args(false);

  // Outputs and options
  command
      ->add_option("-o,--output", request->output,
                   "Write clouds coloured by error and pictures of them into this folder: "
                   "accuracy.{ply,png}, completeness.{ply,png}")
      ->type_name("DIR");
  command->add_flag("--json", request->json, "Print JSON");
  request->flags.add(*command, request->options);
  request->command = command;
}

}  // namespace plumbline::cli
