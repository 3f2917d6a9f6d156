// SPDX-License-Identifier: BSD-3-Clause
#include "results/resumed_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <system_error>
#include <utility>

#include "plumbline/core/config.hpp"
#include "results/frame_rows.hpp"

namespace plumbline::pipeline {
namespace {

namespace fs = std::filesystem;
using Values = std::map<std::string, std::string>;  ///< by dotted path

void flatten(const core::ConfigNode& node, const std::string& path, Values& values) {
  if (node.kind != core::ConfigNode::Kind::kMap) {
    values[path] = core::to_flow_yaml(node);
    return;
  }
  for (const auto& [key, value] : node.entries) flatten(value, path.empty() ? key : path + "." + key, values);
}

/// True for settings that change neither the map nor its files: names, and inputs that are compared by
/// content.
bool of_no_matter(const std::string& path) {
  for (const char* key : {"run.input", "run.folder", "run.into", "run.pipeline", "run.camera", "run.format",
                          "run.threads", "description"}) {
    if (path == key) return true;
  }
  return false;
}

Values values_of(const std::string& yaml) {
  Values values;
  const auto tree = core::parse_yaml(yaml, "configuration");
  if (tree) flatten(*tree, "", values);
  return values;
}

std::vector<std::string> differences(const std::string& before, const std::string& now) {
  const Values then = values_of(before);
  const Values here = values_of(now);
  Values all = then;
  all.insert(here.begin(), here.end());
  const auto text = [](const Values& values, const std::string& path) {
    const auto found = values.find(path);
    return found == values.end() ? std::string("not there") : found->second;
  };
  std::vector<std::string> found;
  for (const auto& [path, value] : all) {
    if (of_no_matter(path) || text(then, path) == text(here, path)) continue;
    const std::string name = path.rfind("stages.", 0) == 0 ? path.substr(7) : path;
    found.push_back(fmt::format("{} was {} and is {} now", name, text(then, path), text(here, path)));
  }
  return found;
}

core::Result<void> check_same(const fs::path& file, const char* what, const std::string& before,
                              const std::string& now) {
  const std::vector<std::string> found = differences(before, now);
  if (found.empty()) return {};
  const std::string more = found.size() > 1 ? fmt::format(" (and {} more)", found.size() - 1) : "";
  return core::usage_error(fmt::format(
      "{}: was begun with another {}: {}{}; give the same again, or leave out --resume to start again",
      file.string(), what, found.front(), more));
}

/// Adds the lines of a log.
core::Result<void> add_rows(const fs::path& file, const std::vector<std::string>& log,
                            std::vector<FrameRow>& rows) {
  for (const std::string& line : log) {
    auto row = read_line(line);
    if (!row) {
      return core::input_error(
          fmt::format("{}: its log is damaged; leave out --resume to start again", file.string()));
    }
    rows.push_back(*std::move(row));
  }
  return {};
}

/// Each robot's frames up to its last row are done; all, when only results were not written.
core::Result<void> find_done(const RobotRecordings& recordings, ResumedRun& run) {
  std::sort(run.rows.begin(), run.rows.end(),
            [](const FrameRow& a, const FrameRow& b) { return a.frame < b.frame; });
  std::map<std::int32_t, std::size_t> last;  // by robot
  for (std::size_t i = 0; i < run.rows.size(); ++i) {
    const std::size_t frame = run.rows[i].frame;
    if (frame >= recordings.size() || (i > 0 && frame == run.rows[i - 1].frame)) {
      return core::input_error(
          fmt::format("{}: its log is damaged; leave out --resume to start again", run.store.string()));
    }
    last[recordings.robot_of(frame)] = frame;
  }
  for (std::size_t f = 0; f < recordings.size(); ++f) {
    const auto found = last.find(recordings.robot_of(f));
    run.done.push_back(run.merged || (found != last.end() && f <= found->second));
    run.frames += run.done.back() ? 1 : 0;
  }
  return {};
}

/// Assigns the stored maps to the robots of the run.
void take_maps(std::vector<maps::StoredMap> maps, std::size_t robots, ResumedRun& run) {
  for (maps::StoredMap& stored : maps) {
    if (stored.map.keyframe_count() == 0) continue;
    run.keyframes += stored.map.keyframe_count();
    if (stored.complete && robots > 1) {
      run.merged = RobotMap{"", stored.header.robots, std::make_shared<maps::Map>(std::move(stored.map)),
                            std::move(stored.frames)};
    } else {
      run.maps[stored.map.keyframe_ids().front().robot] = std::move(stored);
    }
  }
}

/// True if nothing was committed to the store yet, or there is none.
bool is_blank(const fs::path& file) {
  std::error_code ec;
  if (!fs::exists(file, ec)) return true;
  const auto blank = maps::is_blank_store(file);
  return blank && *blank;
}

void remove_store(const fs::path& file) {
  std::error_code ignored;
  for (const char* ending : {"", "-wal", "-shm", "-journal"}) fs::remove(file.string() + ending, ignored);
}

}  // namespace

core::Result<void> check_contents(const fs::path& folder, const std::string& contents) {
  const fs::path file = folder / maps::kStoreFile;
  const auto store = maps::StoreReader::open(file);
  if (!store) return tl::unexpected(store.error());
  const Values values = values_of(store->header().configuration);
  const auto before = values.find("run.contents_of_map");
  return check_same(file, "map", "contents: " + (before == values.end() ? "none" : before->second),
                    "contents: " + contents);
}

std::size_t stored_keyframes(const fs::path& folder) {
  const fs::path file = folder / maps::kStoreFile;
  if (is_blank(file)) return 0;
  const auto store = maps::StoreReader::open(file);
  if (!store) return 0;
  const auto contents = store->contents();
  return contents ? contents->keyframes : 0;
}

core::Result<std::optional<ResumedRun>> open_resumed(const fs::path& folder, const std::string& configuration,
                                                     const std::string& input,
                                                     const RobotRecordings& recordings) {
  ResumedRun run;
  run.store = folder / maps::kStoreFile;
  if (is_blank(run.store)) {
    remove_store(run.store);
    return std::nullopt;
  }

  const auto reader = maps::StoreReader::open(run.store);
  if (!reader) return tl::unexpected(reader.error());

  auto maps = reader->load_each();
  if (!maps) return tl::unexpected(maps.error());

  // A run that was killed before its first keyframe left nothing to continue from.
  if (maps->size() == 1 && maps->front().map.keyframe_count() == 0) {
    remove_store(run.store);
    return std::nullopt;
  }

  // Only the same recording, cameras and options continue the map as the interrupted run would have done; a
  // mixture of two could not be made by any single run.
  const maps::StoreHeader& header = reader->header();
  if (auto same = check_same(run.store, "recording", header.input, input); !same)
    return tl::unexpected(same.error());

  for (const RobotInfo& robot : header.robots) {
    const sensor::Camera camera = maps::camera_of(recordings.robots(), robot.number);
    if (auto same = check_same(run.store, "camera", sensor::to_yaml(robot.camera), sensor::to_yaml(camera));
        !same) {
      return tl::unexpected(same.error());
    }
  }

  if (auto same = check_same(run.store, "configuration", header.configuration, configuration); !same) {
    return tl::unexpected(same.error());
  }

  for (const maps::StoredMap& stored : *maps) {
    if (auto rows = add_rows(run.store, stored.log, run.rows); !rows) return tl::unexpected(rows.error());
  }

  take_maps(std::move(*maps), recordings.robots().size(), run);
  if (auto found = find_done(recordings, run); !found) return tl::unexpected(found.error());
  return run;
}

}  // namespace plumbline::pipeline
