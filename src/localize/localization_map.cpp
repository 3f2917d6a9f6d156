// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/localize/localization_map.hpp"

#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "plumbline/maps/stored_run.hpp"
#include "plumbline/sensor/camera_file.hpp"

namespace plumbline::localize {
namespace {

namespace fs = std::filesystem;

/// A log beside the store is of a program that writes it or was killed: opening it would write there.
bool is_being_written(const fs::path& store) {
  std::error_code ec;
  return fs::exists(store.string() + "-wal", ec) || fs::exists(store.string() + "-journal", ec);
}

/// True if both describe the same camera, whatever they call it and however well they know it.
bool same(sensor::Camera a, sensor::Camera b) {
  a.name.clear();
  b.name.clear();
  a.sigma = b.sigma = {};
  return sensor::to_yaml(a) == sensor::to_yaml(b);
}

}  // namespace

/// Reads the finished map of a result; refuses a map that another program is still writing.
core::Result<LocalizationMap> open_localization_map(const fs::path& input) {
  const auto place = maps::find_map(input);
  if (!place) return tl::unexpected<core::Error>(place.error());

  // Places are recognised by stored features
  const fs::path& store = place->store;
  if (store.empty()) {
    return core::input_error(fmt::format(
        "{}: has no {}, in which places are found; map again with a pipeline that has a store stage",
        input.string(), maps::kStoreFile));
  }

  // A map that is still growing would change under the reader
  const auto unfinished = [&] {
    return core::input_error(
        fmt::format("{}: is of a run that has not ended; let it end, or continue it with plumbline map "
                    "--resume",
                    store.string()));
  };
  if (is_being_written(store)) return unfinished();

  // Only a complete map with keyframes can be used
  const auto run = maps::StoredRun::open_main(*place);
  if (!run) return tl::unexpected<core::Error>(run.error());
  const maps::StoredMap& stored = run->stored();
  if (!stored.complete) return unfinished();
  if (stored.map.keyframe_count() == 0)
    return core::input_error(fmt::format("{}: has no keyframes; map the recording again", store.string()));
  return LocalizationMap{stored.map, stored.header.robots, stored.result.output_from_map,
                         stored.result.upright};
}

std::optional<sensor::Camera> refined_in(const LocalizationMap& map, const sensor::Camera& given) {
  for (const maps::RobotInfo& robot : map.robots) {
    if (!robot.versions.empty() && same(robot.camera, given)) return robot.versions.back().camera;
  }
  return std::nullopt;
}

}  // namespace plumbline::localize
