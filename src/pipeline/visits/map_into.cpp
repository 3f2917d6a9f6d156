// SPDX-License-Identifier: BSD-3-Clause
#include "visits/map_into.hpp"

#include <fmt/format.h>

#include <fstream>
#include <system_error>
#include <vector>

#include "plumbline/core/hash.hpp"
#include "plumbline/core/own_files.hpp"
#include "plumbline/localize/localization_map.hpp"
#include "plumbline/maps/output_folder.hpp"
#include "plumbline/maps/stored_run.hpp"
#include "plumbline/pipeline/fuse_maps.hpp"
#include "results/resumed_run.hpp"

namespace plumbline::pipeline {
namespace {

namespace fs = std::filesystem;

core::Result<std::string> contents_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  core::Hash hash;
  std::vector<char> some(1U << 20U);
  while (stream.read(some.data(), static_cast<std::streamsize>(some.size())) || stream.gcount() > 0)
    hash.bytes(some.data(), static_cast<std::size_t>(stream.gcount()));
  if (!stream.eof()) return core::input_error(fmt::format("{}: cannot be read", file.string()));
  return fmt::format("{:016x}", hash.value());
}

/// Checks that MAP can be visited, and gives a text that changes with it.
core::Result<std::string> check_map(const MapRequest& request) {
  const auto map = localize::open_localization_map(request.into);
  if (!map) return tl::unexpected(map.error());
  const fs::path store = maps::find_map(request.into)->store;
  std::error_code ec;
  if (fs::weakly_canonical(request.output, ec) == fs::weakly_canonical(store.parent_path(), ec)) {
    return core::usage_error(fmt::format(
        "{}: is the map of --into, which stays as it is; give another folder", request.output.string()));
  }
  return contents_of(store);
}

}  // namespace

fs::path visit_folder(const fs::path& out) { return out.string() + ".visit"; }

core::Result<RunSummary> map_into(const MapRequest& request, const core::Executor& executor, core::Log& log,
                                  const core::StopToken& stop, const Progress& progress) {
  const auto contents = check_map(request);
  if (!contents) return tl::unexpected(contents.error());

  // The visit by itself, unless an interrupted run has finished with that.
  MapRequest visit = request;
  visit.part = PipelinePart::kMapping;
  visit.into_contents = *contents;
  visit.output = visit_folder(request.output);

  const auto finished = request.resume ? is_finished(visit.output, request.replace) : false;
  if (!finished) return tl::unexpected(finished.error());
  if (*finished) {
    if (auto same = check_contents(visit.output, *contents); !same) return tl::unexpected(same.error());
  } else {
    auto mapped = map_recording(visit, executor, log, stop, progress);
    if (!mapped) return mapped;
    if (!mapped->reason.empty()) log.warning("the visit by itself: " + mapped->reason);
  }

  FuseRequest join;
  static_cast<RunRequest&>(join) = request;

  join.observer = nullptr;
  join.into = request.into;
  join.maps = {visit.output};

  join.replace = request.replace || request.resume;

  auto joined = fuse_stored_maps(join, executor, log, core::StopToken(), progress);
  if (!joined) {
    joined.error().message +=
        fmt::format("; the visit is kept in {}: --resume continues", visit.output.string());

    return joined;
  }

  if (auto removed = core::remove_own_files(visit.output, maps::result_kind().files); !removed)
    log.warning(removed.error().message);
  return joined;
}

}  // namespace plumbline::pipeline
