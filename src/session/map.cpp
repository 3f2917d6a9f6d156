// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/session/map.hpp"

#include <fmt/format.h>
#include <stdlib.h>  // mkdtemp

#include <cerrno>
#include <map>
#include <system_error>

#include "guarded.hpp"
#include "plumbline/adjust/adjust.hpp"
#include "plumbline/core/shortage.hpp"
#include "plumbline/pipeline/fuse_maps.hpp"
#include "plumbline/pipeline/map_recording.hpp"
#include "plumbline/session/background.hpp"
#include "run_request.hpp"

namespace plumbline {
namespace session {

namespace fs = std::filesystem;

core::Error as_error(const std::exception& problem) {
  core::Error error = core::error_of(problem);
  if (error.kind == core::ErrorKind::kInternal) error.message.insert(0, "internal error: ");
  return error;
}

/// The output folder; without a name a temporary one, removed when the last owner is gone.
core::Result<Place> place_of(const fs::path& output) {
  if (!output.empty()) return Place{output, nullptr};
  std::error_code ec;
  std::string folder = (fs::temp_directory_path(ec) / "plumbline-XXXXXX").string();
  if (ec || mkdtemp(folder.data()) == nullptr) {
    return core::output_error(fmt::format("{}: cannot be made ({}); name an output folder", folder,
                                          std::generic_category().message(errno)));
  }

  // Removed together with the last result that reads it
  const auto remove = [](fs::path* made) {
    std::error_code ignored;
    fs::remove_all(*made, ignored);
    delete made;
  };
  return Place{fs::path(folder) / "result", std::shared_ptr<fs::path>(new fs::path(folder), remove)};
}

core::Result<void> fill(pipeline::RunRequest& request, const RunOptions& options, const fs::path& output) {
  const auto pipelines = find_pipelines(options.pipelines_folder);
  if (!pipelines) return tl::unexpected(pipelines.error());
  request.pipelines_folder = *pipelines;
  request.output = output;
  if (!options.pipeline.empty()) request.pipeline = options.pipeline;
  request.overrides = options.set;
  request.filters = options.filters;
  request.replace = options.replace;
  return {};
}

/// Options of a recording as the reader takes them; unknown names are errors.
core::Result<dataset::OpenOptions> open_options(const RecordingOptions& options, const fs::path& pipelines) {
  dataset::OpenOptions open;
  open.format = options.format;
  open.camera = options.camera;
  open.cameras_folder = pipelines / "cameras";
  open.from_s = options.from_s;
  open.to_s = options.to_s.value_or(open.to_s);
  open.every = options.every;

  // Poses of the recording: prior, truth or unused
  const std::map<std::string, dataset::PoseUse> uses{{"prior", dataset::PoseUse::kPrior},
                                                     {"given", dataset::PoseUse::kGiven},
                                                     {"ignore", dataset::PoseUse::kIgnore}};
  const auto use = uses.find(options.poses);
  if (use == uses.end())
    return core::usage_error("poses: there is no '" + options.poses + "' (allowed: prior, given, ignore)");
  open.poses = use->second;

  // Topics are given by the kind of their messages
  const std::map<std::string, std::string*> names{{"color", &open.topics.color},
                                                  {"depth", &open.topics.depth},
                                                  {"info", &open.topics.info},
                                                  {"depth_info", &open.topics.depth_info}};

  for (const auto& [what, topic] : options.topics) {
    const auto name = names.find(what);
    if (name == names.end())
      return core::usage_error("topics: there is no '" + what +
                               "' (allowed: color, depth, info, depth_info)");
    *name->second = topic;
  }
  return open;
}

/// Maps on a thread pool, with OpenCV's threads turned off and exceptions as errors.
core::Result<pipeline::RunSummary> run_map(const pipeline::MapRequest& request, const RunOptions& options) {
  return guarded([&] {
    const OpenCvThreads one;
    const core::Executor executor(options.threads);
    const auto log = options.log != nullptr ? options.log : core::null_log();
    return pipeline::map_recording(request, executor, *log, options.stop, options.progress);
  });
}

/// A request from the options; given poses and a known map have pipelines made for them.
core::Result<pipeline::RunSummary> run_map(const std::string& input, const fs::path& output,
                                           const MapOptions& options) {
  pipeline::MapRequest request;
  if (options.poses == "given") request.pipeline = "known_poses";
  if (!options.known_map.empty()) request.pipeline = "localize";
  if (auto filled = fill(request, options, output); !filled) return tl::unexpected(filled.error());

  // Recording and its cameras
  auto open = open_options(options, request.pipelines_folder);
  if (!open) return tl::unexpected(open.error());
  request.open = std::move(*open);
  request.input = input;
  request.others = options.others;
  request.resume = options.resume;
  request.known_map = options.known_map;
  request.into = options.into;
  request.rig = options.rig;
  return run_map(request, options);
}

/// Fuses finished maps as `plumbline fuse` does.
core::Result<pipeline::RunSummary> run_fuse(const std::vector<fs::path>& maps, const fs::path& output,
                                            const FuseOptions& options) {
  return guarded([&]() -> core::Result<pipeline::RunSummary> {
    pipeline::FuseRequest request;
    if (auto filled = fill(request, options, output); !filled) return tl::unexpected(filled.error());
    request.maps = maps;
    request.anchor = options.anchor;
    request.rig = options.rig;

    const OpenCvThreads one;
    const core::Executor executor(options.threads);
    const auto log = options.log != nullptr ? options.log : core::null_log();
    return pipeline::fuse_stored_maps(request, executor, *log, options.stop, options.progress);
  });
}

core::Result<pipeline::RunSummary> run_adjust(const fs::path& map, const fs::path& output,
                                              const adjust::AdjustRequest& wanted,
                                              const FuseOptions& options) {
  return guarded([&]() -> core::Result<pipeline::RunSummary> {
    pipeline::FuseRequest request;
    if (auto filled = fill(request, options, output); !filled) return tl::unexpected(filled.error());
    const auto settings = adjust::fusion_settings(map);
    if (!settings) return tl::unexpected(settings.error());
    request.overrides.insert(request.overrides.begin(), settings->begin(), settings->end());
    request.maps = {map};

    const OpenCvThreads one;
    const core::Executor executor(options.threads);
    const auto log = options.log != nullptr ? options.log : core::null_log();
    request.change = adjust::change_of(wanted, executor, *log);
    return pipeline::fuse_stored_maps(request, executor, *log, options.stop, options.progress);
  });
}

}  // namespace session

core::Result<Result> map(const std::string& input, const std::filesystem::path& output,
                         const MapOptions& options) {
  // A temporary folder lives as long as its result
  return session::guarded([&] {
    return session::place_of(output).and_then([&](const session::Place& place) {
      return session::run_map(input, place.output, options).and_then([&](const pipeline::RunSummary&) {
        return Result::open(place.output, place.kept);
      });
    });
  });
}

core::Result<Result> fuse(const std::vector<std::filesystem::path>& maps, const std::filesystem::path& output,
                          const FuseOptions& options) {
  // A temporary folder lives as long as its result
  return session::guarded([&] {
    return session::place_of(output).and_then([&](const session::Place& place) {
      return session::run_fuse(maps, place.output, options).and_then([&](const pipeline::RunSummary&) {
        return Result::open(place.output, place.kept);
      });
    });
  });
}

}  // namespace plumbline
