// SPDX-License-Identifier: BSD-3-Clause
// plumbline pipelines list|check
#include <fmt/format.h>

#include <memory>
#include <vector>

#include "app.hpp"
#include "plumbline/pipeline/graph.hpp"

namespace plumbline::cli {
namespace {

struct CheckRequest {
  std::string pipeline;
  std::vector<std::string> overrides;
};

core::Result<pipeline::Graph> load(const std::string& name, const std::vector<std::string>& overrides,
                                   const pipeline::StageRegistry& registry, const Session& session) {
  const auto folder = session.pipelines_folder();
  if (!folder) return tl::unexpected<core::Error>(folder.error());
  const auto file = pipeline::find_pipeline(name, *folder);
  if (!file) return tl::unexpected<core::Error>(file.error());
  return pipeline::load_graph(*file, registry, *folder, overrides);
}

int list(Session& session) {
  const auto folder = session.pipelines_folder();
  if (!folder) return session.fail(folder.error());
  pipeline::StageRegistry registry;
  pipeline::register_stages(registry);
  for (const std::string& name : pipeline::pipeline_names(*folder)) {
    const auto graph = load(name, {}, registry, session);
    fmt::print("{:<16} {}\n", name, graph ? graph->description : "(broken) " + graph.error().message);
  }
  return 0;
}

int check(Session& session, const CheckRequest& request) {
  pipeline::StageRegistry registry;
  pipeline::register_stages(registry);
  const auto graph = load(request.pipeline, request.overrides, registry, session);
  if (!graph) return session.fail(graph.error());
  fmt::print("{}: {} stages, nothing wrong\n", request.pipeline, graph->nodes.size());
  if (session.verbose) fmt::print("{}", pipeline::to_yaml(*graph));
  return 0;
}

}  // namespace

void add_pipelines(CLI::App& app, Session& session) {
  CLI::App* group = add_group(app, "pipelines", "What pipelines there are");
  add_command(*group, session, "list", "The shipped pipelines", [&session] { return list(session); });
  const auto request = std::make_shared<CheckRequest>();
  CLI::App* command = add_command(*group, session, "check", "Check a pipeline without running it",
                                  [&session, request] { return check(session, *request); });
  command->add_option("PIPELINE", request->pipeline, "Shipped pipeline or file")->required();
  command->add_option("--set", request->overrides, "Set an option of a stage; may be repeated")
      ->type_name("stage.key=value")
      ->allow_extra_args(false);
}

}  // namespace plumbline::cli
