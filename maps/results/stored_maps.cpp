// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/stored_maps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "plumbline/core/text.hpp"
#include "plumbline/maps/map_join.hpp"

namespace plumbline::maps {
namespace {

namespace fs = std::filesystem;
using core::KeyframeId;

std::string name_of(const fs::path& file) {
  std::error_code ec;
  const fs::path whole = fs::weakly_canonical(file, ec);
  const std::string name = (ec ? file : whole).parent_path().filename().string();
  return name.empty() ? "robot" : name;
}

/// `name`, or `name-2`, `name-3` ... when it is taken.
std::string free_name(const std::string& name, std::set<std::string>& taken) {
  std::string result = name;
  for (int i = 2; !taken.insert(result).second; ++i) result = fmt::format("{}-{}", name, i);
  return result;
}

}  // namespace

/// Reading is parallel, its order fixed.
core::Result<std::unique_ptr<StoredMaps>> StoredMaps::open(const std::vector<fs::path>& maps,
                                                           const core::Executor& executor, PartOrder order) {
  std::unique_ptr<StoredMaps> result(new StoredMaps);
  std::vector<std::optional<core::Result<StoredPart>>> parts(maps.size());
  executor.parallel_for(maps.size(), [&](std::size_t i) { parts[i].emplace(read_part(maps[i], order)); });
  for (auto& part : parts) {
    if (!part->has_value()) return tl::unexpected(part->error());
    result->parts_.push_back(std::move(**part));
  }
  if (order == PartOrder::kByContent) result->sort_by_content(executor);
  if (auto arranged = result->arrange(executor); !arranged) return tl::unexpected(arranged.error());
  return result;
}

core::Result<StoredPart> StoredMaps::read_part(const fs::path& map, PartOrder order) {
  // A result folder stands for its store
  std::error_code ec;
  const fs::path file = fs::is_directory(map, ec) ? map / "map.db" : map;
  if (!fs::exists(file, ec)) {
    return core::input_error(
        fmt::format("{}: no such map; give result folders of plumbline map", file.string()));
  }

  // A map without keyframes has no frame to align
  auto run = StoredRun::open(file);
  if (!run) return tl::unexpected(run.error());
  if (run->stored().map.keyframe_count() == 0) {
    return core::input_error(fmt::format("{}: the map has no keyframes; leave it out", file.string()));
  }

  // The folder or the robot names a map
  StoredPart part{core::folder_name(name_of(file)), std::move(*run), {}};
  part.robots = part.run.stored().header.robots;
  if (order == PartOrder::kByContent && part.robots.size() == 1) part.robots.front().name = part.name;
  if (order == PartOrder::kAsGiven) part.name = core::folder_name(part.robots.front().name);
  return part;
}

/// Largest map first, so that the order of the arguments does not matter.
void StoredMaps::sort_by_content(const core::Executor& executor) {
  std::vector<std::uint64_t> hashes(parts_.size());
  executor.parallel_for(parts_.size(),
                        [&](std::size_t p) { hashes[p] = content_hash(parts_[p].run.stored().map); });

  // The content's hash breaks ties
  std::vector<std::size_t> order(parts_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t x, std::size_t y) {
    return std::make_tuple(parts_[y].run.stored().map.keyframe_count(), hashes[x], parts_[x].name) <
           std::make_tuple(parts_[x].run.stored().map.keyframe_count(), hashes[y], parts_[y].name);
  });

  // Parts are moved, not copied
  std::vector<StoredPart> sorted;
  sorted.reserve(order.size());
  for (const std::size_t i : order) sorted.push_back(std::move(parts_[i]));
  parts_ = std::move(sorted);
}

/// The numbers and names of robots.
core::Result<void> StoredMaps::arrange(const core::Executor& executor) {
  // A map fused with itself would be doubled
  std::set<std::string> files;
  for (const StoredPart& part : parts_) {
    std::error_code ec;
    if (!files.insert(fs::weakly_canonical(part.run.file(), ec).string()).second) {
      return core::usage_error(fmt::format("{}: is given twice", part.run.file().string()));
    }
  }

  // New robot numbers across all parts
  std::set<std::string> part_names;
  std::set<std::string> robot_names;
  std::int32_t number = 0;
  std::vector<RobotNumbers> numbers(parts_.size());
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    StoredPart& part = parts_[p];
    RobotNumbers& to = numbers[p];
    part.name = free_name(part.name, part_names);

    // Old numbers map to new ones
    for (RobotInfo& robot : part.robots) {
      to[robot.number] = number;
      robot.number = number++;
      robot.versions.clear();
      robot.name = free_name(core::folder_name(robot.name), robot_names);
      robots_.push_back(robot);
    }

    // Every keyframe's robot must be known
    for (const KeyframeId id : part.run.stored().map.keyframe_ids()) {
      if (to.count(id.robot) == 0) {
        return core::input_error(fmt::format("{}: robot {} is not in its list of robots; map it again",
                                             part.run.file().string(), id.robot));
      }
    }
  }

  // Clouds cannot number more robots
  constexpr std::int32_t kMostRobots = 255;  // a cloud file has a byte for it
  if (number > kMostRobots) {
    return core::usage_error(fmt::format("{} robots are too many; {} can be fused", number, kMostRobots));
  }

  // Views follow the new numbers
  std::vector<core::Result<StoredViews>> views(parts_.size());
  executor.parallel_for(parts_.size(), [&](std::size_t p) {
    parts_[p].run.renumber(numbers[p]);
    views[p] = parts_[p].run.views();
  });

  // Clouds in the order of their parts
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    if (!views[p]) return tl::unexpected(views[p].error());
    parts_[p].views = std::move(*views[p]);
    for (std::size_t view = 0; view < parts_[p].views.size(); ++view) clouds_.push_back({p, view});
  }
  return {};
}

/// Names the file that holds the damaged cloud.
core::Error StoredMaps::damaged(KeyframeId id, FrameId frame, const core::Error& how) const {
  const auto cloud = std::find_if(clouds_.begin(), clouds_.end(), [&](const StoredCloud& c) {
    const StoredViews& views = views_of(c);
    return views.keyframes[c.view] == id && views.frames[c.view] == frame;
  });
  const std::string file = cloud == clouds_.end() ? "fused maps" : parts_[cloud->part].run.file().string();
  return core::input_error(fmt::format("{}: a cloud is damaged ({})", file, how.message)).value();
}

/// The part of this name, or with a robot of this name.
core::Result<std::size_t> StoredMaps::find_part(const std::string& name) const {
  std::string names;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    if (parts_[p].name == name) return p;
    for (const RobotInfo& robot : parts_[p].robots) {
      if (robot.name == name) return p;
      names += (names.empty() ? "" : ", ") + robot.name;
    }
  }
  return core::usage_error(fmt::format("--anchor: there is no robot '{}'; there are {}", name, names));
}

core::Result<void> StoredMaps::replace(std::size_t index, Map map, std::vector<FramePose> frames,
                                       double scale) {
  StoredPart& part = parts_[index];
  part.run.replace(std::move(map), std::move(frames));
  replaced_ = true;

  // Clouds are read as those of a further version of their camera.
  const auto rescale = [&](RobotInfo& robot) {
    robot.camera.depth_scale /= scale;
    if (robot.estimate) robot.estimate->found.depth_scale /= scale;
  };
  std::vector<RobotInfo> stored = part.run.stored().header.robots;
  for (std::size_t r = 0; r < stored.size(); ++r) {
    const std::vector<CameraVersion>& versions = stored[r].versions;
    CameraVersion last{versions.empty() ? stored[r].camera : versions.back().camera,
                       std::numeric_limits<std::int32_t>::max(), std::numeric_limits<std::int32_t>::max()};
    last.camera.depth_scale /= scale;
    stored[r].versions.push_back(last);
    rescale(part.robots[r]);
    rescale(robots_[static_cast<std::size_t>(part.robots[r].number)]);
  }
  auto views = part.run.views();
  if (!views) return tl::unexpected(views.error());
  part.views = std::move(*views);
  part.views.cameras = CameraHistory(stored);

  const auto state = part.run.fusion_state();
  if (!state) return tl::unexpected(state.error());
  geometry::Vector6d longer = geometry::Vector6d::Ones();
  longer.head<3>().setConstant(scale);
  for (const auto& [key, covariance] : state->covariances) {
    const auto number = part.views.numbers.find(key.first);
    const std::int32_t robot = number == part.views.numbers.end() ? key.first : number->second;
    part.state.covariances[{robot, key.second}] = longer.asDiagonal() * covariance * longer.asDiagonal();
  }
  return {};
}

}  // namespace plumbline::maps
