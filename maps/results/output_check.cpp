// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/output_check.hpp"

#include <fmt/format.h>

#include <set>
#include <string>
#include <system_error>

#include "plumbline/dataset/recording_poses.hpp"

namespace plumbline::maps {
namespace {

namespace fs = std::filesystem;

/// Names in a result folder (docs/reference/files.md); of a folder everything in it belongs to the result.
const std::set<std::string> kPartsOfAResult{
    "map.ply",     "map.pcd",     "trajectory.txt", "keyframes.txt",    "keyframes.csv", "lines.ply",
    "frames.csv",  "timing.csv",  "summary.json",   "map.db",           "map.db-wal",    "map.db-shm",
    "camera.yaml", "config.yaml", "hub.log",        "snapshots",        "robots",        "meetings",
    "components",  "levels",      "keyframes",      "pose_samples.npy", "adjust.json",   "georeference.json",
    "tags.csv",    "edits.yaml"};

}  // namespace

bool is_part_of_result(const fs::path& file) {
  std::error_code ec;
  const fs::path real = fs::weakly_canonical(file, ec);
  if (ec || !fs::exists(real, ec)) return false;

  std::string part = real.filename().string();  // the folder or file below `folder`
  fs::path folder = real.parent_path();
  constexpr int kDepth = 3;  // OUT/robots/NAME/trajectory.txt

  // The result's folder may be some levels up
  for (int i = 0; i < kDepth; ++i) {
    const bool result = fs::exists(folder / "summary.json", ec) || fs::exists(folder / "map.db", ec);
    if (result && kPartsOfAResult.count(part) > 0) return true;
    part = folder.filename().string();
    folder = folder.parent_path();
  }
  return false;
}

/// Refuses to overwrite an input, a result's part or a recording's part.
core::Result<void> check_output(const fs::path& output, const std::vector<fs::path>& inputs) {
  const auto refused = [&](const char* why) {
    return core::usage_error(fmt::format("{}: {}; choose another name", output.string(), why));
  };

  std::error_code ec;
  for (const fs::path& input : inputs) {
    if (fs::equivalent(output, input, ec)) return refused("is what is read");
  }
  if (is_part_of_result(output)) return refused("is a part of a result, which is not written over");
  if (dataset::is_part_of_recording(output))
    return refused("is a part of a recording, which is not written over");
  return {};
}

}  // namespace plumbline::maps
