// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The command line: one function per command, each in command_<name>.cpp.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "plumbline/cloud/filters/filter.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/net/ros2.hpp"
#include "plumbline/pipeline/map_recording.hpp"
#include "terminal/console.hpp"

namespace plumbline::cli {

/// State shared by all commands. Values are set once the command line has been parsed.
struct Session {
  bool quiet = false;
  bool verbose = false;
  ProgressStyle progress = ProgressStyle::kAuto;
  int threads = 0;  ///< 0 = one per core
  std::string pipelines_dir;
  std::vector<std::string> plugins;  ///< shared objects with filters, of the commands that take --plugin

  std::function<int()> command;  ///< runs the command that was named; returns the exit code

  [[nodiscard]] core::Result<std::filesystem::path> pipelines_folder() const;
  /// The built-in filters and those of the plugins.
  [[nodiscard]] core::Result<cloud::FilterRegistry> filters() const;
  /// Fills in the folders of pipelines and filters.
  core::Result<void> equip(pipeline::RunRequest& request);
  /// Made on first use: messages and progress on stderr.
  Console& console();
  /// Made on first use.
  const core::Executor& executor();
  /// Prints the error and returns its exit code.
  int fail(const core::Error& error);
  /// Ends the progress of a run, prints its result, which wrote `output`, and returns its exit code.
  int finish(const core::Result<pipeline::RunSummary>& summary, const std::filesystem::path& output);

 private:
  std::unique_ptr<Console> console_;
  std::unique_ptr<core::Executor> executor_;
};

/// A command below `parent` with --help, --version, -q, -v, --threads and --pipelines-dir.
CLI::App* add_command(CLI::App& parent, Session& session, const std::string& name, const std::string& help,
                      std::function<int()> run);
/// The same; the exit code is 0, or that of the error, which is printed.
CLI::App* add_command(CLI::App& parent, Session& session, const std::string& name, const std::string& help,
                      std::function<core::Result<void>()> run);
/// --plugin FILE.so, for commands that use filters.
void add_plugin_option(CLI::App& command, Session& session);
/// --progress, for commands that take long.
void add_progress_option(CLI::App& command, Session& session);
/// -p, --set, --plugin, --force and --progress.
void add_pipeline_options(CLI::App& command, Session& session, pipeline::RunRequest& request);
/// Options for reading a recording or a live camera.
void add_recording_options(CLI::App& command, pipeline::MapRequest& request);
/// Adds the options common to all commands that map a recording.
void add_map_options(CLI::App& command, Session& session, pipeline::MapRequest& request);
/// "701362 4485513 0 m (...)": the shift subtracted from large coordinates when a cloud was read.
std::string shift_text(const Eigen::Vector3d& shift);
/// --rig FILE, for commands that map or fuse.
void add_rig_option(CLI::App& command, std::filesystem::path& rig);
/// --from S and --to S, for commands that read recordings.
void add_time_range(CLI::App& command, dataset::OpenOptions& open);
/// --for and --record, for commands that map live cameras.
void add_live_options(CLI::App& command, pipeline::MapRequest& request);
/// --publish, for commands that make a map.
void add_publish_option(CLI::App& command, std::string& address);
/// Topics and frames of a run on ROS 2's network.
struct PublishRequest {
  std::string address;  ///< of --publish; "": nothing
  std::string frames;   ///< of --frames
  net::OdomTf odom_tf = net::OdomTf::kAuto;
  std::size_t robots = 1;                         ///< of the run
  bool finished_map = false;                      ///< poses are in a finished map
  std::vector<double> grid_heights = {0.1, 1.8};  ///< of --grid-heights, metres
};
/// --publish, --frames and --odom-tf, for commands that map.
void add_frames_options(CLI::App& command, PublishRequest& publish);
/// Sets request.observer to a publisher; `names`, `name`: as for open_ros2_publisher.
core::Result<void> prepare_publisher(Session& session, const PublishRequest& publish,
                                     net::PublishedNames names, const std::string& name,
                                     pipeline::RunRequest& request);
/// Called after the command line is parsed: sets the function that opens addresses, and the stop token.
void prepare_live(pipeline::MapRequest& request);
/// Takes these words alone, each for a value of an enumeration: CLI11's own check shows the numbers behind
/// them.
template <typename Enum>
CLI::Validator one_of(const std::map<std::string, Enum>& words) {
  return CLI::Validator(
      [words](std::string& text) -> std::string {
        std::string allowed;
        for (const auto& [word, value] : words) allowed += (allowed.empty() ? "" : ", ") + word;
        const auto found = words.find(text);
        if (found == words.end()) return fmt::format("'{}' (allowed: {})", text, allowed);
        text = std::to_string(static_cast<int>(found->second));
        return {};
      },
      "");
}
/// --topic, for commands that read recordings, which may be bags.
void add_topic_option(CLI::App& command, dataset::OpenOptions& open);
/// A word that only groups commands, like `evaluate`.
CLI::App* add_group(CLI::App& parent, const std::string& name, const std::string& help);

void add_map(CLI::App& app, Session& session);
void add_localize(CLI::App& app, Session& session);
void add_fuse(CLI::App& app, Session& session);
void add_hub(CLI::App& app, Session& session);
void add_robot(CLI::App& app, Session& session);
void add_keys(CLI::App& app, Session& session);
void add_calibrate(CLI::App& app, Session& session);
void add_convert(CLI::App& app, Session& session);
void add_info(CLI::App& app, Session& session);
void add_render(CLI::App& app, Session& session);
void add_export(CLI::App& app, Session& session);
void add_compare(CLI::App& app, Session& session);
void add_report(CLI::App& app, Session& session);
void add_view(CLI::App& app, Session& session);
void add_check(CLI::App& app, Session& session);
void add_evaluate(CLI::App& app, Session& session);
void add_evaluate_cloud(CLI::App& group, Session& session);  ///< the one below `evaluate`
void add_synth(CLI::App& app, Session& session);
void add_filter(CLI::App& app, Session& session);
void add_pipelines(CLI::App& app, Session& session);
void add_play(CLI::App& app, Session& session);
void add_completion(CLI::App& app, Session& session);  ///< `completion`, `man`; made from all others

/// Parses, runs the command and returns the exit code (see core::ErrorKind).
int run(int argc, char** argv);

}  // namespace plumbline::cli
