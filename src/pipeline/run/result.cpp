// SPDX-License-Identifier: BSD-3-Clause
#include "run/result.hpp"

#include <fmt/format.h>

#include "plumbline/core/output_file.hpp"
#include "plumbline/exports/export.hpp"
#include "plumbline/pipeline/input.hpp"

namespace plumbline::pipeline {

core::Result<Graph> load_pipeline(const RunRequest& request) {
  const auto file = core::find_yaml("pipeline", request.pipeline, request.pipelines_folder);
  if (!file) return tl::unexpected(file.error());
  StageRegistry registry;
  register_stages(registry);
  registry.filters() = request.filters;
  return load_graph(*file, registry, request.pipelines_folder, request.overrides);
}

RunSummary summary_of_run(const Graph& graph, const RunReport& report, const RunRequest& request,
                          const core::Executor& executor) {
  RunSummary summary;
  summary.pipeline = request.pipeline;
  summary.threads = executor.threads();
  summary.stopped = report.stopped;
  summary.frames.available = report.frames_available;
  summary.map_s = report.map_s;
  summary.behind_s = report.behind_s;
  summary.export_s = report.export_s;
  summary.stages = report.stages;
  for (const Node& node : graph.nodes) node.stage->summarise(summary);
  return summary;
}

namespace {

/// Recordings as `map` opens them.
exports::OpenRecording recording_opener(const RunRequest& request, const RunContext& context) {
  return [&request, &context](const exports::RecordingName& name) {
    dataset::OpenOptions open;
    open.camera = name.camera;
    open.format = name.format.empty() ? "auto" : name.format;
    open.cameras_folder = request.pipelines_folder / "cameras";
    return open_input(name.input, open, request.pipelines_folder / "scenes", *context.executor, *context.log);
  };
}

core::Result<void> write_exports(const std::filesystem::path& folder, const Graph& graph,
                                 const RunRequest& request, const RunContext& context) {
  for (const Node& node : graph.nodes) {
    if (node.stage->wanted_exports() == nullptr) continue;
    for (exports::ExportRequest wanted : *node.stage->wanted_exports()) {
      const std::string name = wanted.output.string();
      wanted.input = folder;
      wanted.output = folder / wanted.output;
      wanted.open = recording_opener(request, context);
      if (wanted.output.has_parent_path()) {
        if (auto made = core::make_folder(wanted.output.parent_path()); !made) return made;
      }
      const auto summary = exports::write_export(wanted, *context.executor, *context.log, nullptr);
      if (!summary && summary.error().kind == core::ErrorKind::kOutput)
        return tl::unexpected(summary.error());
      if (!summary)
        context.log->warning(fmt::format("exports: {} is left out: {}", name, summary.error().message));
    }
  }
  return {};
}

}  // namespace

core::Result<void> commit_result(RunSummary& summary, maps::OutputFolder& output, RunClock::time_point began,
                                 const Graph& graph, const RunRequest& request, const RunContext& context) {
  judge(summary);
  summary.peak_rss_mb = peak_rss_mb();
  summary.wall_s = std::chrono::duration<double>(RunClock::now() - began).count();
  if (auto ok = write_summary(output.path() / "summary.json", summary); !ok) return ok;
  if (auto ok = write_exports(output.path(), graph, request, context); !ok) return ok;
  return output.commit();
}

}  // namespace plumbline::pipeline
