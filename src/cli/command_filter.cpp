// SPDX-License-Identifier: BSD-3-Clause
// plumbline filter CHAIN.yaml IN OUT, plumbline filters list|describe|check
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <system_error>
#include <vector>

#include "app.hpp"
#include "plumbline/cloud/cloud_io.hpp"
#include "plumbline/cloud/filter_chain.hpp"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

struct FilterRequest {
  std::string chain;
  fs::path input;
  fs::path output;
};

/// A file, or a shipped chain by name.
core::Result<fs::path> find_chain(const std::string& name, const Session& session) {
  std::error_code ec;
  if (fs::is_regular_file(name, ec)) return fs::path(name);
  const auto pipelines = session.pipelines_folder();
  if (!pipelines) return pipelines;
  for (const char* ending : {"", ".yaml"}) {
    const fs::path shipped = *pipelines / "filters" / (name + ending);
    if (fs::is_regular_file(shipped, ec)) return shipped;
  }
  return core::usage_error(fmt::format("{}: no such filter chain, and no shipped one has that name", name));
}

core::Result<cloud::FilterChain> load_chain(const std::string& name, const Session& session) {
  const auto file = find_chain(name, session);
  if (!file) return tl::unexpected<core::Error>(file.error());
  return cloud::FilterChain::load(*file, cloud::builtin_filters());
}

core::Result<void> filter(const FilterRequest& request, const Session& session) {
  const auto chain = load_chain(request.chain, session);
  if (!chain) return tl::unexpected<core::Error>(chain.error());
  const auto extension = request.output.extension();
  if (extension != ".ply" && extension != ".pcd") {
    return core::usage_error(fmt::format("{}: clouds are written as .ply or .pcd", request.output.string()));
  }
  const auto file = cloud::read_cloud(request.input);
  if (!file) return tl::unexpected<core::Error>(file.error());
  std::vector<cloud::FilterReport> reports;
  const auto filtered = chain->apply(file->cloud, {}, &reports);
  if (!filtered) return tl::unexpected<core::Error>(filtered.error());
  if (!session.quiet) fmt::print("{}", cloud::to_table(reports));
  return cloud::write_cloud(request.output, **filtered);
}

void list_filters() {
  const cloud::FilterRegistry registry = cloud::builtin_filters();
  for (const cloud::FilterInfo& info : registry.filters()) {
    fmt::print("{:<24} {}\n", info.type, info.summary);
  }
}

core::Result<void> describe_filter(const std::string& name) {
  const cloud::FilterRegistry registry = cloud::builtin_filters();
  const cloud::FilterInfo* info = registry.find(name);
  if (info == nullptr) {
    const std::string near = core::did_you_mean(name, registry.types());
    return core::usage_error(fmt::format("there is no filter '{}' (allowed: {}{})", name,
                                         fmt::join(registry.types(), ", "),
                                         near.empty() ? "" : "; did you mean " + near + "?"));
  }
  fmt::print("{}: {}\n\n{}\n\noptions:\n", info->type, info->summary, info->details);
  core::OptionTable table;
  const auto made = info->make();
  made->declare(table);
  for (const core::OptionSpec& spec : table.specs()) {
    fmt::print("  {:<20} {} (default: {})\n", spec.key, spec.help, spec.default_value);
  }
  fmt::print("\nexample:\n{}\n", info->example);
  return {};
}

}  // namespace

void add_filter(CLI::App& app, Session& session) {
  const auto request = std::make_shared<FilterRequest>();
  CLI::App* command =
      add_command(app, session, "filter", "Run a filter chain on a cloud file", [&session, request] {
        const auto done = filter(*request, session);
        return done ? 0 : session.fail(done.error());
      });
  command->add_option("CHAIN", request->chain, "Filter chain: a file or a shipped name")->required();
  command->add_option("IN", request->input, "Cloud to read: .ply, .pcd, .xyz, .csv")->required();
  command->add_option("OUT", request->output, "Cloud to write: .ply or .pcd")->required();

  CLI::App* group = add_group(app, "filters", "What filters there are");
  add_command(*group, session, "list", "All filters", [] {
    list_filters();
    return 0;
  });
  const auto name = std::make_shared<std::string>();
  add_command(*group, session, "describe", "One filter: options and an example",
              [&session, name] {
                const auto done = describe_filter(*name);
                return done ? 0 : session.fail(done.error());
              })
      ->add_option("NAME", *name, "Type of the filter")
      ->required();
  add_command(*group, session, "check", "Check a filter chain without running it",
              [&session, name] {
                const auto chain = load_chain(*name, session);
                if (!chain) return session.fail(chain.error());
                fmt::print("{}: {} filters, nothing wrong\n", *name, chain->size());
                return 0;
              })
      ->add_option("CHAIN", *name, "Filter chain: a file or a shipped name")
      ->required();
}

}  // namespace plumbline::cli
