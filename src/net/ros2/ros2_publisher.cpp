// SPDX-License-Identifier: BSD-3-Clause
// A run on ROS 2's network: where the camera is, its path, and points.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <cstring>
#include <utility>

#include "plumbline/net/ros2.hpp"
#include "ros2/outgoing.hpp"

namespace plumbline::net {
namespace {

using geometry::Rigid3;

constexpr const char* kPath = "nav_msgs/Path";
constexpr const char* kPoints = "sensor_msgs/PointCloud2";
constexpr const char* kTransforms = "tf2_msgs/TFMessage";

/// A camera looks along z and has x to its right; ROS' bodies look along x and have z above them.
Rigid3 body_from_optical() {
  Eigen::Matrix3d rotation;
  rotation << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return {rotation, Eigen::Vector3d::Zero()};
}

/// Names in ROS consist of letters, digits and '_'.
std::string ros_name(const std::string& name) {
  std::string text;
  for (const char c : name) text += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  if (text.empty() || std::isdigit(static_cast<unsigned char>(text.front())) != 0) text = "r" + text;
  return text;
}

geometry::Trajectory moved(geometry::Trajectory path, const Rigid3& frame_from_map) {
  for (geometry::StampedPose& pose : path) pose.world_from_camera = frame_from_map * pose.world_from_camera;
  return path;
}

/// 16 bytes per point, as points_message needs them, without invalid points.
std::vector<std::uint8_t> packed(const cloud::Cloud& cloud, const Rigid3& frame_from_cloud) {
  constexpr std::size_t kBytes = 16;
  const Eigen::Matrix3f rotation = frame_from_cloud.rotation.cast<float>();
  const Eigen::Vector3f translation = frame_from_cloud.translation.cast<float>();
  std::vector<std::uint8_t> bytes;
  bytes.reserve(cloud.size() * kBytes);
  for (const cloud::Point& point : cloud) {
    if (!std::isfinite(point.x) || !std::isfinite(point.y) || !std::isfinite(point.z)) continue;
    const Eigen::Vector3f p = rotation * point.getVector3fMap() + translation;
    std::uint8_t one[kBytes] = {};
    std::memcpy(one, p.data(), 3 * sizeof(float));
    one[12] = point.b;
    one[13] = point.g;
    one[14] = point.r;
    bytes.insert(bytes.end(), one, one + kBytes);
  }
  return bytes;
}

class Ros2Publisher final : public pipeline::RunObserver {
 public:
  Ros2Publisher(std::unique_ptr<dataset::MessageSink> sink, PublishedNames names, std::string name,
                core::Log& log)
      : names_(names), name_(std::move(name)), outgoing_(std::move(sink), log) {}

  void begins(const std::vector<std::string>& robots) override {
    robots_.clear();
    for (const std::string& robot : robots)
      robots_.push_back(!name_.empty() ? ros_name(name_) : several(robots.size()) ? ros_name(robot) : "");
  }

  void placed(std::int32_t robot, double stamp, const Rigid3& shared_from_map) override {
    post_transforms({{"map", frame(robot, "map"), body_ * shared_from_map * body_.inverse()}}, stamp);
  }

  void tracked(std::int32_t robot, double stamp, const Rigid3& map_from_camera,
               const Rigid3& odometry_from_camera) override {
    const Rigid3 map_from_odometry = body_ * map_from_camera * (body_ * odometry_from_camera).inverse();
    post_transforms({{frame(robot, "map"), frame(robot, "odom"), map_from_odometry},
                     {frame(robot, "odom"), frame(robot, "camera"), body_ * odometry_from_camera}},
                    stamp);
  }

  void keyframes(std::int32_t robot, const geometry::Trajectory& path) override {
    post_path(robot, path, body_, false);
  }

  void added(std::int32_t robot, double stamp, const Rigid3& map_from_cloud,
             const cloud::Cloud& cloud) override {
    // The cloud goes on to others: what is sent is made of it now.
    post_points(topic(robot, "points"), frame(robot, "map"), stamp, packed(cloud, body_ * map_from_cloud),
                false);
  }

  void finished(const std::vector<geometry::Trajectory>& paths, const Rigid3& map_from_cloud,
                const cloud::Cloud& cloud) override {
    double stamp = 0.0;
    for (std::size_t r = 0; r < paths.size(); ++r) {
      if (paths[r].empty()) continue;
      stamp = std::max(stamp, paths[r].back().stamp);
      post_path(static_cast<std::int32_t>(r), paths[r], body_, true);
    }
    post_points(shared_topic("map"), shared_frame(), stamp, packed(cloud, body_ * map_from_cloud), true);
  }

 private:
  [[nodiscard]] bool several(std::size_t robots) const {
    return robots > 1 || names_ == PublishedNames::kOfEach;
  }
  [[nodiscard]] const std::string& prefix(std::int32_t robot) const {
    return robots_.at(static_cast<std::size_t>(robot));
  }
  [[nodiscard]] std::string topic(std::int32_t robot, const char* what) const {
    return fmt::format("/{}/{}", prefix(robot).empty() ? "plumbline" : prefix(robot), what);
  }
  [[nodiscard]] std::string frame(std::int32_t robot, const char* what) const {
    return prefix(robot).empty() ? what : prefix(robot) + "/" + what;
  }
  /// Topic of data of all robots together.
  [[nodiscard]] std::string shared_topic(const char* what) const {
    return !several(robots_.size()) ? topic(0, what) : fmt::format("/plumbline/{}", what);
  }
  [[nodiscard]] std::string shared_frame() const {
    return !several(robots_.size()) ? frame(0, "map") : "map";
  }

  void post_transforms(std::vector<dataset::NamedTransform> transforms, double stamp) {
    outgoing_.post({"/tf", kTransforms, [transforms = std::move(transforms), stamp] {
                      return dataset::transforms_message(transforms, stamp);
                    }});
  }

  void post_path(std::int32_t robot, const geometry::Trajectory& path, const Rigid3& frame_from_map,
                 bool at_end) {
    const std::string in = at_end ? shared_frame() : frame(robot, "map");
    outgoing_.post({topic(robot, "path"), kPath,
                    [in, poses = moved(path, frame_from_map)] { return dataset::path_message(in, poses); },
                    at_end});
  }

  void post_points(const std::string& topic, const std::string& in, double stamp,
                   std::vector<std::uint8_t> points, bool at_end) {
    const auto shared = std::make_shared<std::vector<std::uint8_t>>(std::move(points));
    outgoing_.post({topic, kPoints,
                    [in, stamp, shared] { return dataset::points_message(in, stamp, std::move(*shared)); },
                    at_end});
  }

  const PublishedNames names_;
  const std::string name_;
  const Rigid3 body_ = body_from_optical();
  std::vector<std::string> robots_;  ///< prefix of names, by number; "": none
  Outgoing outgoing_;
};

}  // namespace

core::Result<std::shared_ptr<pipeline::RunObserver>> open_ros2_publisher(const std::string& address,
                                                                         PublishedNames names,
                                                                         const std::string& name,
                                                                         core::Log& log) {
  const auto parsed = parse_ros2_address(address);
  if (!parsed) return tl::unexpected(parsed.error());
  if (parsed->topics.any()) {
    return core::usage_error(
        fmt::format("--publish {}: topics are not named here; they are /plumbline/path and others", address));
  }
  auto sink = open_ros2_sink(*parsed);
  if (!sink) return tl::unexpected(sink.error());
  return std::make_shared<Ros2Publisher>(std::move(*sink), names, name, log);
}

}  // namespace plumbline::net
