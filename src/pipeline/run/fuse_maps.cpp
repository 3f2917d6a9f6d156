// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/fuse_maps.hpp"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "plumbline/core/output_file.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/maps/output_folder.hpp"
#include "plumbline/maps/stored_maps.hpp"
#include "plumbline/pipeline/graph.hpp"
#include "stages/waiting_clouds.hpp"

namespace plumbline::pipeline {
namespace {

/// The same whatever the order in which the maps were named.
std::string config_text(const FuseRequest& request, const maps::StoredMaps& maps, const Graph& graph) {
  std::string text =
      fmt::format("# What plumbline {} fused with: plumbline fuse MAP... -p config.yaml\n", core::version());
  text += "run:\n  maps: [";
  for (std::size_t p = 0; p < maps.parts().size(); ++p) {
    text += fmt::format("{}\"{}\"", p == 0 ? "" : ", ", maps.parts()[p].name);
  }
  text += fmt::format("]\n  anchor: \"{}\"\n", request.anchor);
  return text + to_yaml(graph);
}

std::string names_of(const maps::StoredMaps& maps) {
  std::string names;
  for (const maps::StoredPart& part : maps.parts()) names += (names.empty() ? "" : " ") + part.name;
  return names;
}

/// `registry` must outlive the graph, whose nodes point to their types there.
core::Result<Graph> load_fusion(const FuseRequest& request, StageRegistry& registry, core::Log& log) {
  const auto file = find_pipeline(request.pipeline, request.pipelines_folder);
  if (!file) return tl::unexpected<core::Error>(file.error());
  register_stages(registry);
  registry.filters() = request.filters;
  auto graph = load_graph(*file, registry, request.pipelines_folder, request.overrides);
  if (!graph) return graph;
  for (const std::string& warning : graph->warnings) log.warning(warning);
  if (graph->source().type->name == "maps") return graph;
  return core::usage_error(
      fmt::format("{}: begins with a {} stage; finished maps are fused by a pipeline that "
                  "begins with a maps stage",
                  file->string(), graph->source().type->name));
}

core::Result<std::unique_ptr<maps::StoredMaps>> open_maps(const FuseRequest& request,
                                                          const core::Executor& executor) {
  if (request.maps.empty()) return core::usage_error("name a map");
  auto maps = maps::StoredMaps::open(request.maps, executor);
  if (!maps || request.anchor.empty()) return maps;
  if (const auto part = (*maps)->find_part(request.anchor); !part)
    return tl::unexpected<core::Error>(part.error());
  return maps;
}

}  // namespace

core::Result<RunSummary> fuse_stored_maps(const FuseRequest& request, const core::Executor& executor,
                                          core::Log& log, const core::StopToken& stop,
                                          const Progress& progress,
                                          DeferredDestruction* deferred_destruction) {
  const auto fail = [](const core::Error& error) { return tl::unexpected<core::Error>(error); };
  const auto start = std::chrono::steady_clock::now();
  std::unique_ptr<maps::StoredMaps> maps;  // goes last: stages may still be at work on it
  StageRegistry registry;
  auto graph = load_fusion(request, registry, log);
  if (!graph) return fail(graph.error());
  auto opened = open_maps(request, executor);
  if (!opened) return fail(opened.error());
  maps = std::move(*opened);
  auto output = maps::OutputFolder::prepare(request.output, request.replace);
  if (!output) return fail(output.error());

  RunContext context;
  context.source = maps.get();
  context.stored_maps = maps.get();
  context.robots = &maps->robots();
  context.keeps_clouds = keeps_clouds(*graph);
  context.anchor = request.anchor;
  context.executor = &executor;
  context.log = &log;
  context.stop = stop;
  context.output_folder = output->path();
  context.configuration = config_text(request, *maps, *graph);
  context.input = names_of(*maps);
  if (auto written = core::write_file(output->path() / "config.yaml", context.configuration); !written) {
    return fail(written.error());
  }
  const auto report = run_graph(*graph, context, progress);
  if (!report) return fail(report.error());

  RunSummary summary;
  summary.input = context.input;
  summary.pipeline = request.pipeline;
  summary.threads = executor.threads();
  add_report(*report, summary);
  for (const Node& node : graph->nodes) node.stage->summarise(summary);
  judge(summary);
  summary.peak_rss_mb = peak_rss_mb();
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (auto written = write_summary(output->path() / "summary.json", summary); !written)
    return fail(written.error());
  if (auto committed = output->commit(); !committed) return fail(committed.error());
  if (deferred_destruction != nullptr) {
    deferred_destruction->push_back(std::make_shared<Graph>(std::move(*graph)));
    deferred_destruction->push_back(std::shared_ptr<maps::StoredMaps>(std::move(maps)));
  }
  return summary;
}

}  // namespace plumbline::pipeline
