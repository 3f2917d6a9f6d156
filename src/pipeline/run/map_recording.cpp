// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/map_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <system_error>
#include <tuple>
#include <utility>

#include "graph/graph_parts.hpp"
#include "plumbline/core/hash.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/maps/output_folder.hpp"
#include "plumbline/pipeline/graph.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "stages/debug_video.hpp"
#include "stages/resumed_run.hpp"
#include "stages/waiting_clouds.hpp"

namespace plumbline::pipeline {
namespace {

/// The effective configuration: a pipeline file that gives the same result again, and how it was run;
/// `threads` 0: left out.
std::string config_text(const MapRequest& request, const Graph& graph, int threads) {
  std::string text = fmt::format(
      "# What plumbline {} ran with. A pipeline file itself: plumbline map INPUT -p config.yaml\n",
      core::version());
  text += "run:\n";
  text += fmt::format("  input: {}\n  pipeline: {}\n", quoted(request.input), quoted(request.pipeline));
  for (std::size_t i = 0; i < request.others.size(); ++i) {
    text += fmt::format("  input{}: {}\n", i + 2, quoted(request.others[i]));
  }
  text +=
      fmt::format("  camera: {}\n  format: {}\n", quoted(request.open.camera), quoted(request.open.format));
  text += fmt::format("  from: {} s\n", request.open.from_s);
  constexpr double kNoEnd_s = 1e299;
  if (request.open.to_s < kNoEnd_s) text += fmt::format("  to: {} s\n", request.open.to_s);
  text += fmt::format("  every: {}\n", request.open.every);
  if (threads > 0) text += fmt::format("  threads: {}\n", threads);
  return text + to_yaml(graph);
}

/// Tells recordings apart without reading their pictures.
std::string input_text(const dataset::FrameSource& source) {
  core::Hash hash;
  for (std::size_t i = 0; i < source.size(); ++i) hash.number(source.info(i).stamp);
  std::string text = fmt::format("frames: {}\n", source.size());
  if (source.size() > 0) {
    text += fmt::format("first: {:.6f} s\nlast: {:.6f} s\n", source.info(0).stamp,
                        source.info(source.size() - 1).stamp);
  }
  return text + fmt::format("stamps: {:016x}\n", hash.value());
}

/// The same request for any order of its recordings: by name, and by folder where names are alike.
MapRequest in_order(MapRequest request) {
  if (request.others.empty()) return request;
  struct Input {
    std::string name;
    std::string folder;
    std::string given;
  };
  std::vector<Input> inputs;
  request.others.push_back(request.input);
  for (const std::string& given : request.others) {
    std::error_code ec;
    const std::filesystem::path folder = std::filesystem::weakly_canonical(given, ec);
    inputs.push_back({folder.filename().string(), folder.string(), given});
  }
  std::sort(inputs.begin(), inputs.end(), [](const Input& a, const Input& b) {
    return std::tie(a.name, a.folder, a.given) < std::tie(b.name, b.folder, b.given);
  });
  request.input = inputs.front().given;
  for (std::size_t i = 1; i < inputs.size(); ++i) request.others[i - 1] = inputs[i].given;
  request.others.pop_back();
  return request;
}

core::Result<std::unique_ptr<RobotRecordings>> open_inputs(const MapRequest& request,
                                                           const core::Executor& executor, core::Log& log) {
  const std::filesystem::path scenes = request.pipelines_folder / "scenes";
  std::vector<std::string> inputs{request.input};
  inputs.insert(inputs.end(), request.others.begin(), request.others.end());
  std::vector<std::unique_ptr<dataset::FrameSource>> all;
  for (const std::string& input : inputs) {
    auto recording = open_input(input, request.open, scenes, executor, log);
    if (!recording) return tl::unexpected<core::Error>(recording.error());
    all.push_back(std::move(*recording));
  }
  return std::make_unique<RobotRecordings>(std::move(all));
}

core::Result<void> can_resume(const MapRequest& request, bool keeps, const std::filesystem::path& pipeline) {
  if (!keeps) {
    return core::usage_error(
        fmt::format("{}: keeps no map.db to go on from; it takes a track stage and a store stage, or leave "
                    "out --resume",
                    pipeline.string()));
  }
  if (!request.debug_video.empty()) {
    return core::usage_error(
        "--debug-video: there are no pictures of what an earlier run tracked; leave it out with --resume");
  }
  return {};
}

void report_resumed(const std::filesystem::path& folder, const std::optional<ResumedRun>& run,
                    core::Log& log) {
  log.info(run ? fmt::format("going on after {} frames, with {} keyframes of {}", run->frames, run->keyframes,
                             run->store.string())
               : fmt::format("{}: nothing is there to go on from; beginning with the first frame",
                             folder.string()));
}

/// What a run that fails had stored stays.
core::Error with_what_is_kept(core::Error error, maps::OutputFolder& output) {
  const std::size_t keyframes = stored_keyframes(output.path());
  if (keyframes == 0) return error;
  output.keep();
  error.message += fmt::format("; {} keyframes are kept in {}: --resume goes on from there", keyframes,
                               (output.path() / maps::kStoreFile).string());
  return error;
}

}  // namespace

bool is_finished(const std::filesystem::path& out) {
  std::error_code ec;
  return maps::is_result_folder(out) && !std::filesystem::exists(maps::OutputFolder::partial_of(out), ec);
}

core::Result<RunSummary> map_recording(const MapRequest& given, const core::Executor& executor,
                                       core::Log& log, const core::StopToken& stop, const Progress& progress,
                                       DeferredDestruction* deferred_destruction) {
  const auto fail = [](const core::Error& error) { return tl::unexpected<core::Error>(error); };
  const auto start = std::chrono::steady_clock::now();
  const MapRequest request = in_order(given);

  const auto pipeline_file = find_pipeline(request.pipeline, request.pipelines_folder);
  if (!pipeline_file) return fail(pipeline_file.error());
  StageRegistry registry;
  register_stages(registry);
  registry.filters() = request.filters;
  auto graph = load_graph(*pipeline_file, registry, request.pipelines_folder, request.overrides);
  if (!graph) return fail(graph.error());
  for (const std::string& warning : graph->warnings) log.warning(warning);
  const bool tracks = std::any_of(graph->nodes.begin(), graph->nodes.end(),
                                  [](const Node& node) { return node.type->name == "track"; });
  if (!request.debug_video.empty() && !tracks) {
    return core::usage_error(
        fmt::format("{}: has no track stage whose work could be drawn; leave out --debug-video",
                    pipeline_file->string()));
  }
  if (graph->source().type->name == "maps") {
    return core::usage_error(
        fmt::format("{}: begins with finished maps; it is run by plumbline fuse", pipeline_file->string()));
  }
  const auto source = open_inputs(request, executor, log);
  if (!source) return fail(source.error());
  const bool keeps = std::any_of(graph->nodes.begin(), graph->nodes.end(),
                                 [](const Node& node) { return node.stage->keeps_map(); });
  if (request.resume) {
    if (auto can = can_resume(request, keeps && tracks, *pipeline_file); !can) return fail(can.error());
  }
  auto output = request.resume ? maps::OutputFolder::resume(request.output, request.replace)
                               : maps::OutputFolder::prepare(request.output, request.replace);
  if (!output) return fail(output.error());
  std::optional<ResumedRun> resumed;
  if (request.resume) {
    auto opened =
        open_resumed(output->path(), config_text(request, *graph, 0), input_text(**source), **source);
    if (!opened) return fail(opened.error());
    resumed = std::move(*opened);
    report_resumed(output->path(), resumed, log);
  }
  if (auto written =
          core::write_file(output->path() / "config.yaml", config_text(request, *graph, executor.threads()));
      !written) {
    return fail(written.error());
  }

  std::optional<DebugFolder> debug;
  if (!request.debug_video.empty()) {
    auto prepared =
        DebugFolder::prepare(request.debug_video, request.output, output->path(), request.replace);
    if (!prepared) return fail(prepared.error());
    debug.emplace(std::move(*prepared));
  }

  RunContext context;
  context.source = source->get();
  context.recordings = source->get();
  context.robots = &(*source)->robots();
  context.executor = &executor;
  context.log = &log;
  context.stop = stop;
  context.output_folder = output->path();
  if (debug) context.debug_folder = debug->path();
  context.configuration = config_text(request, *graph, 0);
  context.input = input_text(**source);
  context.pace_hz = request.pace_hz;
  context.keeps_map = keeps;
  context.keeps_clouds = keeps_clouds(*graph);
  context.alter_map = request.alter_map;
  if (resumed) context.resumed = &*resumed;
  if (request.prepared) request.prepared(output->path());
  const auto report = run_graph(*graph, context, progress);
  if (!report) return fail(with_what_is_kept(report.error(), *output));

  RunSummary summary;
  summary.input = request.input;
  for (const std::string& other : request.others) summary.input += " " + other;
  summary.pipeline = request.pipeline;
  summary.threads = executor.threads();
  summary.pace_hz = request.pace_hz;
  add_report(*report, summary);
  for (const Node& node : graph->nodes) node.stage->summarise(summary);
  judge(summary);
  if (auto written = write_timing(output->path() / "timing.csv", *report, summary.parts, **source);
      !written) {
    return fail(with_what_is_kept(written.error(), *output));
  }
  summary.peak_rss_mb = peak_rss_mb();
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (auto written = write_summary(output->path() / "summary.json", summary); !written)
    return fail(with_what_is_kept(written.error(), *output));
  if (auto committed = output->commit(); !committed) {
    return fail(with_what_is_kept(committed.error(), *output));
  }
  if (debug) {
    if (auto committed = debug->commit(); !committed) return fail(committed.error());
  }
  if (deferred_destruction != nullptr)
    deferred_destruction->push_back(std::make_shared<Graph>(std::move(*graph)));
  return summary;
}

}  // namespace plumbline::pipeline
