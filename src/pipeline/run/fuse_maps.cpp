// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/fuse_maps.hpp"

#include <fmt/format.h>

#include "graph/graph_parts.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/maps/stored_maps.hpp"
#include "plumbline/pipeline/rig.hpp"
#include "results/waiting_clouds.hpp"
#include "run/result.hpp"

namespace plumbline::pipeline {
namespace {

/// Configuration text that does not depend on the order in which the maps were named.
std::string config_text(const FuseRequest& request, const maps::StoredMaps& maps, const Graph& graph) {
  std::string text =
      fmt::format("# What plumbline {} fused with: plumbline fuse MAP... -p config.yaml\n", core::version());
  text += "run:\n  maps: [";
  for (std::size_t p = 0; p < maps.parts().size(); ++p) {
    text += fmt::format("{}\"{}\"", p == 0 ? "" : ", ", maps.parts()[p].name);
  }
  text += fmt::format("]\n  anchor: \"{}\"\n", request.anchor);
  if (!request.into.empty()) text += "  into: on\n";
  if (!request.rig.empty()) text += fmt::format("  rig: {}\n", quoted(request.rig.string()));
  return text + to_yaml(graph);
}

std::string names_of(const maps::StoredMaps& maps) {
  std::string names;
  for (const maps::StoredPart& part : maps.parts()) names += (names.empty() ? "" : " ") + part.name;
  return names;
}

core::Result<Graph> load_fusion(const FuseRequest& request) {
  RunRequest wanted = request;
  if (!request.into.empty()) wanted.part = PipelinePart::kJoining;
  auto graph = load_pipeline(wanted);
  if (!graph) return graph;
  if (graph->source().stage->reads_maps()) return graph;
  return core::usage_error(fmt::format(
      "{}: begins with a {} stage; finished maps are fused by a pipeline that begins with a maps stage",
      graph->file.string(), graph->source().type->name));
}

core::Result<std::unique_ptr<maps::StoredMaps>> open_maps(const FuseRequest& request,
                                                          const core::Executor& executor) {
  if (request.maps.empty()) return core::usage_error("name a map");
  if (!request.into.empty()) {
    std::vector<std::filesystem::path> all = request.maps;
    all.insert(all.begin(), request.into);
    return maps::StoredMaps::open(all, executor, maps::PartOrder::kAsGiven);
  }
  const auto order = request.change ? maps::PartOrder::kAsGiven : maps::PartOrder::kByContent;
  auto maps = maps::StoredMaps::open(request.maps, executor, order);
  if (!maps || request.anchor.empty()) return maps;
  if (const auto part = (*maps)->find_part(request.anchor); !part) return tl::unexpected(part.error());
  return maps;
}

/// The picks, by the order that the maps got. Errors (kUsage).
core::Result<void> set_picks(const FuseRequest& request, maps::StoredMaps& maps) {
  if (request.picks.empty()) return {};
  if (maps.parts().size() != 2 || !request.into.empty())
    return core::usage_error("--pick: joins two maps; fuse further ones afterwards");
  std::error_code ec;
  std::filesystem::path first = request.maps.front();
  if (std::filesystem::is_directory(first, ec)) first /= maps::kStoreFile;
  const bool swapped = !std::filesystem::equivalent(first, maps.parts().front().run.file(), ec);
  std::vector<maps::Pick> picks;
  for (const auto& [a, b] : request.picks) picks.push_back({swapped ? 1U : 0U, a, b});
  maps.set_picks(std::move(picks));
  return {};
}

/// The rig of the maps' robots. Errors (kUsage).
core::Result<std::optional<Rig>> rig_of(const FuseRequest& request, const maps::StoredMaps& maps) {
  if (request.rig.empty()) return std::optional<Rig>();
  if (!request.picks.empty() || !request.into.empty() || request.change)
    return core::usage_error("--rig: joins maps of one robot's cameras; leave out --pick and --into");
  return rig_of_run(request.rig, maps.robots());
}

RunContext context_of(const FuseRequest& request, const maps::StoredMaps& maps, const Graph& graph,
                      const std::filesystem::path& folder) {
  RunContext context;
  context.output_folder = folder;
  context.input.stored_maps = &maps;
  context.input.robots = &maps.robots();
  context.input.anchor = request.anchor;
  context.input.text = names_of(maps);
  context.store.configuration = config_text(request, maps, graph);
  context.input.into = !request.into.empty();
  // Clouds are changed by a visit when all of them were read.
  context.store.keeps_clouds = keeps_clouds(graph) && request.into.empty();
  context.hooks.observer = request.observer.get();
  context.hooks.finishing = request.finishing;
  return context;
}

}  // namespace

core::Result<RunSummary> fuse_stored_maps(const FuseRequest& request, const core::Executor& executor,
                                          core::Log& log, const core::StopToken& stop,
                                          const Progress& progress) {
  const auto began = RunClock::now();
  auto graph = load_fusion(request);
  if (!graph) return tl::unexpected(graph.error());

  const auto maps = open_maps(request, executor);
  if (!maps) return tl::unexpected(maps.error());
  if (auto picked = set_picks(request, **maps); !picked) return tl::unexpected(picked.error());
  const auto rig = rig_of(request, **maps);
  if (!rig) return tl::unexpected(rig.error());

  // A change, such as a scale from control points, comes first: if it fails, no output folder is touched.
  std::map<std::string, std::string> files;
  if (request.change) {
    auto changed = request.change(**maps);
    if (!changed) return tl::unexpected(changed.error());
    files = std::move(*changed);
  }
  auto output = maps::OutputFolder::prepare(request.output, request.replace);
  if (!output) return tl::unexpected(output.error());

  RunContext context = context_of(request, **maps, *graph, output->path());
  context.executor = &executor;
  context.log = &log;
  context.stop = stop;
  if (*rig) context.input.rig = &**rig;

  // The folder notes the files that it will hold, so that replacing it later removes these and nothing else.
  if (auto ok = announce_files(*graph, {}, *output); !ok) return tl::unexpected(ok.error());
  if (auto ok = core::write_file(output->path() / "config.yaml", context.store.configuration); !ok)
    return tl::unexpected(ok.error());
  for (const auto& [name, text] : files) {
    std::error_code ignored;
    std::filesystem::create_directories((output->path() / name).parent_path(), ignored);
    if (auto ok = core::write_file(output->path() / name, text); !ok) return tl::unexpected(ok.error());
  }

  const auto report = run_graph(*graph, context, progress);
  if (!report) return tl::unexpected(output->explained(report.error()));

  RunSummary summary = summary_of_run(*graph, *report, request, context.input.text, 0.0, began, executor);
  if (auto ok = commit_result(summary, *output, *graph, request, context); !ok)
    return tl::unexpected(output->explained(ok.error()));

  return summary;
}

}  // namespace plumbline::pipeline
