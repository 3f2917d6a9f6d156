// SPDX-License-Identifier: BSD-3-Clause
// plumbline pipelines list|describe|check|schema|graph
#include <fmt/format.h>

#include <memory>
#include <vector>

#include "app.hpp"
#include "plumbline/cloud/filters/filter_schema.hpp"
#include "plumbline/core/option_schema.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/pipeline/graph.hpp"
#include "plumbline/pipeline/reference.hpp"
#include "plumbline/viz/graph_picture.hpp"
#include "terminal/print.hpp"

namespace plumbline::cli {
namespace {

/// Options of the commands; each uses its part.
struct PipelinesRequest {
  std::string name;  ///< of a pipeline or a stage
  std::vector<std::string> overrides;
  std::filesystem::path output;
  bool markdown = false;
  bool all = false;  ///< advanced options, too
};
using RequestPtr = std::shared_ptr<PipelinesRequest>;

/// All stages, and the filters of the plugins that the command was given.
core::Result<pipeline::StageRegistry> all_stages(const Session& session) {
  const auto filters = session.filters();
  if (!filters) return tl::unexpected<core::Error>(filters.error());
  pipeline::StageRegistry registry;
  pipeline::register_stages(registry);
  registry.filters() = *filters;
  return registry;
}

/// A shipped pipeline or a file, with overridden options.
core::Result<pipeline::Graph> load(const PipelinesRequest& request, const pipeline::StageRegistry& registry,
                                   const Session& session) {
  const auto folder = session.pipelines_folder();
  if (!folder) return tl::unexpected<core::Error>(folder.error());
  const auto file = core::find_yaml("pipeline", request.name, *folder);
  if (!file) return tl::unexpected<core::Error>(file.error());
  return pipeline::load_graph(*file, registry, *folder, request.overrides);
}

core::Result<pipeline::StageTypePtr> find_stage(const std::string& name,
                                                const pipeline::StageRegistry& registry) {
  pipeline::StageTypePtr type = registry.find(name);
  if (type != nullptr) return type;
  return core::usage_error(fmt::format("there is no stage '{}'{}", name, core::hint(name, registry.names())));
}

/// Shipped pipelines and all types of stages.
int list(Session& session, const PipelinesRequest& /*request*/, const pipeline::StageRegistry& registry) {
  const auto folder = session.pipelines_folder();
  if (!folder) return session.fail(folder.error());
  print("pipelines:\n");
  for (const std::string& name : core::yaml_names(*folder)) {
    const auto graph = load({name, {}, {}, false, false}, registry, session);
    print("  {:<14} {}\n", name, graph ? graph->description : "(broken) " + graph.error().message);
  }
  print("stages:\n");
  for (const pipeline::StageTypePtr& type : registry.types()) print("  {:<14} {}\n", type->name, type->help);
  return 0;
}

/// Types and rates of a stage's inputs or outputs.
void describe_ports(const std::vector<pipeline::Port>& ports, const char* title) {
  if (ports.empty()) return;
  print("\n{}:\n", title);
  for (const pipeline::Port& port : ports) {
    print("  {:<22} {}, {}{}\n", port.name, port.type.name,
          port.type.rate == pipeline::Rate::kFrame ? "each frame" : "once, at the end",
          port.required ? "" : "; may be left open");
  }
}

int describe(Session& session, const PipelinesRequest& request, const pipeline::StageRegistry& registry) {
  // Without a name, the page of all stages
  if (request.name.empty()) {
    print("{}", pipeline::stages_reference(registry, request.all));
    return 0;
  }

  // One stage as Markdown
  const auto type = find_stage(request.name, registry);
  if (!type) return session.fail(type.error());
  if (request.markdown) {
    print("{}", pipeline::stage_reference(**type, request.all));
    return 0;
  }

  // Ports and options on the terminal
  print("{}: {}\n", (*type)->name, (*type)->help);
  describe_ports((*type)->inputs, "inputs");
  describe_ports((*type)->outputs, "outputs");
  const std::vector<core::OptionSpec> options = pipeline::shown_options(**type, request.all);
  if (!options.empty()) print("\noptions:\n");
  for (const core::OptionSpec& spec : options) {
    print("  {:<22} {} (allowed: {}; default: {})\n", spec.key, spec.help, core::allowed_text(spec),
          spec.default_value);
  }

  return 0;
}

int check(Session& session, const PipelinesRequest& request, const pipeline::StageRegistry& registry) {
  const auto graph = load(request, registry, session);
  if (!graph) return session.fail(graph.error());
  print("{}: {} stages, nothing wrong\n", request.name, graph->stage_count());
  if (session.verbose) print("{}", pipeline::to_yaml(*graph));
  return 0;
}

/// JSON Schema of pipelines or of one stage.
int schema(Session& session, const PipelinesRequest& request, const pipeline::StageRegistry& registry) {
  if (request.name.empty()) {
    print("{}", pipeline::pipeline_schema(registry));
    return 0;
  }
  const auto type = find_stage(request.name, registry);
  if (!type) return session.fail(type.error());
  print("{}", pipeline::stage_schema(**type, registry));
  return 0;
}

/// The graph as a picture, or in Graphviz's language.
int graph(Session& session, const PipelinesRequest& request, const pipeline::StageRegistry& registry) {
  const auto loaded = load(request, registry, session);
  if (!loaded) return session.fail(loaded.error());
  const std::string dot = pipeline::to_dot(*loaded);
  if (request.output.empty()) {
    print("{}", dot);
    return 0;
  }
  const bool as_text = request.output.extension() == ".dot";
  const auto written = as_text ? core::write_file(request.output, dot) : viz::draw_graph(dot, request.output);
  return written ? 0 : session.fail(written.error());
}

void add_pipeline_arguments(CLI::App& command, const RequestPtr& request) {
  command.add_option("PIPELINE", request->name, "Shipped pipeline or file")->required();
  command.add_option("--set", request->overrides, "Set an option of a stage; may be repeated")
      ->type_name("stage.key=value")
      ->allow_extra_args(false);
}

/// Adds `filters schema`; the schema of pipelines contains the same.
void add_chain_schema(CLI::App& filters, Session& session) {
  CLI::App* command =
      add_command(filters, session, "schema", "JSON Schema of filter chains, for editors", [&session] {
        const auto known = session.filters();
        if (!known) return session.fail(known.error());
        print("{}", cloud::filter_chain_schema(*known));
        return 0;
      });
  add_plugin_option(*command, session);
}

}  // namespace

void add_pipelines(CLI::App& app, Session& session) {
  // Stages of plugins are known to every command
  CLI::App* group = add_group(app, "pipelines", "List, describe, check and draw pipelines and their stages");
  const auto request = std::make_shared<PipelinesRequest>();
  const auto command = [&](const char* name, const char* help,
                           int (*run)(Session&, const PipelinesRequest&, const pipeline::StageRegistry&)) {
    return add_command(*group, session, name, help, [&session, request, run] {
      const auto registry = all_stages(session);
      return registry ? run(session, *request, *registry) : session.fail(registry.error());
    });
  };

  // Pipelines and stages
  CLI::App* listed = command("list", "List the shipped pipelines and all stages", list);
  add_plugin_option(*listed, session);
  CLI::App* described = command(
      "describe", "Describe a stage's ports and options; without STAGE the whole reference", describe);
  described->add_option("STAGE", request->name, "Type of a stage");
  described->add_flag("--markdown", request->markdown, "As a section of the reference page");
  described->add_flag("--all", request->all, "Include advanced options");

  // Files are checked without running them
  CLI::App* checked = command("check", "Check a pipeline without running it", check);
  add_pipeline_arguments(*checked, request);
  add_plugin_option(*checked, session);
  CLI::App* schemed =
      command("schema", "JSON Schema of pipeline files, or of one stage, for editors", schema);
  schemed->add_option("STAGE", request->name, "Type of a stage");
  add_plugin_option(*schemed, session);

  // A picture of the graph
  CLI::App* drawn = command("graph", "Draw a pipeline; without -o print it in Graphviz's language", graph);
  add_pipeline_arguments(*drawn, request);
  add_plugin_option(*drawn, session);
  drawn->add_option("-o,--output", request->output, "Picture to write: .png, .svg, .pdf or .dot")
      ->type_name("FILE");
  add_chain_schema(*app.get_subcommand("filters"), session);
}

}  // namespace plumbline::cli
