// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/synth/recording.hpp"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "plumbline/core/json.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/image_io.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "recording/body_sensors.hpp"
#include "recording/mcap_film.hpp"
#include "recording/plan_file.hpp"
#include "recording/reference.hpp"
#include "recording/scene_file.hpp"
#include "recording/truth_files.hpp"
#include "render/world.hpp"
#include "scene/random.hpp"
#include "scene/rig.hpp"

namespace plumbline::synth {

namespace {

namespace fs = std::filesystem;
using core::Result;

std::string color_name(const dataset::PairInfo& info) { return fmt::format("rgb/{:.6f}.png", info.stamp); }
std::string depth_name(const dataset::PairInfo& info) {
  return fmt::format("depth/{:.6f}.png", info.depth_stamp);
}

/// Stamps as the files have them.
dataset::PairInfo labelled(const SynthSource& source, std::size_t index) {
  dataset::PairInfo info = source.true_info(index);
  info.depth_stamp -= source.true_camera().depth_delay_s;
  return info;
}

/// Makes a file that is the same as another one.
Result<void> repeat_file(const fs::path& from, const fs::path& to) {
  std::error_code ec;
  fs::create_hard_link(from, to, ec);
  if (ec) fs::copy_file(from, to, ec);  // disks of some kinds have no links
  if (ec) return core::output_error(fmt::format("{}: cannot be written: {}", to.string(), ec.message()));
  return {};
}

/// Share of a colour picture that moves; its mask is written if asked.
Result<double> write_moving(const SynthSource& source, std::size_t index, const fs::path& folder, bool mask) {
  cv::Mat1b moves = source.moving(index);
  const double share = moves.empty() ? 0.0 : cv::countNonZero(moves) / static_cast<double>(moves.total());
  if (!mask) return share;
  const sensor::Pinhole& size = source.camera().color;
  if (moves.empty()) moves = cv::Mat1b::zeros(size.height, size.width);
  const std::string name = color_name(labelled(source, index)).substr(4);
  if (auto ok = dataset::write_png(folder / "moving" / name, moves); !ok)
    return tl::unexpected<core::Error>(ok.error());
  return share;
}

/// Writes one pair; "" or what went wrong.
std::string write_pair(const SynthSource& source, std::size_t index, const fs::path& folder) {
  const dataset::PairInfo info = labelled(source, index);
  Result<void> written;
  if (index >= source.round()) {
    const dataset::PairInfo first = labelled(source, index % source.round());
    written = repeat_file(folder / color_name(first), folder / color_name(info));
    if (written) written = repeat_file(folder / depth_name(first), folder / depth_name(info));
    return written ? "" : written.error().message;
  }

  const dataset::StoredPair pair = source.rendered(index);
  written = dataset::write_png(folder / color_name(info), pair.color.pixels);
  if (written) written = dataset::write_png(folder / depth_name(info), pair.depth.pixels);
  return written ? "" : written.error().message;
}

/// Lists, truth and camera of the first `frames` pairs.
Result<void> write_lists(const SynthSource& source, std::size_t frames, const fs::path& folder,
                         bool pictures) {
  std::string color = "# timestamp filename\n", depth = color, pairs;
  geometry::Trajectory truth;

  // Stamps and names of each pair.
  for (std::size_t i = 0; i < frames; ++i) {
    const dataset::PairInfo info = labelled(source, i);
    color += fmt::format("{:.6f} {}\n", info.stamp, color_name(info));
    depth += fmt::format("{:.6f} {}\n", info.depth_stamp, depth_name(info));
    pairs += fmt::format("{:.6f} {} {:.6f} {}\n", info.stamp, color_name(info), info.depth_stamp,
                         depth_name(info));
    truth.push_back({info.stamp, source.world_from_camera(info.stamp)});

    // Truth at both stamps of a pair.
    const double depth_taken = source.true_info(i).depth_stamp;
    if (depth_taken != info.stamp) truth.push_back({depth_taken, source.world_from_camera(depth_taken)});
  }

  // Depth may be older than colour.
  std::sort(truth.begin(), truth.end(),
            [](const geometry::StampedPose& a, const geometry::StampedPose& b) { return a.stamp < b.stamp; });
  if (pictures) {
    if (auto ok = core::write_file(folder / "rgb.txt", color); !ok) return ok;
    if (auto ok = core::write_file(folder / "depth.txt", depth); !ok) return ok;
    if (auto ok = core::write_file(folder / "associations.txt", pairs); !ok) return ok;
  }
  if (auto ok = core::write_file(folder / "camera.yaml", sensor::to_yaml(source.camera())); !ok) return ok;

  return dataset::write_trajectory(folder / "groundtruth.txt", truth);
}

/// Writes pictures; returns the number of frames, smaller than the total if stopped.
Result<std::size_t> write_pictures(const RecordingJob& job) {
  const std::size_t batch = static_cast<std::size_t>(job.run.executor.threads()) * 4;
  std::size_t done = 0;

  while (done < job.source.size() && !job.run.stop.stop_requested()) {
    // The first round is written before it is repeated.
    const std::size_t end = done < job.source.round() ? job.source.round() : job.source.size();
    const std::size_t count = std::min(batch, end - done);
    std::vector<std::string> problems(count);
    job.run.executor.parallel_for(
        count, [&](std::size_t i) { problems[i] = write_pair(job.source, done + i, job.folder); });

    // The first problem ends the recording.
    for (const std::string& problem : problems) {
      if (!problem.empty()) return core::output_error(problem);
    }
    done += count;
    job.progress(done, job.source.size());
  }

  return done;
}

/// Truth beside the first `frames` frames.
Result<void> write_truth(const RecordingJob& job, std::size_t frames) {
  // Share of moving pixels, once per round.
  const std::size_t round = std::min(frames, job.source.round());
  std::vector<Result<double>> shares(round, 0.0);
  job.run.executor.parallel_for(round, [&](std::size_t i) {
    shares[i] = write_moving(job.source, i, job.folder, job.options.moving_masks);
  });

  // One failed frame fails all.
  std::vector<double> moving;
  for (const auto& share : shares) {
    if (!share) return tl::unexpected<core::Error>(share.error());
    moving.push_back(*share);
  }

  // Later rounds repeat the first one.
  const auto mask = [&](std::size_t i) {
    return job.folder / "moving" / color_name(labelled(job.source, i)).substr(4);
  };
  for (std::size_t i = round; i < frames; ++i) {
    moving.push_back(moving[i % round]);
    if (!job.options.moving_masks) continue;
    if (auto done = repeat_file(mask(i % round), mask(i)); !done) return done;
  }

  // Lists, truth and, if there are any, events.
  auto ok = write_lists(job.source, frames, job.folder, !job.options.mcap);
  if (ok) ok = core::write_file(job.folder / "truth.csv", describe_truth(job.source, moving));
  if (ok && !(job.source.events().empty() && job.source.swings().empty()))
    ok = core::write_file(job.folder / "events.csv", describe_events(job.source));
  if (ok && !job.options.camera_error.empty())
    ok = core::write_file(job.folder / "camera.true.yaml", sensor::to_yaml(job.source.true_camera()));
  return ok;
}

/// Returns the number of frames written; smaller than the total if stopped.
Result<std::size_t> write_frames(const RecordingJob& job) {
  auto ok = core::make_folder(job.folder);
  for (const auto& [sub, wanted] :
       {std::pair("rgb", !job.options.mcap), std::pair("depth", !job.options.mcap),
        std::pair("moving", job.options.moving_masks)}) {
    if (ok && wanted) ok = core::make_folder(job.folder / sub);
  }
  if (!ok) return tl::unexpected<core::Error>(ok.error());

  // Sensors of the body.
  dataset::BodyReadings body;
  body.body_from_camera = job.source.body_from_camera();
  if (!job.options.imu.empty()) body.imu = imu_readings(job.source, *imu_model(job.options.imu), job.seed);
  if (!job.options.odometry.empty())
    body.odometry = odometry_readings(job.source, *odometry_model(job.options.odometry), job.seed);
  if (!body.imu.empty()) ok = core::write_file(job.folder / "imu.csv", describe_imu(body.imu));
  if (ok && !body.odometry.empty())
    ok = core::write_file(job.folder / "odometry.csv", describe_odometry(body.odometry));
  if (!ok) return tl::unexpected<core::Error>(ok.error());

  // Pictures, in one file or in many.
  auto done = job.options.mcap ? write_mcap(job, job.folder / "recording.mcap", body) : write_pictures(job);
  if (!done) return done;

  // Truth of the frames written, even if stopped.
  if (ok = write_truth(job, *done); !ok) return tl::unexpected<core::Error>(ok.error());
  return done;
}

std::string folder_name(int robot) { return fmt::format("robot{}", robot); }

Result<void> check_free(const fs::path& output) {
  // An earlier recording must not be overwritten.
  for (const fs::path& file : {output / "scene.json", output / folder_name(0)}) {
    if (fs::exists(file)) {
      return core::output_error(
          fmt::format("{}: exists already; choose another folder or remove it", file.string()));
    }
  }
  return {};
}

/// One source per recording.
Result<std::vector<std::unique_ptr<SynthSource>>> open_all(const std::shared_ptr<const World>& world) {
  std::vector<std::unique_ptr<SynthSource>> sources;
  for (int i = 0; i < recordings(world->options); ++i) {
    auto source = SynthSource::create(world, i);
    if (!source) return tl::unexpected<core::Error>(source.error());
    sources.push_back(std::move(*source));
  }
  return sources;
}

/// Writes the recording of each robot; returns their entries in scene.json.
Result<nlohmann::json> write_robots(const WriteRequest& request,
                                    const std::vector<std::unique_ptr<SynthSource>>& sources,
                                    const RecordingRun& run, const Progress& progress,
                                    WriteSummary& summary) {
  const Scene& scene = request.scene;
  const SynthOptions& options = request.options;
  summary.robots = static_cast<int>(sources.size());
  std::size_t all_frames = 0;
  for (const auto& source : sources) all_frames += source->size();
  const auto start = std::chrono::steady_clock::now();
  nlohmann::json robots = nlohmann::json::array();

  for (std::size_t i = 0; i < sources.size() && !run.stop.stop_requested(); ++i) {
    const std::string folder = folder_name(static_cast<int>(i));
    const std::size_t before = summary.frames;

    // Progress counts the frames of all recordings.
    const RecordingJob job{*sources[i],
                           options,
                           request.output / folder,
                           mix(static_cast<std::uint64_t>(options.seed), options.rig.empty() ? i + 1 : 1),
                           run,
                           [&](std::size_t done, std::size_t) {
                             if (progress) progress(before + done, all_frames);
                           }};

    const auto written = write_frames(job);
    if (!written) return tl::unexpected<core::Error>(written.error());
    summary.frames += *written;
    summary.path_m += sources[i]->path_length();
    robots.push_back(describe_robot(*sources[i], folder,
                                    scene.robots[options.rig.empty() ? i % scene.robots.size() : 0].name,
                                    *written, options, job.seed));
  }

  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return robots;
}

/// Shares of a plan's walls and openings that were seen; their objects are in the order of the plan.
PlanCoverage cover(const Scene& scene, const Visibility& visibility, const ReferenceCounts& counts) {
  PlanCoverage coverage;
  coverage.all = static_cast<double>(counts.visible) / std::max(1.0, static_cast<double>(counts.samples));

  struct Sum {
    double area = 0.0, seen = 0.0;
    int faces = 0;
  };
  std::vector<Sum> sums(scene.objects.size());
  for (std::size_t i = 0; i < scene.faces.size(); ++i) {
    const auto object = static_cast<std::size_t>(scene.faces[i].object);
    Sum& sum = sums[object];
    const bool opening = scene.objects[object].type == "opening";
    const double area = scene.faces[i].bounds().volume();

    // The first two faces of an opening are its jambs; narrow faces of a wall are skirting and casings.
    if (opening ? sum.faces++ > 1 : scene.faces[i].bounds().sizes().minCoeff() < 0.1) continue;
    sum.area += area;
    sum.seen += area * visibility.seen_share(i);
  }

  // Shares by area, in the order of the objects.
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double share = sums[i].area > 0.0 ? sums[i].seen / sums[i].area : 0.0;
    if (scene.objects[i].type == "wall") coverage.wall_faces.push_back(share);
    if (scene.objects[i].type == "opening") coverage.jambs.push_back(share);
  }
  return coverage;
}

/// The true plan, if the scene has one.
Result<void> write_plan(const Scene& scene, const std::vector<std::unique_ptr<SynthSource>>& sources,
                        const std::optional<PlanCoverage>& coverage, const fs::path& output) {
  if (!scene.plan) return {};
  std::vector<geometry::Rigid3> starts;
  starts.reserve(sources.size());
  for (const auto& source : sources) starts.push_back(source->world_from_camera(source->info(0).stamp));
  return core::write_file(output / "plan.json", describe_plan(*scene.plan, starts, coverage));
}

/// The truth about a rig and about changes, to map with or to judge what was found.
Result<void> write_settings(const WriteRequest& request,
                            const std::vector<std::unique_ptr<SynthSource>>& sources) {
  const auto& [scene, options, output] = request;
  if (!options.changes.empty()) {
    if (auto ok = core::write_file(output / "changes.json", describe_changes(scene)); !ok) return ok;
  }
  if (options.rig.empty() || sources.size() < 2) return {};

  std::vector<std::string> folders;
  for (int i = 0; i < static_cast<int>(sources.size()); ++i) folders.push_back(folder_name(i));
  return core::write_file(output / "rig.yaml", describe_rig(sources, folders));
}

}  // namespace

Result<WriteSummary> write_recordings(const WriteRequest& request, const core::Executor& executor,
                                      const core::StopToken& stop, core::Log& log, const Progress& progress) {
  const auto& [scene, options, output] = request;
  const auto fail = [](const core::Error& e) { return tl::unexpected<core::Error>(e); };

  // Refused before any work is done.
  if (auto ok = check_free(output); !ok) return fail(ok.error());
  auto world = build_world(scene, options, executor);
  if (!world) return fail(world.error());
  auto sources = open_all(*world);
  if (!sources) return fail(sources.error());
  if (auto ok = check_free(output); !ok) return fail(ok.error());  // building the world took its time
  if (auto ok = core::make_folder(output); !ok) return fail(ok.error());

  // All recordings, then the surfaces that they saw.
  WriteSummary summary;
  const auto robots = write_robots(request, *sources, {executor, stop, log}, progress, summary);
  if (!robots) return fail(robots.error());
  summary.reference_spacing_m =
      options.reference_spacing > 0.0 ? options.reference_spacing : default_spacing(scene);

  // A stopped run has no reference.
  std::optional<PlanCoverage> coverage;
  if (!stop.stop_requested()) {
    Visibility visibility(*world, summary.reference_spacing_m);
    for (const auto& source : *sources) visibility.add(*source, executor, stop);
    const auto counts =
        write_reference(output / "reference.ply", **world, visibility, summary.reference_spacing_m, executor);

    if (!counts) return fail(counts.error());
    summary.reference_samples = counts->samples;
    summary.reference_visible = counts->visible;
    if (scene.plan) coverage = cover(scene, visibility, *counts);
    for (const double seen : coverage ? coverage->jambs : std::vector<double>{}) {
      ++summary.openings;
      summary.openings_seen += seen >= 0.5 ? 1 : 0;
    }
  }
  if (auto ok = write_plan(scene, *sources, coverage, output); !ok) return fail(ok.error());

  if (auto ok = write_settings(request, *sources); !ok) return fail(ok.error());

  // Written last, with the state of the run.
  summary.stopped = stop.stop_requested();
  const std::string json = core::json_text(describe_world((*world)->scene, options, summary, *robots));
  if (auto ok = core::write_file(output / "scene.json", json); !ok) return fail(ok.error());

  // A summary for the user.
  log.info(fmt::format("{}: {} frames of {} robot(s) in {:.1f} s, {} reference samples ({} visible)",
                       scene.name, summary.frames, summary.robots, summary.wall_s, summary.reference_samples,
                       summary.reference_visible));
  return summary;
}

}  // namespace plumbline::synth
