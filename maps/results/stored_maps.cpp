// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/stored_maps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <system_error>
#include <utility>

#include "plumbline/cloud/compact/compact_cloud.hpp"
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

/// Its robots' numbers in this run.
void renumber(StoredPart& part) {
  const auto stays = [](const auto& number) { return number.first == number.second; };
  if (std::all_of(part.numbers.begin(), part.numbers.end(), stays)) return;
  part.map = renumbered(part.map, part.numbers);
  for (FramePose& frame : part.frames) {
    const auto found = part.numbers.find(frame.reference.robot);
    if (frame.reference.valid() && found != part.numbers.end()) frame.reference.robot = found->second;
  }
}

}  // namespace

core::Result<std::unique_ptr<StoredMaps>> StoredMaps::open(const std::vector<fs::path>& maps,
                                                           const core::Executor& executor) {
  std::unique_ptr<StoredMaps> result(new StoredMaps);
  std::vector<core::Result<StoredPart>> parts(maps.size());
  executor.parallel_for(maps.size(), [&](std::size_t i) { parts[i] = read_part(maps[i]); });
  for (core::Result<StoredPart>& part : parts) {
    if (!part) return tl::unexpected(part.error());
    result->parts_.push_back(std::move(*part));
  }
  if (auto arranged = result->arrange(executor); !arranged) return tl::unexpected(arranged.error());
  for (std::size_t p = 0; p < result->parts_.size(); ++p) {
    if (auto listed = result->list_clouds(p); !listed) return tl::unexpected(listed.error());
  }
  return result;
}

core::Result<StoredPart> StoredMaps::read_part(const fs::path& map) {
  std::error_code ec;
  const fs::path file = fs::is_directory(map, ec) ? map / "map.db" : map;
  if (!fs::exists(file, ec)) {
    return core::input_error(
        fmt::format("{}: no such map; give result folders of plumbline map", file.string()));
  }

  auto reader = StoreReader::open(file);
  if (!reader) return tl::unexpected(reader.error());
  reader->read_ahead();

  auto stored = reader->load();
  if (!stored) return tl::unexpected(stored.error());
  if (stored->map.keyframe_count() == 0) {
    return core::input_error(fmt::format("{}: the map has no keyframes; leave it out", file.string()));
  }

  StoredPart part;
  part.name = name_of(file);
  part.file = file;
  part.robots = reader->header().robots;
  if (part.robots.size() == 1) part.robots.front().name = part.name;
  part.reader = std::make_unique<StoreReader>(std::move(*reader));
  part.map = std::move(stored->map);
  part.frames = std::move(stored->frames);
  return part;
}

/// The order of parts, the numbers and names of robots: by content.
core::Result<void> StoredMaps::arrange(const core::Executor& executor) {
  std::vector<std::uint64_t> hashes(parts_.size());
  executor.parallel_for(parts_.size(), [&](std::size_t p) { hashes[p] = content_hash(parts_[p].map); });

  std::set<std::string> files;
  for (const StoredPart& part : parts_) {
    std::error_code ec;
    if (!files.insert(fs::weakly_canonical(part.file, ec).string()).second) {
      return core::usage_error(fmt::format("{}: is given twice", part.file.string()));
    }
  }

  std::vector<std::size_t> order(parts_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t x, std::size_t y) {
    return std::make_tuple(parts_[y].map.keyframe_count(), hashes[x], parts_[x].name) <
           std::make_tuple(parts_[x].map.keyframe_count(), hashes[y], parts_[y].name);
  });

  std::vector<StoredPart> sorted;
  for (const std::size_t i : order) sorted.push_back(std::move(parts_[i]));
  parts_ = std::move(sorted);

  for (StoredPart& part : parts_) {
    part.cameras = CameraHistory(part.robots);
    for (RobotInfo& robot : part.robots) robot.versions.clear();
  }

  std::set<std::string> part_names;
  std::set<std::string> robot_names;
  std::int32_t number = 0;

  for (StoredPart& part : parts_) {
    std::map<std::int32_t, std::int32_t>& to = part.numbers;
    part.name = free_name(part.name, part_names);
    for (RobotInfo& robot : part.robots) {
      to[robot.number] = number;
      robot.number = number++;
      robot.name = free_name(robot.name, robot_names);
      robots_.push_back(robot);
    }

    for (const KeyframeId id : part.map.keyframe_ids()) {
      if (to.count(id.robot) == 0) {
        return core::input_error(fmt::format("{}: robot {} is not in its list of robots; map it again",
                                             part.file.string(), id.robot));
      }
    }
  }

  constexpr std::int32_t kMostRobots = 255;  // a cloud file has a byte for it
  if (number > kMostRobots) {
    return core::usage_error(fmt::format("{} robots are too many; {} can be fused", number, kMostRobots));
  }

  executor.parallel_for(parts_.size(), [&](std::size_t p) {
    renumber(parts_[p]);
    parts_[p].paths = by_robot(poses_of(parts_[p].map, parts_[p].frames));
  });

  return {};
}

core::Result<void> StoredMaps::list_clouds(std::size_t p) {
  const StoredPart& part = parts_[p];
  const auto ids = part.reader->cloud_ids();
  if (!ids) return tl::unexpected(ids.error());

  for (const KeyframeId stored : *ids) {
    const auto found = part.numbers.find(stored.robot);
    if (found == part.numbers.end()) continue;
    const KeyframeId id{found->second, stored.index};
    if (part.map.has_keyframe(id)) clouds_.push_back({p, stored.robot, id, {}, part.map.keyframe(id).stamp});
  }

  const auto frames = part.reader->frame_cloud_ids();
  if (!frames) return tl::unexpected(frames.error());
  std::map<std::int32_t, std::vector<double>> stamps;  // of frames, by robot
  for (const FramePose& frame : part.frames) stamps[frame.reference.robot].push_back(frame.stamp);

  for (const FrameId stored : *frames) {
    const auto found = part.numbers.find(stored.robot);
    if (found == part.numbers.end()) continue;
    const std::vector<double>& own = stamps[found->second];
    const auto place = static_cast<std::size_t>(stored.index);
    if (place < own.size()) {
      clouds_.push_back({p, stored.robot, {}, {found->second, stored.index}, own[place]});
    }
  }

  return {};
}

geometry::Vector6d StoredMaps::velocity_of(const StoredCloud& cloud) const {
  const auto& paths = parts_[cloud.part].paths;
  const auto path = paths.find(cloud.id.valid() ? cloud.id.robot : cloud.frame.robot);
  return path == paths.end() ? geometry::Vector6d(geometry::Vector6d::Zero())
                             : geometry::velocity_at(path->second, cloud.stamp);
}

core::Result<std::vector<std::uint8_t>> StoredMaps::cloud_bytes(std::size_t index) const {
  const StoredCloud& cloud = clouds_.at(index);
  const StoreReader& reader = *parts_[cloud.part].reader;
  const CameraHistory& cameras = parts_[cloud.part].cameras;
  const core::KeyframeId id{cloud.stored_robot, cloud.id.index};
  const FrameId frame{cloud.stored_robot, cloud.frame.index};

  auto bytes = cloud.id.valid() ? reader.cloud_bytes(id) : reader.cloud_bytes(frame);
  if (!bytes || !(cloud.id.valid() ? cameras.changes(id) : cameras.changes(frame))) return bytes;
  const auto decoded = cloud::decode_cloud(bytes->data(), bytes->size());
  if (!decoded) return tl::unexpected(decoded.error());
  const geometry::Vector6d velocity = velocity_of(cloud);
  if (cloud.id.valid()) {
    cameras.apply(id, velocity, **decoded);
  } else {
    cameras.apply(frame, velocity, **decoded);
  }
  return cloud::encode_cloud(**decoded);
}

core::Result<std::optional<StoredSurface>> StoredMaps::surface(std::size_t index) const {
  const StoredCloud& cloud = clouds_.at(index);
  if (!cloud.id.valid()) return std::nullopt;
  const core::KeyframeId id{cloud.stored_robot, cloud.id.index};
  const auto bytes = parts_[cloud.part].reader->surface_bytes(id);
  if (!bytes) return tl::unexpected(bytes.error());
  if (bytes->empty()) return std::nullopt;
  auto surface = unpack_surface(*bytes);
  if (!surface) return tl::unexpected(surface.error());
  parts_[cloud.part].cameras.apply(id, velocity_of(cloud), surface->samples);
  return std::optional(std::move(*surface));
}

core::Error StoredMaps::damaged(KeyframeId id, FrameId frame, const core::Error& how) const {
  const auto cloud = std::find_if(clouds_.begin(), clouds_.end(),
                                  [&](const StoredCloud& c) { return c.id == id && c.frame == frame; });
  const std::string file = cloud == clouds_.end() ? "fused maps" : parts_[cloud->part].file.string();
  return core::input_error(fmt::format("{}: a cloud is damaged ({})", file, how.message)).value();
}

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

}  // namespace plumbline::maps
