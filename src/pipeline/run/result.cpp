// SPDX-License-Identifier: BSD-3-Clause
#include "run/result.hpp"

#include <fmt/format.h>

#include "plumbline/core/output_file.hpp"
#include "plumbline/exports/export.hpp"
#include "plumbline/pipeline/input.hpp"
#include "run/run_summary.hpp"
#include "visits/visit_pipeline.hpp"

namespace plumbline::pipeline {

core::Result<Graph> load_pipeline(const RunRequest& request) {
  const auto file = core::find_yaml("pipeline", request.pipeline, request.pipelines_folder);
  if (!file) return tl::unexpected(file.error());
  StageRegistry registry;
  register_stages(registry);
  registry.filters() = request.filters;
  if (request.part == PipelinePart::kWhole)
    return load_graph(*file, registry, request.pipelines_folder, request.overrides);

  // Options of the stage that joining adds are not those of the file.
  std::vector<std::string> of_file, of_visit;
  for (const std::string& text : request.overrides)
    (text.rfind(std::string(kVisitStage) + ".", 0) == 0 ? of_visit : of_file).push_back(text);

  const auto whole = load_graph(*file, registry, request.pipelines_folder, of_file);
  if (!whole) return tl::unexpected(whole.error());
  const bool joins = request.part == PipelinePart::kJoining;
  const auto yaml = joins ? joining_part(*whole) : mapping_part(*whole);
  if (!yaml) return tl::unexpected(yaml.error());
  return parse_graph(*yaml, *file, registry, request.pipelines_folder,
                     joins ? of_visit : std::vector<std::string>());
}

RunSummary summary_of_run(const Graph& graph, const RunReport& report, const RunRequest& request,
                          const std::string& input, double pace_hz, RunClock::time_point began,
                          const core::Executor& executor) {
  RunFacts facts;
  facts.input = input;
  facts.pipeline = request.pipeline;
  facts.pace_hz = pace_hz;
  facts.wall_s = std::chrono::duration<double>(RunClock::now() - began).count();
  facts.threads = executor.threads();
  return summary_of(graph, report, facts);
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

      // An export that does not suit this map is left out with a warning; a file that cannot be written, for
      // want of space for instance, ends the run.
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

core::Result<void> announce_files(const Graph& graph, const core::FileNames& others,
                                  maps::OutputFolder& output) {
  core::FileNames files = others;
  for (const Node& node : graph.nodes) {
    for (const std::string& file : node.stage->files())
      files.push_back(std::filesystem::path(file).lexically_normal().generic_string());
    if (node.stage->wanted_exports() == nullptr) continue;

    for (const exports::ExportRequest& wanted : *node.stage->wanted_exports()) {
      const std::string name = wanted.output.lexically_normal().generic_string();
      files.push_back(name + (wanted.output.has_extension() ? ".georeference.json" : "/**"));
    }
  }
  return output.expect(files);
}

core::Result<void> commit_result(const RunSummary& summary, maps::OutputFolder& output, const Graph& graph,
                                 const RunRequest& request, const RunContext& context) {
  if (auto ok = core::write_file(output.path() / "summary.json", summary.json); !ok) return ok;
  if (auto ok = write_exports(output.path(), graph, request, context); !ok) return ok;
  return output.commit();
}

}  // namespace plumbline::pipeline
