// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/ros_messages.hpp"

#include <cmath>
#include <utility>

#include "bags/bag_parts.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::size_t kBytesOfPoint = 16;

std::int64_t stamp_ns_of(double seconds) { return std::llround(seconds * 1e9); }

template <typename Encode>
MessageBytes encoded(const Encode& encode) {
  const auto& part = core::part<BagReaders>();
  if (!part) return tl::unexpected(part.error());
  return encode((*part)->encoder());
}

/// A grid of the map at that time, in seconds.
GridMessage message_of(const std::string& frame, double stamp, GridCells cells) {
  return {{stamp_ns_of(stamp), frame},
          cells.resolution_m,
          cells.origin,
          cells.x,
          cells.y,
          cells.width,
          cells.height,
          std::move(cells.cells)};
}

}  // namespace

MessageBytes transforms_message(const std::vector<NamedTransform>& transforms, double stamp) {
  std::vector<TransformMessage> messages;
  for (const NamedTransform& transform : transforms)
    messages.push_back({transform.parent, transform.child, transform.parent_from_child});
  return encoded(
      [&](const MessageEncoder& encoder) { return encoder.transforms(messages, stamp_ns_of(stamp)); });
}

core::Result<std::vector<std::pair<double, NamedTransform>>> read_transforms(
    const std::vector<std::uint8_t>& bytes) {
  const auto& part = core::part<BagReaders>();
  if (!part) return tl::unexpected(part.error());
  auto messages = (*part)->cdr().transforms(bytes);
  if (!messages) return core::input_error("tf2_msgs/TFMessage " + messages.error());

  // Stamps in seconds, as in the rest of the program
  std::vector<std::pair<double, NamedTransform>> transforms;
  for (TransformMessage& m : *messages) {
    transforms.push_back({1e-9 * static_cast<double>(m.stamp_ns),
                          {std::move(m.parent), std::move(m.child), m.parent_from_child}});
  }
  return transforms;
}

MessageBytes path_message(const std::string& frame, const geometry::Trajectory& path) {
  const double stamp = path.empty() ? 0.0 : path.back().stamp;
  return encoded([&](const MessageEncoder& encoder) {
    return encoder.path({{stamp_ns_of(stamp), frame}, path});
  });
}

MessageBytes points_message(const std::string& frame, double stamp, std::vector<std::uint8_t> points) {
  CloudMessage message{{stamp_ns_of(stamp), frame}, 0, std::move(points)};
  message.points = static_cast<std::uint32_t>(message.data.size() / kBytesOfPoint);
  return encoded([&](const MessageEncoder& encoder) { return encoder.cloud(message); });
}

MessageBytes grid_message(const std::string& frame, double stamp, GridCells grid) {
  const GridMessage message = message_of(frame, stamp, std::move(grid));
  return encoded([&](const MessageEncoder& encoder) { return encoder.grid(message); });
}

MessageBytes grid_update_message(const std::string& frame, double stamp, GridCells part) {
  const GridMessage message = message_of(frame, stamp, std::move(part));
  return encoded([&](const MessageEncoder& encoder) { return encoder.grid_update(message); });
}

MessageBytes pose_message(const std::string& frame, double stamp, const geometry::Rigid3& pose,
                          double sigma_position_m, double sigma_rotation_rad) {
  return encoded([&](const MessageEncoder& encoder) {
    return encoder.pose({{stamp_ns_of(stamp), frame}, pose, sigma_position_m, sigma_rotation_rad});
  });
}

}  // namespace plumbline::dataset
