// SPDX-License-Identifier: BSD-3-Clause
// Publishes a run on ROS 2's network: pose of the camera, its path, and points.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <map>
#include <mutex>
#include <set>
#include <sstream>
#include <thread>
#include <utility>

#include "plumbline/net/ros2.hpp"
#include "ros2/live_grid.hpp"
#include "ros2/outgoing.hpp"
#include "ros2/transform_listener.hpp"

namespace plumbline::net {
namespace {

using geometry::Rigid3;

constexpr const char* kPath = "nav_msgs/Path";
constexpr const char* kPoints = "sensor_msgs/PointCloud2";
constexpr const char* kTransforms = "tf2_msgs/TFMessage";
constexpr const char* kGrid = "nav_msgs/OccupancyGrid";
constexpr const char* kGridUpdate = "map_msgs/OccupancyGridUpdate";
constexpr const char* kPose = "geometry_msgs/PoseWithCovarianceStamped";

/// A camera's z points forward and its x to the right; of ROS's bodies x points forward and z up.
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

/// A part of a cloud's points, enough for a grid: at most about 40 000.
std::vector<Eigen::Vector3f> thinned(const cloud::Cloud& cloud, const Rigid3& frame_from_cloud) {
  constexpr std::size_t kMost = 40'000;
  const Eigen::Matrix3f rotation = frame_from_cloud.rotation.cast<float>();
  const Eigen::Vector3f translation = frame_from_cloud.translation.cast<float>();
  std::vector<Eigen::Vector3f> points;
  const std::size_t step = 1 + cloud.size() / kMost;
  for (std::size_t i = 0; i < cloud.size(); i += step)
    points.emplace_back(rotation * cloud[i].getVector3fMap() + translation);
  return points;
}

class Ros2Publisher final : public pipeline::RunObserver {
 public:
  /// `others` and `base_from_camera`: with a base.
  Ros2Publisher(std::unique_ptr<dataset::MessageSink> sink, PublishedNames names, std::string name,
                PublishedFrames frames, std::unique_ptr<TransformListener> others,
                const Rigid3& base_from_camera, core::Log& log)
      : names_(names),
        name_(std::move(name)),
        frames_(std::move(frames)),
        log_(log),
        body_(base_from_camera),
        published_from_map_(frames_.finished_map ? body_from_optical() : base_from_camera),
        others_(std::move(others)),
        outgoing_(std::move(sink), log) {}

  void begins(const std::vector<std::string>& robots) override {
    robots_.clear();
    for (const std::string& robot : robots)
      robots_.push_back(!name_.empty() ? ros_name(name_) : several(robots.size()) ? ros_name(robot) : "");
  }

  void placed(std::int32_t robot, double stamp, const Rigid3& shared_from_map) override {
    post_transforms({{"map", frame(robot, frames_.map),
                      published_from_map_ * shared_from_map * published_from_map_.inverse()}},
                    stamp);
  }

  void tracked(std::int32_t robot, double stamp, const Rigid3& map_from_camera,
               const Rigid3& odometry_from_camera) override {
    const Rigid3 map_from_body = published_from_map_ * map_from_camera * body_of_camera().inverse();
    Rigid3 odometry_from_body = published_from_map_ * odometry_from_camera * body_of_camera().inverse();

    // Two publishers of one transform would conflict
    const bool other = another_publishes();
    if (other) {
      const auto theirs = others_->base_at(stamp);
      if (!theirs) return;
      odometry_from_body = *theirs;
    }

    // Drift is corrected between map and odom
    const Rigid3 map_from_odometry = map_from_body * odometry_from_body.inverse();
    std::vector<dataset::NamedTransform> transforms = {
        {frame(robot, frames_.map), frame(robot, frames_.odom), map_from_odometry}};
    if (!other)
      transforms.push_back({frame(robot, frames_.odom), frame(robot, body_name()), odometry_from_body});

    // The listener ignores this program's transforms
    if (others_ != nullptr && !other) others_->sends(stamp);
    post_transforms(std::move(transforms), stamp);

    note_correction(robot, map_from_odometry);
  }

  /// A frame without a pose repeats the last correction; a located frame is sent with its accuracy.
  void processed(const pipeline::LivePose& pose) override {
    if (robots_.size() != 1) return;
    if (pose.world_from_camera) {
      if (pose.sigma_position_m > 0.0) post_pose(pose);
      return;
    }
    const std::lock_guard lock(mutex_);
    const auto known = corrections_.find(0);
    if (known == corrections_.end()) return;
    post_transforms({{frame(0, frames_.map), frame(0, frames_.odom), known->second}}, pose.stamp);
  }

  void keyframes(std::int32_t robot, const geometry::Trajectory& path) override {
    post_path(robot, path, published_from_map_, false);
    if (frames_.base.empty()) return;

    // Corrected poses move earlier scans
    const std::lock_guard lock(mutex_);
    LiveGrid& grid = grid_of(robot);
    grid.move(moved(path, published_from_map_));
    post_grid(robot, path.empty() ? 0.0 : path.back().stamp, grid);
  }

  void added(std::int32_t robot, double stamp, const Rigid3& map_from_cloud,
             const cloud::Cloud& cloud) override {
    // Packed at once, because the cloud is only borrowed
    post_points(topic(robot, "points"), frame(robot, frames_.map), stamp,
                packed(cloud, published_from_map_ * map_from_cloud), false);
    if (frames_.base.empty()) return;

    // The base tells the height of the floor
    const Rigid3 published_from_cloud = published_from_map_ * map_from_cloud;
    const std::vector<Eigen::Vector3f> points = thinned(cloud, published_from_cloud);
    const std::lock_guard lock(mutex_);
    LiveGrid& grid = grid_of(robot);
    grid.add(stamp, published_from_cloud, points);
    post_grid(robot, stamp, grid);
  }

  void finished(const std::vector<geometry::Trajectory>& paths, const Rigid3& map_from_cloud,
                const cloud::Cloud& cloud) override {
    double stamp = 0.0;
    for (std::size_t r = 0; r < paths.size(); ++r) {
      if (paths[r].empty()) continue;
      stamp = std::max(stamp, paths[r].back().stamp);
      post_path(static_cast<std::int32_t>(r), paths[r], published_from_map_, true);
    }

    // The final cloud belongs to all robots
    post_points(shared_topic("map"), shared_frame(), stamp,
                packed(cloud, published_from_map_ * map_from_cloud), true);
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
  /// Names that were given are used as they are.
  [[nodiscard]] std::string frame(std::int32_t robot, const std::string& what) const {
    return prefix(robot).empty() || frames_.given() ? what : prefix(robot) + "/" + what;
  }
  [[nodiscard]] std::string body_name() const {
    if (!frames_.base.empty()) return frames_.base;
    return frames_.camera.empty() ? "camera" : frames_.camera;
  }
  /// Without a base, the lowest frame is the camera itself.
  [[nodiscard]] Rigid3 body_of_camera() const { return frames_.base.empty() ? Rigid3() : body_; }

  /// True if another program publishes the pose of the base; logged when that begins.
  [[nodiscard]] bool another_publishes() {
    if (others_ == nullptr || frames_.odom_tf == OdomTf::kOwn) return false;
    const std::string parent = others_->other_parent();
    if (frames_.odom_tf == OdomTf::kOther) return true;
    if (parent.empty()) return false;
    if (parent == frames_.odom) {
      if (!std::exchange(told_other_, true))
        log_.info(fmt::format("/tf: somebody else publishes {} -> {}: only {} -> {} is published", parent,
                              frames_.base, frames_.map, frames_.odom));
    } else if (!std::exchange(told_other_, true)) {
      log_.warning(
          fmt::format("/tf: somebody else publishes {} -> {}, so {} -> {} is not published any more; "
                      "give --frames odom={}",
                      parent, frames_.base, frames_.odom, frames_.base, parent));
    }
    return true;
  }
  /// Topic of data of all robots together.
  [[nodiscard]] std::string shared_topic(const char* what) const {
    return !several(robots_.size()) ? topic(0, what) : fmt::format("/plumbline/{}", what);
  }
  [[nodiscard]] std::string shared_frame() const {
    return !several(robots_.size()) ? frame(0, frames_.map) : "map";
  }

  /// Keeps a robot's correction, and reports a jump.
  void note_correction(std::int32_t robot, const Rigid3& map_from_odometry) {
    constexpr double kJump_m = 0.05;
    constexpr double kJump_rad = 0.035;
    const std::lock_guard lock(mutex_);
    const auto known = corrections_.find(robot);
    if (known == corrections_.end()) {
      corrections_.emplace(robot, map_from_odometry);
      return;
    }

    const Rigid3 jump = known->second.inverse() * map_from_odometry;
    const double turn_rad = Eigen::AngleAxisd(jump.rotation).angle();
    if (jump.translation.norm() > kJump_m || turn_rad > kJump_rad) {
      log_.info(fmt::format("/tf: {} -> {} was corrected by {:.2f} m and {:.1f} degrees",
                            frame(robot, frames_.map), frame(robot, frames_.odom), jump.translation.norm(),
                            turn_rad * 180.0 / M_PI));
    }
    known->second = map_from_odometry;
  }

  /// With mutex_ held.
  LiveGrid& grid_of(std::int32_t robot) {
    LiveGrid::Options options;
    options.low_m = frames_.grid_heights[0];
    options.high_m = frames_.grid_heights[1];
    return grids_.try_emplace(robot, options).first->second;
  }

  /// A whole grid, then parts that differ from it, so that late subscribers get both.
  void post_grid(std::int32_t robot, double stamp, LiveGrid& grid) {
    auto change = grid.take();
    if (!change) return;
    const auto cells = std::make_shared<dataset::GridCells>(std::move(change->cells));
    const std::string in = frame(robot, frames_.map);
    if (change->whole) {
      outgoing_.post({topic(robot, "grid"), kGrid,
                      [in, stamp, cells] { return dataset::grid_message(in, stamp, std::move(*cells)); },
                      true});
    } else {
      outgoing_.post({topic(robot, "grid_updates"), kGridUpdate, [in, stamp, cells] {
                        return dataset::grid_update_message(in, stamp, std::move(*cells));
                      }});
    }
  }

  void post_pose(const pipeline::LivePose& pose) {
    const Rigid3 map_from_body = published_from_map_ * *pose.world_from_camera * body_of_camera().inverse();
    outgoing_.post({topic(0, "pose"), kPose, [in = frame(0, frames_.map), map_from_body, pose] {
                      return dataset::pose_message(in, pose.stamp, map_from_body, pose.sigma_position_m,
                                                   pose.sigma_rotation_rad);
                    }});
  }

  void post_transforms(std::vector<dataset::NamedTransform> transforms, double stamp) {
    outgoing_.post({"/tf", kTransforms, [transforms = std::move(transforms), stamp] {
                      return dataset::transforms_message(transforms, stamp);
                    }});
  }

  void post_path(std::int32_t robot, const geometry::Trajectory& path, const Rigid3& frame_from_map,
                 bool at_end) {
    const std::string in = at_end ? shared_frame() : frame(robot, frames_.map);
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
  const PublishedFrames frames_;
  core::Log& log_;
  const Rigid3 body_;                ///< body_from_camera: of the base if there is one, else x ahead and z up
  const Rigid3 published_from_map_;  ///< from the observer's maps, whose y points down
  const std::unique_ptr<TransformListener> others_;  ///< null: without a base
  bool told_other_ = false;
  std::vector<std::string> robots_;  ///< prefix of names, by number; "": none
  std::mutex mutex_;
  std::map<std::int32_t, Rigid3> corrections_;  ///< map_from_odometry, by robot
  std::map<std::int32_t, LiveGrid> grids_;      ///< by robot; with a base
  Outgoing outgoing_;
};

/// base_from_camera by /tf_static; waits a moment for another program's pose of the base, too.
core::Result<Rigid3> mounted(const PublishedFrames& frames, const TransformListener& others, core::Log& log) {
  constexpr std::chrono::seconds kStatic(5), kOthers(2);
  const auto begin = std::chrono::steady_clock::now();
  const auto mount = others.wait_for(frames.base, frames.camera, kStatic);
  if (!mount) {
    return core::usage_error(
        fmt::format("--frames: no transform leads from {} to {} on /tf_static within {} s; start "
                    "robot_state_publisher or a static_transform_publisher first, or name other frames "
                    "(camera=: the colour camera's optical frame)",
                    frames.base, frames.camera, kStatic.count()));
  }

  while (frames.odom_tf == OdomTf::kAuto && others.other_parent().empty() &&
         std::chrono::steady_clock::now() - begin < kOthers)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  if (frames.odom_tf == OdomTf::kAuto && others.other_parent().empty())
    log.info(fmt::format("/tf: nobody publishes {} -> {}: it is published", frames.odom, frames.base));
  return *mount;
}

}  // namespace

bool PublishedFrames::given() const {
  return map != "map" || odom != "odom" || !camera.empty() || !base.empty();
}

core::Result<PublishedFrames> parse_published_frames(const std::string& text) {
  PublishedFrames frames;
  const std::map<std::string, std::string*> names = {
      {"map", &frames.map}, {"odom", &frames.odom}, {"base", &frames.base}, {"camera", &frames.camera}};
  std::set<std::string> seen;
  std::istringstream in(text);
  for (std::string word; std::getline(in, word, ',');) {
    const std::size_t equals = word.find('=');
    const std::string key = word.substr(0, equals);
    const auto found = names.find(key);

    // Misspelt and repeated names are refused
    if (equals == std::string::npos || equals + 1 == word.size() || found == names.end() ||
        !seen.insert(key).second) {
      return core::usage_error(
          fmt::format("--frames {}: '{}' is not NAME=FRAME with each of map, odom, base, camera at most once",
                      text, word));
    }
    *found->second = word.substr(equals + 1);
  }
  return frames;
}

core::Result<std::shared_ptr<pipeline::RunObserver>> open_ros2_publisher(const std::string& address,
                                                                         PublishedNames names,
                                                                         const std::string& name,
                                                                         const PublishedFrames& frames,
                                                                         core::Log& log) {
  const auto parsed = parse_ros2_address(address);
  if (!parsed) return tl::unexpected(parsed.error());

  // Published topics have fixed names
  if (parsed->topics.any()) {
    return core::usage_error(
        fmt::format("--publish {}: topics are not named here; they are /plumbline/path and others", address));
  }
  auto sink = open_ros2_sink(*parsed);
  if (!sink) return tl::unexpected(sink.error());

  // Without a base the camera is the body
  PublishedFrames named = frames;
  Rigid3 body = body_from_optical();
  std::unique_ptr<TransformListener> others;
  if (!named.base.empty()) {
    if (named.camera.empty()) named.camera = "camera_color_optical_frame";

    // Other programs publish the camera's mount
    auto stream = open_ros2_stream(*parsed);
    if (!stream) return tl::unexpected(stream.error());
    others = std::make_unique<TransformListener>(std::move(*stream), named.base);
    const auto mount = mounted(named, *others, log);
    if (!mount) return tl::unexpected(mount.error());
    body = *mount;
  }
  return std::make_shared<Ros2Publisher>(std::move(*sink), names, name, std::move(named), std::move(others),
                                         body, log);
}

}  // namespace plumbline::net
