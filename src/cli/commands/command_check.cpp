// SPDX-License-Identifier: BSD-3-Clause
// plumbline check PATH RECORDING
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "app.hpp"
#include "paths.hpp"
#include "plumbline/check/path_samples.hpp"
#include "plumbline/core/numbers.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/live.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/output_check.hpp"
#include "plumbline/maps/pose_samples.hpp"
#include "plumbline/maps/stored_run.hpp"
#include "plumbline/pipeline/camera_shifts.hpp"
#include "plumbline/pipeline/input.hpp"
#include "terminal/print.hpp"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

struct CheckRequest {
  fs::path path;
  std::string recording;
  fs::path json, samples;
  double max_dt_s = 0.005;
  dataset::OpenOptions open;
};

/// RMS of the standard deviations of keyframes' positions that a result states; 0: it states none.
double told_by(const fs::path& result) {
  // The table may lack the column
  std::ifstream table(result / "keyframes.csv");
  std::size_t column = std::string::npos;
  double sum = 0.0;
  std::size_t count = 0;

  // The header names the columns
  for (std::string line; std::getline(table, line);) {
    std::vector<std::string> cells;
    std::istringstream text(line);
    for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
    if (column == std::string::npos) {
      column =
          static_cast<std::size_t>(std::find(cells.begin(), cells.end(), "sigma_position") - cells.begin());
      continue;
    }

    // Rows without a value do not count
    const auto sigma = column < cells.size() ? core::to_number(cells[column]) : std::nullopt;
    if (!sigma || !std::isfinite(*sigma)) continue;
    sum += *sigma * *sigma;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
}

/// Shifts by the camera's covariance, of a result that kept its map; empty: not known.
std::vector<check::CameraShift> camera_of(const fs::path& result, const core::Executor& executor) {
  std::error_code ignored;
  if (!fs::is_regular_file(result / "map.db", ignored)) return {};
  const auto run = maps::StoredRun::open_main(result / "map.db");
  if (!run) return {};
  const maps::StoredMap& stored = run->stored();
  return pipeline::camera_shifts(stored.map, stored.frames, stored.header.robots, executor);
}

core::Result<std::unique_ptr<dataset::FrameSource>> open_for_check(const CheckRequest& request,
                                                                   Session& session) {
  if (dataset::is_live_address(request.recording))
    return core::usage_error(fmt::format("{}: is live; check needs a recording", request.recording));
  const auto pipelines = session.pipelines_folder();
  if (!pipelines) return tl::unexpected<core::Error>(pipelines.error());

  // A result says with which camera its recording is to be read.
  dataset::OpenOptions open = request.open;
  open.cameras_folder = *pipelines / "cameras";
  std::error_code ignored;
  const fs::path own = request.path / "camera.yaml";
  if (open.camera.empty() && fs::is_regular_file(own, ignored)) open.camera = own.string();
  return pipeline::open_input(request.recording, open, *pipelines / "scenes", session.executor(),
                              session.console());
}

/// The frames that the check needs, scaled down, and their numbers in `input`.
check::FrameStore keep_frames(const dataset::FrameSource& source, const CheckRequest& request,
                              Session& session, check::CheckInput& input) {
  // Frames that the check may use
  struct Wanted {
    std::size_t index;
    check::FrameChoice::Use use;
  };
  std::vector<Wanted> wanted;
  check::FrameChoice choice;

  // Frames with a pose that the choice takes.
  for (std::size_t i = 0; i < source.size(); ++i) {
    const double stamp = source.info(i).stamp;
    if (!check::has_pose(input.ways.front().path, stamp, request.max_dt_s)) continue;
    const check::FrameChoice::Use use = choice.next(stamp);
    if (use != check::FrameChoice::Use::kNone) wanted.push_back({i, use});
  }

  // A few are decoded in parallel and scaled down at once.
  check::FrameStore store(fs::temp_directory_path());
  constexpr std::size_t kChunk = 16;  // frames in memory
  for (std::size_t begin = 0; begin < wanted.size(); begin += kChunk) {
    std::vector<std::optional<check::SmallFrame>> chunk(std::min(kChunk, wanted.size() - begin));
    session.executor().parallel_for(chunk.size(), [&](std::size_t k) {
      const auto frame = source.read(wanted[begin + k].index);
      if (frame) chunk[k] = check::shrink(*frame, source.camera().color);
    });

    // Small frames go to a file
    for (std::size_t k = 0; k < chunk.size(); ++k) {
      if (!chunk[k]) continue;  // the others will do
      input.frames.push_back(
          {store.add(*chunk[k]), 0, chunk[k]->stamp, chunk[k]->depth_stamp, wanted[begin + k].use});
    }

    session.console().progress(begin + chunk.size(), wanted.size(), "frames");
  }

  session.console().end_progress();
  return store;
}

core::Result<check::CheckReport> check_recording(const CheckRequest& request, Session& session) {
  // Path and recording
  auto path = dataset::read_trajectory(file_in(request.path, "trajectory.txt"));
  if (!path) return tl::unexpected<core::Error>(path.error());
  auto source = open_for_check(request, session);
  if (!source) return tl::unexpected<core::Error>(source.error());

  // Camera and path as the check needs them
  check::CheckInput input;
  const sensor::Camera& camera = (*source)->camera();
  input.ways.push_back({camera.color, camera.readout_s.value_or(0.0), std::move(*path)});
  input.max_dt_s = request.max_dt_s;
  input.told_m = told_by(request.path);
  input.camera = camera_of(request.path, session.executor());

  // Frames that have a pose
  const check::FrameStore store = keep_frames(**source, request, session, input);
  if (input.frames.empty()) {
    return core::input_error(
        fmt::format("{}: no pose within {:g} s of a frame of {}; do the stamps belong together? A larger "
                    "--max-dt may help",
                    request.path.string(), request.max_dt_s, request.recording));
  }

  // Frames are read on demand
  input.read = [&store](std::size_t number) { return store.read(number); };
  auto report = check::check_path(input, session.executor());
  if (!report || request.samples.empty()) return report;

  // Errors that each pose may have.
  std::vector<maps::KeyframeSamples> samples;
  for (const geometry::StampedPose& pose : input.ways.front().path)
    samples.push_back({{0, static_cast<std::int32_t>(samples.size())}, check::samples_of(*report, 0, pose)});
  if (auto written = maps::write_pose_samples(request.samples, samples); !written)
    return tl::unexpected<core::Error>(written.error());
  return report;
}

/// Checks the outputs first; the exit code tells a bad path.
int check_and_tell(const CheckRequest& request, Session& session) {
  for (const fs::path& file : {request.json, request.samples}) {
    if (file.empty()) continue;
    if (auto fit = maps::check_output(file, {request.path, request.recording}); !fit)
      return session.fail(fit.error());
    if (auto fit = core::check_writable(file); !fit) return session.fail(fit.error());
  }

  const auto report = check_recording(request, session);
  if (!report) return session.fail(report.error());
  if (!session.quiet) print("{}", check::to_text(*report));
  if (!request.json.empty()) {
    if (auto written = core::write_file(request.json, check::to_json(*report)); !written)
      return session.fail(written.error());
  }
  return report->reasons.empty() ? 0 : static_cast<int>(core::ErrorKind::kUntrustworthy);
}

}  // namespace

void add_check(CLI::App& app, Session& session) {
  // The path
  const auto request = std::make_shared<CheckRequest>();
  CLI::App* command =
      add_command(app, session, "check", "Judge a path against its recording, without the truth",
                  [&session, request] { return check_and_tell(*request, session); });
  command
      ->add_option("PATH", request->path,
                   "The result of plumbline map, or a path by another program (TUM or EuRoC format)")
      ->required();

  // The recording, and how it is read.
  command->add_option("RECORDING", request->recording, "The recording that the path belongs to, as for map")
      ->required();
  command
      ->add_option("--camera", request->open.camera,
                   "Shipped calibration or file (default: the result's, else the recording's)")
      ->type_name("NAME|FILE");

  command->add_option("--format", request->open.format, "Layout of RECORDING (default: auto)")
      ->check(CLI::IsMember(dataset::layout_names()));
  command
      ->add_option("--max-dt", request->max_dt_s,
                   "A frame has a pose if the path has one at most so many seconds away (default: 0.005)")
      ->type_name("S")
      ->check(CLI::Range(1e-6, 10.0));

  // Outputs
  command->add_option("--json", request->json, "Also write the numbers into this file")->type_name("FILE");
  command
      ->add_option("--samples", request->samples,
                   "Also write 32 errors that each pose may have, drawn together (NumPy), into this file")
      ->type_name("FILE.npy");
  add_topic_option(*command, request->open);
  add_time_range(*command, request->open);
  add_progress_option(*command, session);
}

}  // namespace plumbline::cli
