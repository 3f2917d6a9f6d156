// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/map_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <system_error>
#include <tuple>
#include <utility>

#include "graph/graph_parts.hpp"
#include "plumbline/core/hash.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/shortage.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/dataset/live.hpp"
#include "plumbline/localize/localization_map.hpp"
#include "plumbline/maps/output_folder.hpp"
#include "plumbline/pipeline/graph.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/pipeline/rig.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "results/debug_video.hpp"
#include "results/resumed_run.hpp"
#include "results/waiting_clouds.hpp"
#include "robots/camera_refinement.hpp"
#include "run/result.hpp"
#include "run/run_summary.hpp"
#include "visits/map_into.hpp"

namespace plumbline::pipeline {
namespace {

/// The current folder as seen from the result, for whoever looks for the recordings from another one; "":
/// none has a relative path.
std::string folder_from_result(const MapRequest& request) {
  std::error_code ec;
  const auto is_relative = [&](const std::string& input) {
    return std::filesystem::path(input).is_relative() && std::filesystem::exists(input, ec);
  };
  if (!is_relative(request.input) &&
      std::none_of(request.others.begin(), request.others.end(), is_relative)) {
    return "";
  }
  const std::filesystem::path result = std::filesystem::absolute(request.output, ec);
  return std::filesystem::relative(std::filesystem::current_path(ec), result, ec).string();
}

/// The effective configuration: a pipeline file that gives the same result again, and how it was run;
/// `threads` 0: left out.
std::string config_text(const MapRequest& request, const Graph& graph, int threads) {
  std::string text = fmt::format(
      "# What plumbline {} ran with. A pipeline file itself: plumbline map INPUT -p config.yaml\n",
      core::version());
  text += "run:\n";
  text += fmt::format("  input: {}\n  pipeline: {}\n", quoted(request.input), quoted(request.pipeline));

  if (!request.known_map.empty()) text += fmt::format("  map: {}\n", quoted(request.known_map.string()));
  if (!request.into.empty()) {
    text += fmt::format("  into: {}\n  contents_of_map: {}\n", quoted(request.into.string()),
                        request.into_contents);
  }

  // Relative paths of recordings are of use only together with the folder in which the program was run.
  if (const std::string folder = folder_from_result(request); !folder.empty()) {
    text += fmt::format("  folder: {}  # in which the program was run, seen from this one\n", quoted(folder));
  }

  for (std::size_t i = 0; i < request.others.size(); ++i) {
    text += fmt::format("  input{}: {}\n", i + 2, quoted(request.others[i]));
  }

  text +=
      fmt::format("  camera: {}\n  format: {}\n", quoted(request.open.camera), quoted(request.open.format));
  text += fmt::format("  from: {} s\n", request.open.from_s);
  constexpr double kWhole_s = 1e299;
  if (request.open.to_s < kWhole_s) text += fmt::format("  to: {} s\n", request.open.to_s);
  text += fmt::format("  every: {}\n", request.open.every);

  const dataset::TopicNames& topics = request.open.topics;
  const std::pair<const char*, const std::string&> named[] = {{"color", topics.color},
                                                              {"depth", topics.depth},
                                                              {"info", topics.info},
                                                              {"depth_info", topics.depth_info}};

  for (const auto& [what, topic] : named) {
    if (!topic.empty()) text += fmt::format("  topic_{}: {}\n", what, quoted(topic));
  }

  if (request.live != nullptr) text += "  fed: on\n";
  if (request.feedback != nullptr) text += "  feedback: on\n";
  if (request.open.poses == dataset::PoseUse::kIgnore) text += "  poses: ignore\n";
  // A run that ended because the rig could not be found is continued with more in rig.yaml.
  if (threads > 0 && !request.rig.empty()) text += fmt::format("  rig: {}\n", quoted(request.rig.string()));

  // The number of threads does not change a result, so a resumed run may have another one.
  if (threads > 0) text += fmt::format("  threads: {}\n", threads);
  return text + to_yaml(graph);
}

/// Text that identifies a recording without reading its images.
std::string input_text(const RobotRecordings& source) {
  if (source.live() != nullptr) return "live: " + quoted(source.name()) + "\n";
  core::Hash hash;
  for (std::size_t i = 0; i < source.size(); ++i) hash.number(source.info(i).stamp);
  std::string text = fmt::format("frames: {}\n", source.size());
  if (source.size() > 0) {
    text += fmt::format("first: {:.6f} s\nlast: {:.6f} s\n", source.info(0).stamp,
                        source.info(source.size() - 1).stamp);
  }
  text += fmt::format("stamps: {:016x}\n", hash.value());
  for (const RobotInfo& robot : source.robots()) {
    if (robot.camera.depth_delay_s != 0.0)
      text += fmt::format("depth_delay: {} s\n", robot.camera.depth_delay_s);
  }
  return text;
}

/// The same request for any order of its recordings: sorted by name, and by folder for equal names. Error
/// (kUsage): one is given twice.
core::Result<MapRequest> in_order(MapRequest request) {
  if (request.others.empty()) return request;
  struct Input {
    std::string name;
    std::string folder;
    std::string given;
  };

  // The order of the recordings numbers the robots: sorted, the same recordings always give the same map.
  std::vector<Input> inputs;
  request.others.push_back(request.input);
  for (const std::string& given : request.others) {
    if (given.empty()) return core::usage_error("the path of a recording is empty");
    std::error_code ec;
    const std::filesystem::path folder = std::filesystem::weakly_canonical(given, ec);
    inputs.push_back({folder.filename().string(), folder.string(), given});
  }

  std::sort(inputs.begin(), inputs.end(), [](const Input& a, const Input& b) {
    return std::tie(a.name, a.folder, a.given) < std::tie(b.name, b.folder, b.given);
  });

  // A recording given twice would be two robots on one path, which agree everywhere and prove nothing.
  const auto place = [](const Input& input) {
    return std::filesystem::absolute(input.given).lexically_normal();
  };
  const auto twice = std::adjacent_find(inputs.begin(), inputs.end(),
                                        [&](const Input& a, const Input& b) { return place(a) == place(b); });
  if (twice != inputs.end()) return core::usage_error(fmt::format("{}: is given twice", twice->given));

  request.input = inputs.front().given;
  for (std::size_t i = 1; i < inputs.size(); ++i) request.others[i - 1] = inputs[i].given;
  request.others.pop_back();
  return request;
}

core::Result<std::unique_ptr<RobotRecordings>> open_inputs(const MapRequest& request,
                                                           const core::Executor& executor, core::Log& log) {
  if (request.live != nullptr) {
    std::vector<std::unique_ptr<dataset::FrameSource>> one;
    one.push_back(request.live->recording());
    return std::make_unique<RobotRecordings>(std::move(one));
  }

  const std::filesystem::path scenes = request.pipelines_folder / "scenes";
  std::vector<std::string> inputs{request.input};
  inputs.insert(inputs.end(), request.others.begin(), request.others.end());

  // Frames of several robots are put in order by their stamps before the run; those of a live camera are not
  // known then.
  for (const std::string& input : inputs) {
    if (inputs.size() > 1 && dataset::is_live_address(input)) {
      return core::usage_error(fmt::format(
          "{}: is live and must be mapped alone; run one process per robot: plumbline robot, plumbline hub",
          input));
    }
  }

  std::vector<std::unique_ptr<dataset::FrameSource>> all;
  for (const std::string& input : inputs) {
    dataset::OpenOptions open = request.open;
    open.cameras_folder = request.pipelines_folder / "cameras";
    auto recording = open_input(input, open, scenes, executor, log);
    if (!recording) return tl::unexpected(recording.error());
    all.push_back(std::move(*recording));
  }

  return std::make_unique<RobotRecordings>(std::move(all));
}

template <typename Question>
bool any_stage(const Graph& graph, Question question) {
  return std::any_of(graph.nodes.begin(), graph.nodes.end(),
                     [&](const Node& node) { return (node.stage.get()->*question)(); });
}

/// Checks that the pipeline supports the request.
core::Result<void> fits(const Graph& graph, const MapRequest& request) {
  if (!request.debug_video.empty() && !any_stage(graph, &Stage::draws_frames)) {
    return core::usage_error(
        fmt::format("{}: has no track stage to draw; leave out --debug-video", graph.file.string()));
  }

  if (request.open.poses == dataset::PoseUse::kGiven && !any_stage(graph, &Stage::takes_given_poses)) {
    return core::usage_error(
        fmt::format("{}: has no stage 'poses' for given poses; leave out --poses given, "
                    "or the pipeline",
                    graph.file.string()));
  }

  // The stage and the map belong together: one without the other is a mistake in the command.
  if (any_stage(graph, &Stage::knows_map) != !request.known_map.empty()) {
    return core::usage_error(fmt::format(
        request.known_map.empty() ? "{}: locates a camera in a map; it is run by plumbline localize"
                                  : "{}: has no localize stage; plumbline localize needs one",
        graph.file.string()));
  }

  if (!request.rig.empty() && !any_stage(graph, &Stage::takes_rig)) {
    return core::usage_error(fmt::format(
        "{}: has no merge stage to join the cameras of --rig; choose another pipeline", graph.file.string()));
  }

  if (graph.source().stage->reads_maps()) {
    return core::usage_error(
        fmt::format("{}: begins with finished maps; it is run by plumbline fuse", graph.file.string()));
  }

  return {};
}

core::Result<void> fits_live(const MapRequest& request) {
  if (request.live != nullptr && request.resume) {
    return core::usage_error("with frames fed one by one an earlier run cannot be resumed");
  }
  if (!dataset::is_live_address(request.input)) return {};
  const char* wrong = request.resume ? "--resume" : request.pace_hz > 0.0 ? "--pace" : nullptr;
  if (wrong == nullptr) return {};
  return core::usage_error(fmt::format("{}: is live; {} is for recordings", request.input, wrong));
}

core::Result<void> can_resume(const Graph& graph, const MapRequest& request) {
  if (!request.resume) return {};
  if (!any_stage(graph, &Stage::keeps_map) || !any_stage(graph, &Stage::resumes)) {
    return core::usage_error(
        fmt::format("{}: keeps no map.db to continue from; it takes a track stage and a store stage, or "
                    "leave out --resume",
                    graph.file.string()));
  }
  if (!request.debug_video.empty()) {
    return core::usage_error(
        "--debug-video: an earlier run's frames cannot be drawn; leave it out with --resume");
  }
  return {};
}

void report_resumed(const std::filesystem::path& folder, const std::optional<ResumedRun>& run,
                    core::Log& log) {
  log.info(
      run ? fmt::format("continuing after {} frames, with {} keyframes of {}", run->frames, run->keyframes,
                        run->store.string())
          : fmt::format("{}: there is nothing to continue; starting with the first frame", folder.string()));
}

/// Keeps what a failed run has stored, and adds that to the error.
core::Error with_what_is_kept(core::Error error, maps::OutputFolder& output) {
  error = output.explained(std::move(error));
  const std::size_t keyframes = stored_keyframes(output.path());
  if (keyframes == 0) return error;
  output.keep();
  error.message += fmt::format("; {} keyframes are kept in {}: --resume continues from there", keyframes,
                               (output.path() / maps::kStoreFile).string());
  return error;
}

/// A recording from its first frame to its last.
class MapRun {
 public:
  MapRun(const MapRequest& request, const core::Executor& executor, core::Log& log)
      : request_(request), executor_(executor), log_(log) {}

  /// Checks everything and starts nothing.
  core::Result<void> open() {
    auto graph = load_pipeline(request_);
    if (!graph) return tl::unexpected(graph.error());
    graph_ = std::move(*graph);
    if (auto can = fits(graph_, request_); !can) return can;
    if (auto can = fits_live(request_); !can) return can;
    if (!request_.known_map.empty()) {
      auto known = localize::open_localization_map(request_.known_map);
      if (!known) return tl::unexpected(known.error());
      known_map_ = std::make_shared<localize::LocalizationMap>(std::move(*known));
    }
    auto source = open_inputs(request_, executor_, log_);
    if (!source) return tl::unexpected(source.error());
    source_ = std::move(*source);
    auto rig = rig_of_run(request_.rig, source_->robots());
    if (!rig) return tl::unexpected(rig.error());
    rig_ = std::move(*rig);
    return can_resume(graph_, request_);
  }

  core::Result<RunSummary> run(const core::StopToken& stop, const Progress& progress,
                               RunClock::time_point began) {
    try {
      return map(stop, progress, began);
    } catch (const std::exception& e) {
      core::Error error = core::error_of(e);
      if (output_) error = with_what_is_kept(std::move(error), *output_);
      if (error.kind == core::ErrorKind::kInternal) throw;
      return tl::unexpected(error);
    }
  }

 private:
  core::Result<RunSummary> map(const core::StopToken& stop, const Progress& progress,
                               RunClock::time_point began) {
    if (auto prepared = prepare(); !prepared) return tl::unexpected(prepared.error());
    RunContext context = context_of(stop);

    // The cameras are written before the first frame, so that a run that is killed can be examined too.
    std::vector<sensor::Camera> cameras;
    for (const RobotInfo& robot : source_->robots()) cameras.push_back(robot.camera);
    if (auto ok = write_cameras(output_->path(), source_->robots(), cameras); !ok)
      return tl::unexpected(ok.error());

    dataset::LiveFrameSource* const live = source_->live();
    if (live != nullptr) live->keep_in(output_->path());
    if (request_.prepared) request_.prepared(output_->path());
    const auto report = run_graph(graph_, context, progress, request_.pace_hz);

    // A live run that its user gave up keeps nothing; after other failures the stored keyframes can be
    // resumed.
    if (!report && live != nullptr && live->given_up()) return tl::unexpected(report.error());
    if (!report) return tl::unexpected(with_what_is_kept(report.error(), *output_));

    // A failure to record the live camera must not cost the map: it is reported after the result is written.
    const auto recorded = live != nullptr ? live->finish() : core::Result<void>();

    std::string input = request_.input;
    for (const std::string& other : request_.others) input += " " + other;
    RunSummary summary = summary_of_run(graph_, *report, request_, input, request_.pace_hz, began, executor_);
    if (auto ok = write_timing(output_->path() / "timing.csv", graph_, *report, *source_); !ok)
      return tl::unexpected(with_what_is_kept(ok.error(), *output_));
    if (auto ok = commit_result(summary, *output_, graph_, request_, context); !ok)
      return tl::unexpected(with_what_is_kept(ok.error(), *output_));

    if (debug_) {
      if (auto committed = debug_->commit(); !committed) return tl::unexpected(committed.error());
    }
    if (!recorded) return tl::unexpected(recorded.error());

    return summary;
  }

  /// Prepares the output folders, and reads what they contain already.
  core::Result<void> prepare() {
    auto output = maps::OutputFolder::prepare(request_.output, request_.replace, request_.resume);
    if (!output) return tl::unexpected(output.error());
    output_.emplace(std::move(*output));

    if (request_.resume) {
      auto opened =
          open_resumed(output_->path(), config_text(request_, graph_, 0), input_text(*source_), *source_);
      if (!opened) return tl::unexpected(opened.error());
      resumed_ = std::move(*opened);
      report_resumed(output_->path(), resumed_, log_);
    }

    // A resumed run was found to have the same configuration, so its config.yaml may be replaced.
    const std::string config = config_text(request_, graph_, executor_.threads());
    if (auto written = core::write_file(output_->path() / "config.yaml", config); !written) return written;
    if (request_.debug_video.empty()) return announce_files(graph_, {}, *output_);

    auto debug =
        DebugFolder::prepare(request_.debug_video, request_.output, output_->path(), request_.replace);
    if (!debug) return tl::unexpected(debug.error());
    debug_.emplace(std::move(*debug));
    return announce_files(graph_, debug_->files(), *output_);
  }

  RunContext context_of(const core::StopToken& stop) {
    RunContext context;
    context.executor = &executor_;
    context.log = &log_;

    // A live camera ends by itself on request, and all frames that arrived are mapped.
    context.stop = source_->live() != nullptr && request_.live == nullptr ? core::StopToken() : stop;
    context.asked = stop;
    context.output_folder = output_->path();
    context.input.source = source_.get();
    context.input.recordings = source_.get();
    context.input.robots = &source_->robots();
    context.input.known_map = known_map_;
    context.input.text = input_text(*source_);
    if (rig_) context.input.rig = &*rig_;

    if (resumed_) context.resumed = &*resumed_;
    context.store.configuration = config_text(request_, graph_, 0);
    context.store.keeps_map = any_stage(graph_, &Stage::keeps_map);
    context.store.keeps_clouds = keeps_clouds(graph_);

    if (debug_) context.hooks.debug_folder = debug_->path();
    context.hooks.feedback = request_.feedback;
    context.hooks.alter_map = request_.alter_map;
    context.hooks.observer = request_.observer.get();
    context.hooks.finishing = request_.finishing;
    return context;
  }

  const MapRequest& request_;
  const core::Executor& executor_;
  core::Log& log_;
  Graph graph_;
  std::shared_ptr<const localize::LocalizationMap> known_map_;
  std::unique_ptr<RobotRecordings> source_;
  std::optional<Rig> rig_;
  std::optional<maps::OutputFolder> output_;
  std::optional<ResumedRun> resumed_;
  std::optional<DebugFolder> debug_;
};

}  // namespace

core::Result<bool> is_finished(const std::filesystem::path& out, bool replace) {
  return maps::OutputFolder::finish(out, replace);
}

core::Result<RunSummary> map_recording(const MapRequest& given, const core::Executor& executor,
                                       core::Log& log, const core::StopToken& stop,
                                       const Progress& progress) {
  const auto began = RunClock::now();
  const auto request = in_order(given);
  if (!request) return tl::unexpected(request.error());
  if (!request->into.empty() && !request->rig.empty()) {
    return core::usage_error(
        "--rig: joins recordings of one robot's cameras; map them first, then fuse the result with the map "
        "of --into");
  }
  if (!request->into.empty() && request->part == PipelinePart::kWhole)
    return map_into(*request, executor, log, stop, progress);
  MapRun run(*request, executor, log);
  if (auto opened = run.open(); !opened) return tl::unexpected(opened.error());
  return run.run(stop, progress, began);
}

}  // namespace plumbline::pipeline
