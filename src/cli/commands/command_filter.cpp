// SPDX-License-Identifier: BSD-3-Clause
// plumbline filter CHAIN.yaml IN... OUT, plumbline filters list|describe|check
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <memory>
#include <system_error>
#include <vector>

#include "app.hpp"
#include "option_flags.hpp"
#include "plumbline/cloud/columns.hpp"
#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/cloud/filters/filter_plugin.hpp"
#include "plumbline/cloud/filters/tiled_filter.hpp"
#include "plumbline/core/text.hpp"
#include "plumbline/maps/output_check.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "terminal/print.hpp"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

struct TileOptions {
  double tiles_m = 0.0;  ///< edge length; 0: the whole cloud at once
  void declare(core::OptionTable& table) {
    table.number(
        "tiles", tiles_m, {0.0, 10000.0}, "m",
        "Filter a cloud that memory does not hold in tiles of this edge length (10m): filters must decide "
        "by a point's neighbours, files be binary PLY; 0: the whole cloud at once");
  }
};

struct FilterRequest {
  std::string chain;
  std::vector<fs::path> files;  ///< inputs, then the output
  TileOptions tiles;
  OptionFlags flags;
};

/// A shipped chain or a file, with the filters of plugins.
core::Result<cloud::FilterChain> load_chain(const std::string& name, const Session& session) {
  const auto pipelines = session.pipelines_folder();
  if (!pipelines) return tl::unexpected<core::Error>(pipelines.error());
  const auto file = core::find_yaml("filter chain", name, *pipelines / "filters");
  if (!file) return tl::unexpected<core::Error>(file.error());
  const auto registry = session.filters();
  if (!registry) return tl::unexpected<core::Error>(registry.error());
  return cloud::FilterChain::load(*file, *registry);
}

/// Reports a problem with the output before anything is read.
core::Result<void> check_outputs(const FilterRequest& request, const cloud::FilterChain& chain) {
  // The ending decides the format
  const fs::path& output = request.files.back();
  const std::string extension = core::ending_of(output);
  if (extension != ".ply" && extension != ".pcd") {
    return core::usage_error(fmt::format("{}: clouds are written as .ply or .pcd", output.string()));
  }

  // Missing folders are not created
  std::error_code ec;
  const fs::path folder = output.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, ec)) {
    return core::output_error(fmt::format("{}: there is no folder {}", output.string(), folder.string()));
  }

  // Two writers of one file
  for (const std::string& written : chain.writes()) {
    if (fs::absolute(written).lexically_normal() == fs::absolute(output).lexically_normal()) {
      return core::usage_error(output.string() + ": a filter of the chain writes this file already");
    }
  }

  // Inputs and results are never overwritten
  const std::vector<fs::path> inputs(request.files.begin(), request.files.end() - 1);
  for (const std::string& written : chain.writes()) {
    if (auto free = maps::check_output(written, inputs); !free) return free;
  }
  return maps::check_output(output, inputs);
}

/// The inputs one after the other, in the frame of the first.
core::Result<cloud::CloudPtr> read_inputs(const FilterRequest& request, cloud::CloudColumns& columns,
                                          Eigen::Vector3d& shift, cloud::CloudFrame& frame) {
  // All inputs become one cloud
  cloud::CloudPtr all;
  for (std::size_t i = 0; i + 1 < request.files.size(); ++i) {
    auto file = cloud::read_cloud(request.files[i], cloud::LargeCoordinates::kShifted);
    if (!file) return tl::unexpected<core::Error>(file.error());
    file->frame = maps::frame_of_cloud(request.files[i], file->frame);

    // The first one defines the frame.
    if (all == nullptr) {
      all = std::move(file->cloud);
      columns = std::move(file->columns);
      shift = file->shift;
      frame = std::move(file->frame);

    } else {
      // The others must fit into it.
      auto fits = cloud::check_one_frame(request.files.front().string(), shift, request.files[i].string(),
                                         file->shift);
      if (fits)
        fits = cloud::check_same_up(request.files.front().string(), frame, request.files[i].string(),
                                    file->frame);
      if (!fits) return tl::unexpected<core::Error>(fits.error());

      // Appended in the coordinates of the first
      cloud::change_shift(*file->cloud, file->shift, shift);
      cloud::append_columns(columns, all->size(), file->columns, file->cloud->size());
      *all += *file->cloud;
    }
  }

  return all;
}

/// Error that names the filter which removed the last point, if none is left.
core::Result<void> something_left(const cloud::FilterChain& chain,
                                  const std::vector<cloud::FilterReport>& reports) {
  if (reports.empty() || reports.back().points_out > 0) return {};
  for (std::size_t i = 0; i < reports.size(); ++i) {
    if (reports[i].points_out > 0) continue;
    const std::string what = reports[i].points_in == 0
                                 ? "got no point to begin with"
                                 : fmt::format("took the last of {} points", reports[i].points_in);
    return core::failure(core::ErrorKind::kUntrustworthy,
                         fmt::format("chain {}: no point is left: filters[{}] ({}) {}", chain.name(), i,
                                     reports[i].type, what));
  }
  return {};
}

/// The chain tile by tile.
core::Result<void> filter_tiles(const FilterRequest& request, const cloud::FilterChain& chain,
                                Session& session) {
  // Tiles are read and written as a stream
  const fs::path& output = request.files.back();
  if (core::ending_of(output) != ".ply")
    return core::usage_error(output.string() + ": with --tiles clouds are written as .ply");
  const std::vector<fs::path> inputs(request.files.begin(), request.files.end() - 1);

  // The frame of the first cloud
  cloud::CloudFrame frame = maps::frame_of_cloud(inputs.front(), cloud::frame_of_ply(inputs.front()));
  Console& console = session.console();
  const auto report = cloud::filter_in_tiles(
      chain, {inputs, output}, request.tiles.tiles_m, frame, &session.executor(),
      [&console](std::size_t done, std::size_t total) { console.progress(done, total, "tiles"); });
  console.end_progress();
  if (!report) return tl::unexpected<core::Error>(report.error());

  // An empty result is not trustworthy
  if (!session.quiet) {
    print("{} of {} points, in {} tiles of at most {} points with their margins\n", report->points_out,
          report->points_in, report->tiles, report->fullest);
  }
  if (report->points_out > 0) return {};
  return core::failure(core::ErrorKind::kUntrustworthy,
                       fmt::format("chain {}: no point is left", chain.name()));
}

core::Result<void> filter(FilterRequest& request, Session& session) {
  // Chain and options
  if (auto given = request.flags.apply(); !given) return given;
  const auto chain = load_chain(request.chain, session);
  if (!chain) return tl::unexpected<core::Error>(chain.error());

  // Problems are found before clouds are read
  const fs::path& output = request.files.back();
  cloud::FilterContext context;
  context.executor = &session.executor();
  if (auto fit = check_outputs(request, *chain); !fit) return fit;
  if (auto fit = chain->ready(context); !fit) return fit;
  if (request.tiles.tiles_m > 0.0) return filter_tiles(request, *chain, session);

  // Columns, frame and shift travel with the points
  cloud::CloudColumns columns;
  cloud::CloudFrame frame;
  auto input = read_inputs(request, columns, context.shift, frame);
  if (!input) return tl::unexpected<core::Error>(input.error());
  context.columns = &columns;
  context.made_columns = &columns;
  context.frame = &frame;

  // One report per filter
  Console& console = session.console();
  std::vector<cloud::FilterReport> reports;
  const auto filtered =
      chain->apply(std::move(*input), context, &reports,
                   [&console](std::size_t done, std::size_t total, const std::string& type) {
                     console.progress(done, total, type.empty() ? "filters" : type.c_str());
                   });

  // A table and the filtered cloud
  console.end_progress();
  if (!filtered) return tl::unexpected<core::Error>(filtered.error());
  if (!session.quiet) print("{}", cloud::to_table(reports));
  if (!session.quiet && !context.shift.isZero(0.0)) print("shift: {}\n", shift_text(context.shift));
  auto written = cloud::write_cloud(output, **filtered, columns, context.shift, frame.comments());
  if (!written) return written;
  return something_left(*chain, reports);
}

/// One line per filter.
int list_filters(Session& session) {
  const auto registry = session.filters();
  if (!registry) return session.fail(registry.error());
  for (const cloud::FilterInfo& info : registry->filters()) {
    print("{:<24} {}\n", info.type, info.summary);
  }
  return 0;
}

core::Result<void> describe_filter(const std::string& name, const Session& session) {
  // Without a name, the page of all filters
  const auto registry = session.filters();
  if (!registry) return tl::unexpected<core::Error>(registry.error());
  if (name.empty()) {
    print("{}", cloud::filters_reference(*registry));
    return {};
  }

  // A misspelt name gets a suggestion
  const cloud::FilterInfo* info = registry->find(name);
  if (info == nullptr) {
    return core::usage_error(
        fmt::format("there is no filter '{}'{}", name, cloud::missing_filter_hint(name, *registry)));
  }

  // Options with their defaults
  print("{}: {}\n\n{}\n\noptions:\n", info->type, info->summary, info->details);
  core::OptionTable table;
  const auto made = info->make();
  made->declare(table);
  for (const core::OptionSpec& spec : table.specs()) {
    print("  {:<20} {} (default: {})\n", spec.key, spec.help, spec.default_value);
  }
  print("\nexample:\n{}\n", info->example);
  return {};
}

}  // namespace

void add_filter(CLI::App& app, Session& session) {
  // The chain and its files
  const auto request = std::make_shared<FilterRequest>();
  CLI::App* command = add_command(app, session, "filter", "Run a filter chain on a cloud file",
                                  [&session, request] { return filter(*request, session); });
  command->add_option("CHAIN", request->chain, "Filter chain: a file or a shipped name")->required();

  // Files to read and the one to write
  command
      ->add_option(
          "FILES", request->files,
          "Clouds to read (.ply, .pcd, .xyz, .csv; several are merged), then the one to write (.ply or .pcd)")
      ->required()
      ->type_name("IN... OUT")
      ->expected(2, -1);

  // Tiles, progress and plugins
  request->flags.add(*command, request->tiles);
  add_progress_option(*command, session);
  add_plugin_option(*command, session);

  // The filters themselves
  CLI::App* group = add_group(app, "filters", "List, describe and check filters");
  add_plugin_option(
      *add_command(*group, session, "list", "List all filters", [&session] { return list_filters(session); }),
      session);

  // One filter or all
  const auto name = std::make_shared<std::string>();
  CLI::App* describe = add_command(
      *group, session, "describe",
      "Describe a filter: options and an example; without NAME print the reference of all filters",
      [&session, name] { return describe_filter(*name, session); });
  describe->add_option("NAME", *name, "Type of the filter");
  add_plugin_option(*describe, session);

  // Chains are checked without clouds
  CLI::App* check =
      add_command(*group, session, "check", "Check a filter chain without running it", [&session, name] {
        const auto chain = load_chain(*name, session);
        if (!chain) return session.fail(chain.error());
        print("{}: {} filters, nothing wrong\n", *name, chain->size());
        return 0;
      });
  check->add_option("CHAIN", *name, "Filter chain: a file or a shipped name")->required();
  add_plugin_option(*check, session);
}

}  // namespace plumbline::cli
