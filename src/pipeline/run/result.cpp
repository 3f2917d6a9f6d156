// SPDX-License-Identifier: BSD-3-Clause
#include "run/result.hpp"

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

core::Result<void> commit_result(RunSummary& summary, maps::OutputFolder& output,
                                 RunClock::time_point began) {
  judge(summary);
  summary.peak_rss_mb = peak_rss_mb();
  summary.wall_s = std::chrono::duration<double>(RunClock::now() - began).count();
  if (auto ok = write_summary(output.path() / "summary.json", summary); !ok) return ok;
  return output.commit();
}

}  // namespace plumbline::pipeline
