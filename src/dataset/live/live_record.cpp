// SPDX-License-Identifier: BSD-3-Clause
#include "live/live_record.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <system_error>

#include "bags/bag_parts.hpp"

namespace plumbline::dataset {
namespace {

/// "sensor_msgs/Image" as ROS 2 calls it.
std::string ros2_type(const std::string& type) {
  const std::size_t slash = type.find('/');
  return type.substr(0, slash) + "/msg" + type.substr(slash);
}

}  // namespace

LiveRecord::LiveRecord(std::unique_ptr<BagWriter> bag, Topics topics, Infos infos, sensor::Camera camera)
    : bag_(std::move(bag)),
      topics_(std::move(topics)),
      infos_(std::move(infos)),
      camera_(std::move(camera)) {}

core::Result<void> LiveRecord::check(const std::filesystem::path& file, bool replace) {
  if (file.extension() != ".mcap") {
    return core::usage_error(
        fmt::format("--record {}: is written as MCAP; give a name that ends in .mcap", file.string()));
  }
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return {};

  // Only a file of the same kind may be replaced
  std::array<char, 5> magic{};
  std::ifstream(file, std::ios::binary).read(magic.data(), magic.size());
  if (magic != std::array<char, 5>{'\x89', 'M', 'C', 'A', 'P'}) {
    return core::usage_error(
        fmt::format("--record {}: is there and is not an MCAP file; choose another name", file.string()));
  }
  if (replace) return {};
  return core::usage_error(fmt::format("--record {}: is there already; --force replaces it", file.string()));
}

core::Result<std::unique_ptr<LiveRecord>> LiveRecord::create(const std::filesystem::path& file, Topics topics,
                                                             Infos infos, sensor::Camera camera) {
  const auto& part = core::part<BagReaders>();
  if (!part) return tl::unexpected(part.error());
  return std::unique_ptr<LiveRecord>(new LiveRecord((*part)->create_mcap(file, "plumbline"),
                                                    std::move(topics), std::move(infos), std::move(camera)));
}

void LiveRecord::begin(std::int64_t stamp_ns) {
  begun_ = true;
  if (!camera_.color_from_depth || !infos_.color || !infos_.depth) return;
  bag_->write("/tf_static",
              {{infos_.color->header.frame_id, infos_.depth->header.frame_id, *camera_.color_from_depth}},
              stamp_ns);
}

void LiveRecord::add_info(const std::string& topic, std::optional<CameraInfoMessage>& info,
                          std::int64_t stamp_ns) {
  if (!info) return;
  info->header.stamp_ns = stamp_ns;
  bag_->write(topic, *info);
}

void LiveRecord::add(const StampPairs::Pair& pair) {
  if (!begun_) begin(pair.color.stamp_ns);
  // Messages are logged at the stamps of their images, or at the time of arrival if these have none.
  bag_->write_bytes(topics_.color.name, ros2_type(topics_.color.type), pair.color.stamp_ns,
                    *pair.color.bytes);
  add_info(topics_.info, infos_.color, pair.color.stamp_ns);
  bag_->write_bytes(topics_.depth.name, ros2_type(topics_.depth.type), pair.depth.stamp_ns,
                    *pair.depth.bytes);
  add_info(topics_.depth_info, infos_.depth, pair.depth.stamp_ns);
}

core::Result<void> LiveRecord::finish() {
  bag_->write_camera_yaml(sensor::to_yaml(camera_));
  return bag_->finish();
}

}  // namespace plumbline::dataset
