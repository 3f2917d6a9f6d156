// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/evaluate/companions.hpp"

#include <algorithm>
#include <system_error>

namespace plumbline::evaluate {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

/// Names of subfolders that hold `file`, sorted; none if `folder` cannot be read.
std::vector<std::string> subfolders_with(const fs::path& folder, const char* file) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (is_file(it->path() / file)) names.push_back(it->path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

}  // namespace

/// Trajectories in the folder of the cloud, with the truth in that of the reference.
std::vector<TrajectoryFiles> find_trajectories(const fs::path& cloud, const fs::path& reference) {
  // Folders of result and world
  const fs::path map = folder_of(cloud);
  const fs::path world = folder_of(reference);
  const std::vector<std::string> truths = subfolders_with(world, "groundtruth.txt");

  // One trajectory of a robot or a fused map
  if (is_file(map / "trajectory.txt")) {
    const fs::path estimate = map / "trajectory.txt";
    if (is_file(world / "groundtruth.txt")) return {{"", estimate, world / "groundtruth.txt"}};
    if (truths.size() == 1) return {{"", estimate, world / truths.front() / "groundtruth.txt"}};
    return {};
  }

  // Several robots are matched by name
  std::vector<TrajectoryFiles> pairs;
  for (const std::string& robot : subfolders_with(map / "robots", "trajectory.txt")) {
    if (!std::binary_search(truths.begin(), truths.end(), robot)) continue;
    pairs.push_back({robot, map / "robots" / robot / "trajectory.txt", world / robot / "groundtruth.txt"});
  }
  return pairs;
}

/// Other files of true poses in the same folder.
std::vector<std::string> other_truths(const fs::path& truth) {
  constexpr const char* kBegin = "groundtruth";
  const std::string own = truth.filename().string();
  std::vector<std::string> names;
  if (own.rfind(kBegin, 0) != 0) return names;

  // Names that begin as the given one does
  std::error_code error;
  for (fs::directory_iterator it(folder_of(truth), error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    const fs::path ending = it->path().extension();
    if (name.rfind(kBegin, 0) == 0 && name != own && (ending == ".txt" || ending == ".csv"))
      names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace plumbline::evaluate
