// SPDX-License-Identifier: BSD-3-Clause
#include "app.hpp"

#include <fmt/format.h>
#include <pcl/console/print.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>
#include <map>
#include <opencv2/core/utility.hpp>
#include <system_error>
#include <utility>

#include "empty_values.hpp"
#include "plumbline/cloud/filters/filter_plugin.hpp"
#include "plumbline/core/shortage.hpp"
#include "plumbline/session/map.hpp"
#include "terminal/help.hpp"
#include "terminal/print.hpp"
#include "terminal/signals.hpp"
#include "terminal/version_text.hpp"

namespace plumbline::cli {
void add_adjust(CLI::App& app, Session& session);
namespace {

const char* const kFooter =
    "Exit codes: 0 done, 1 a bug, 2 usage or configuration, 3 input data, 4 done but not trustworthy,\n"
    "5 output cannot be written or memory is short, 130 stopped before there was anything to write.\n"
    "More about a command: plumbline COMMAND --help";

/// `code`, unless standard output could not be written: it is buffered, so that a failure may show only at
/// the end. `cause`: its errno, 0 if not known. A reader that has closed the pipe is not an error.
int check_standard_output(Session& session, int code, int cause = 0) {
  errno = 0;
  std::cout.flush();
  std::fflush(stdout);
  if (cause == 0) cause = errno;
  if (std::ferror(stdout) == 0 || cause == EPIPE) return code;
  session.console().error(fmt::format("standard output: cannot be written{}",
                                      cause == 0 ? "" : fmt::format(" ({})", std::strerror(cause))));
  return static_cast<int>(core::ErrorKind::kOutput);
}

/// The exit code of the command that was named.
int run_command(Session& session) {
  // Libraries are silenced: the console reports
  std::cerr.rdbuf(nullptr);  // OpenCV and VTK write there what the console says with the name of the file
  ignore_write_signals();
  cv::setNumThreads(1);                                     // threads come from the executor alone
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // the step that called PCL reports failures

  // A full disk may end any step
  std::string what;
  try {
    return check_standard_output(session, session.command());
  } catch (const std::system_error& e) {
    if (std::ferror(stdout) != 0)  // thrown by fmt::print
      return check_standard_output(session, static_cast<int>(core::ErrorKind::kOutput), e.code().value());

    if (const core::Error error = core::error_of(e); error.kind == core::ErrorKind::kOutput)
      return session.fail(error);
    what = e.what();
  } catch (const std::exception& e) {
    if (const core::Error error = core::error_of(e); error.kind == core::ErrorKind::kOutput)
      return session.fail(error);
    what = e.what();
  }

  // Everything else is a defect
  session.console().error(
      fmt::format("internal error: {}; please report it with the command you gave", what));
  return static_cast<int>(core::ErrorKind::kInternal);
}

}  // namespace

core::Result<std::filesystem::path> Session::pipelines_folder() const {
  return find_pipelines(pipelines_dir);
}

/// The built-in filters and those of plugins.
core::Result<cloud::FilterRegistry> Session::filters() const {
  cloud::FilterRegistry registry = cloud::builtin_filters();
  for (const std::string& file : plugins) {
    if (auto loaded = cloud::load_filter_plugin(file, registry); !loaded) {
      return tl::unexpected<core::Error>(loaded.error());
    }
  }
  return registry;
}

Console& Session::console() {
  if (!console_) console_ = std::make_unique<Console>(quiet, verbose, progress);
  return *console_;
}

const core::Executor& Session::executor() {
  if (!executor_) executor_ = std::make_unique<core::Executor>(threads);
  return *executor_;
}

/// Prints the error; the exit code is its kind.
int Session::fail(const core::Error& error) {
  if (error.listed) {
    console().problems(error);
  } else {
    console().error(error.message);
  }
  return static_cast<int>(error.kind);
}

/// Pipelines, filters and progress, as every run needs them.
core::Result<void> Session::equip(pipeline::RunRequest& request) {
  const auto pipelines = pipelines_folder();
  if (!pipelines) return tl::unexpected<core::Error>(pipelines.error());
  const auto all_filters = filters();
  if (!all_filters) return tl::unexpected<core::Error>(all_filters.error());
  request.pipelines_folder = *pipelines;
  request.filters = *all_filters;
  request.finishing = console().stepping();
  return {};
}

/// Prints the summary; an untrustworthy result has its own exit code.
int Session::finish(const core::Result<pipeline::RunSummary>& summary, const std::filesystem::path& output) {
  console().end_progress();
  if (!summary) return fail(summary.error());
  if (!quiet) print("{}written    {}\n", summary->text, output.string());
  if (summary->reason.empty()) return 0;
  console().warning("the result is not trustworthy: " + summary->reason);
  return static_cast<int>(core::ErrorKind::kUntrustworthy);
}

/// A command with the options that all commands share.
CLI::App* add_command(CLI::App& parent, Session& session, const std::string& name, const std::string& help,
                      std::function<int()> run) {
  CLI::App* command = parent.add_subcommand(name, help);
  command->set_version_flag("--version", version_text());
  CLI::Option* quiet = command->add_flag("-q,--quiet", session.quiet, "Only warnings and errors");
  command->add_flag("-v,--verbose", session.verbose, "Tell more")->excludes(quiet);
  command->add_option("--threads", session.threads, "Threads to use (default: one per core)")
      ->check(CLI::Range(1, 256));
  command->add_option("--pipelines-dir", session.pipelines_dir,
                      "Folder of the shipped pipelines and cameras");
  command->callback([&session, run = std::move(run)] { session.command = run; });
  return command;
}

CLI::App* add_command(CLI::App& parent, Session& session, const std::string& name, const std::string& help,
                      std::function<core::Result<void>()> run) {
  return add_command(parent, session, name, help, [&session, run = std::move(run)]() -> int {
    const auto done = run();
    return done ? 0 : session.fail(done.error());
  });
}

void add_plugin_option(CLI::App& command, Session& session) {
  command.add_option("--plugin", session.plugins, "Shared object with filters of your own; may be repeated")
      ->type_name("FILE.so")
      ->allow_extra_args(false);
}

/// The style of progress, for people or for programs.
void add_progress_option(CLI::App& command, Session& session) {
  const std::map<std::string, ProgressStyle> styles = {
      {"auto", ProgressStyle::kAuto}, {"json", ProgressStyle::kJson}, {"none", ProgressStyle::kNone}};
  command
      .add_option(
          "--progress", session.progress,
          "Progress on stderr: json writes one object per line, for programs; messages are not affected "
          "(default: auto, one line that is rewritten on a terminal, else lines)")
      ->type_name("auto|json|none")
      ->transform(one_of(styles));
}

/// The options of every command that runs a pipeline.
void add_pipeline_options(CLI::App& command, Session& session, pipeline::RunRequest& request) {
  add_progress_option(command, session);
  command
      .add_option("-p,--pipeline", request.pipeline,
                  "Shipped pipeline or file (default: " + request.pipeline + ")")
      ->type_name("PIPELINE");
  command.add_option("--set", request.overrides, "Set an option of a stage; may be repeated")
      ->type_name("stage.key=value")
      ->allow_extra_args(false);
  add_plugin_option(command, session);
  command.add_flag("--force", request.replace, "Replace an earlier result");
}

std::string shift_text(const Eigen::Vector3d& shift) {
  return fmt::format(
      "{:.0f} {:.0f} {:.0f} m (taken off the coordinates while computing, added again when written)",
      shift.x(), shift.y(), shift.z());
}

/// Seconds after the first frame, for every command that reads recordings.
void add_time_range(CLI::App& command, dataset::OpenOptions& open) {
  command.add_option("--from", open.from_s, "Start this many seconds after the first frame")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber);
  command.add_option("--to", open.to_s, "End this many seconds after the first frame")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber);
}

void add_topic_option(CLI::App& command, dataset::OpenOptions& open) {
  // A role and a topic, joined by =
  const auto take = [&open](const std::vector<std::string>& given) {
    for (const std::string& pair : given) {
      const std::size_t equals = pair.find('=');
      const std::string what = pair.substr(0, equals);
      std::string* name = what == "color"        ? &open.topics.color
                          : what == "depth"      ? &open.topics.depth
                          : what == "info"       ? &open.topics.info
                          : what == "depth_info" ? &open.topics.depth_info
                                                 : nullptr;

      // A typing error is reported with the roles
      if (name == nullptr || equals == std::string::npos || equals + 1 == pair.size()) {
        throw CLI::ValidationError(
            "--topic", fmt::format("'{}' (allowed: color=, depth=, info= or depth_info= and a topic)", pair));
      }
      *name = pair.substr(equals + 1);
    }
  };

  // One flag for all roles
  command
      .add_option_function<std::vector<std::string>>(
          "--topic", take,
          "Topic of a bag or a live camera, if it is not found automatically: color, depth, info (colour's "
          "CameraInfo) or depth_info; may be repeated")
      ->type_name("WHAT=/TOPIC")
      ->allow_extra_args(false);
}

CLI::App* add_group(CLI::App& parent, const std::string& name, const std::string& help) {
  CLI::App* group = parent.add_subcommand(name, help);
  group->set_version_flag("--version", version_text());
  group->require_subcommand(1);
  return group;
}

int run(int argc, char** argv) {
  // Options before the command
  CLI::App app("Plumbline: RGB-D recordings in, one dense coloured metric point cloud out.", "plumbline");
  app.set_version_flag("--version", version_text());
  app.require_subcommand(1);
  app.footer(kFooter);
  app.formatter(std::make_shared<PlainHelp>());

  // The order of the commands in --help
  Session session;
  for (const auto add : {add_map,       add_localize,  add_fuse,   add_hub,       add_robot,  add_keys,
                         add_calibrate, add_convert,   add_info,   add_render,    add_export, add_report,
                         add_view,      add_compare,   add_adjust, add_evaluate,  add_check,  add_synth,
                         add_filter,    add_pipelines, add_play,   add_completion}) {
    add(app, session);
  }

  // Empty values are typing errors in scripts
  refuse_empty_values(app);

  try {
    if (const std::string name = empty_assignment(app, argc, argv); !name.empty())
      throw CLI::ValidationError(name, kEmptyValue);
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) {  // --help, --version
      errno = 0;
      app.exit(e);
      return check_standard_output(session, 0, errno);
    }

    return session.fail({core::ErrorKind::kUsage, usage_problem(app, e)});
  }

  return run_command(session);
}

}  // namespace plumbline::cli
