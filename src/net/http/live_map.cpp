// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/net/live_map.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <limits>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/viewer/page.hpp"

namespace plumbline::net {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr double kVoxel_m = 0.03;         // of what is sent
constexpr std::size_t kCloudsAtOnce = 8;  // keyframes' clouds in one look
constexpr double kMoved_m = 0.02;         // motion of a keyframe from which its cloud is sent again
constexpr double kTurned = 0.01;          // radians

/// The keyframe's thinned cloud, at the keyframe's pose.
viewer::Points placed(const cloud::Cloud& cloud, const geometry::Rigid3& world_from_camera) {
  viewer::Points points;
  const geometry::Rigid3 world_from_depth = world_from_camera * cloud::sensor_pose(cloud);
  std::set<std::array<int, 3>> taken;
  for (const cloud::Point& point : cloud) {
    const Eigen::Vector3d p = world_from_depth * point.getVector3fMap().cast<double>();
    if (!p.allFinite()) continue;
    const auto cell = [&](int k) { return static_cast<int>(std::floor(p[k] / kVoxel_m)); };
    if (!taken.insert({cell(0), cell(1), cell(2)}).second) continue;
    const Eigen::Vector3d n = world_from_depth.rotation * point.getNormalVector3fMap().cast<double>();
    points.positions.push_back(
        {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
    points.normals.push_back(
        {static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z())});
    points.colors.push_back({point.r, point.g, point.b});
  }
  return points;
}

bool far_from(const geometry::Rigid3& a, const geometry::Rigid3& b) {
  const double cosine = std::clamp((0.5 * ((a.rotation.transpose() * b.rotation).trace() - 1.0)), -1.0, 1.0);
  return (a.translation - b.translation).norm() > kMoved_m || std::acos(cosine) > kTurned;
}

Json numbers(const Eigen::Vector3d& p) {
  const Eigen::Vector3d at = viewer::upright(p, false);
  Json list = Json::array();
  for (int k = 0; k < 3; ++k) list.push_back(std::round(at[k] * 1e3) / 1e3);
  return list;
}

/// Every map.db below a folder.
std::vector<fs::path> stores_in(const fs::path& folder) {
  std::vector<fs::path> stores;
  std::error_code ec;
  for (fs::recursive_directory_iterator at(folder, ec), end; !ec && at != end; at.increment(ec)) {
    if (at.depth() > 3) at.disable_recursion_pending();
    if (at->path().filename() == maps::kStoreFile) stores.push_back(at->path());
  }
  std::sort(stores.begin(), stores.end());
  return stores;
}

/// True if a store is the map of one robot, not the common map: OUT/robots/NAME/map.db.
bool is_of_one_robot(const fs::path& store) {
  return store.parent_path().parent_path().filename() == "robots";
}

/// Time that processors have spent on this thread.
Clock::duration processor_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace

struct LiveMap::Impl {
  explicit Impl(PageServer&& started) : server(std::move(started)) {}

  void follow();
  void end();
  void look();
  void look_at(const fs::path& store, Json& robots);
  void show(const maps::StoreReader& reader, const maps::StoredMap& map,
            const geometry::Rigid3& shared_from_map, const std::map<std::int32_t, std::string>& names,
            std::size_t& budget);

  PageServer server;
  fs::path output;
  std::map<std::string, geometry::Rigid3> sent;    ///< where a keyframe lay, by robot and number
  std::map<std::string, int> colors;               ///< of robots, by name, as they came
  std::string words;                               ///< of tell()
  std::map<std::string, geometry::Rigid3> places;  ///< of place()
  std::mutex mutex;
  std::condition_variable wake;
  bool ended = false;
  std::size_t at_once = kCloudsAtOnce;
  std::thread thread;
};

/// Sends keyframes' clouds that are new or have moved.
void LiveMap::Impl::show(const maps::StoreReader& reader, const maps::StoredMap& map,
                         const geometry::Rigid3& shared_from_map,
                         const std::map<std::int32_t, std::string>& names, std::size_t& budget) {
  const auto with_cloud = reader.cloud_ids();
  if (!with_cloud) return;

  const std::set<core::KeyframeId> there(with_cloud->begin(), with_cloud->end());
  for (const maps::KeyframePose& keyframe : maps::keyframe_poses(map.map)) {
    if (budget == 0) return;
    const auto robot = names.find(keyframe.id.robot);
    if (robot == names.end() || there.count(keyframe.id) == 0) continue;

    // The name is the same in a robot's own map and in the common map, whose clouds replace the earlier ones
    const std::string name = robot->second + "/" + std::to_string(keyframe.id.index);
    const geometry::Rigid3 pose = shared_from_map * keyframe.world_from_camera;
    const auto before = sent.find(name);
    if (before != sent.end() && !far_from(before->second, pose)) continue;

    const auto cloud = reader.cloud(keyframe.id);
    if (!cloud) continue;
    const std::string json = viewer::cloud_json(placed(**cloud, pose), false);

    server.send("{\"key\":" + core::json_text(name, -1) +
                    ",\"robot\":" + std::to_string(colors[robot->second]) + ",\"cloud\":" + json + "}",
                name);
    sent[name] = pose;
    --budget;
  }
}

void LiveMap::Impl::look_at(const fs::path& store, Json& robots) {
  const auto blank = maps::is_blank_store(store);
  if (!blank || *blank) return;
  auto reader = maps::StoreReader::open(store);
  if (!reader) return;  // its writer is just beginning
  const auto each = reader->load_each();
  if (!each) return;

  // A hub's copy is known by its folder and placed by the hub's meetings
  const std::string folder = store.parent_path().filename().string();
  const bool copy = is_of_one_robot(store);
  geometry::Rigid3 shared_from_map;
  if (copy) {
    const std::lock_guard lock(mutex);
    if (const auto found = places.find(folder); found != places.end()) shared_from_map = found->second;
  }

  std::map<std::int32_t, std::string> names;
  for (const maps::RobotInfo& robot : reader->header().robots)
    names[robot.number] = copy ? folder : robot.name.empty() ? "robot" : robot.name;

  std::size_t budget = at_once;
  for (const maps::StoredMap& map : *each) {
    const auto paths = maps::by_robot(maps::poses_of(map.map, map.frames));
    for (const maps::RobotInfo& robot : map.header.robots) {
      const std::string& name = names.at(robot.number);
      colors.emplace(name, static_cast<int>(colors.size()));
      const auto path = paths.find(robot.number);
      if (path == paths.end() || path->second.empty()) continue;

      Json way = Json::array();
      for (std::size_t i = 0; i < path->second.size(); i += 1 + path->second.size() / 500)
        way.push_back(numbers(shared_from_map * path->second[i].world_from_camera.translation));

      robots.push_back({{"name", name},
                        {"number", colors[name]},
                        {"p", numbers(shared_from_map * path->second.back().world_from_camera.translation)},
                        {"path", std::move(way)},
                        {"keyframes", map.map.keyframe_count()},
                        {"stamp", path->second.back().stamp}});
    }
    show(*reader, map, shared_from_map, names, budget);
  }
}

void LiveMap::Impl::look() {
  std::error_code ec;
  fs::path folder = output;
  folder += ".partial";
  if (!fs::exists(folder, ec)) folder = output;
  Json robots = Json::array();

  // A common map, finished or not, replaces the robots' own maps
  const std::vector<fs::path> stores = stores_in(folder);
  for (const bool own : {false, true}) {
    if (!robots.empty()) break;
    for (const fs::path& store : stores) {
      if (is_of_one_robot(store) == own) look_at(store, robots);
    }
  }
  if (robots.empty()) return;

  std::string line;
  {
    const std::lock_guard lock(mutex);
    line = words;
  }

  if (line.empty()) {
    for (const Json& robot : robots) {
      line += line.empty() ? "" : "; ";
      line +=
          robot["name"].get<std::string>() + ": " + core::json_text(robot["keyframes"], -1) + " keyframes";
    }
  }
  server.send(core::json_text({{"robots", robots}, {"told", line}}, -1), "robots");
}

void LiveMap::Impl::follow() {
  std::unique_lock lock(mutex);
  while (!ended) {
    lock.unlock();
    const Clock::duration before = processor_time();
    look();
    const Clock::duration took = processor_time() - before;
    lock.lock();
    // At most a tenth of a processor; time of waiting for one does not count
    wake.wait_for(lock, std::max<Clock::duration>(std::chrono::seconds(1), 10 * took), [&] { return ended; });
  }
}

void LiveMap::Impl::end() {
  {
    const std::lock_guard lock(mutex);
    ended = true;
  }
  wake.notify_all();
  thread.join();

  // The last clouds are sent without a limit
  at_once = std::numeric_limits<std::size_t>::max();
  look();
  server.send(R"({"done":true})", "done");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // for clients to take it
}

LiveMap::LiveMap() = default;

core::Result<std::unique_ptr<LiveMap>> LiveMap::start(const PageServerOptions& options,
                                                      const fs::path& output) {
  viewer::Scene scene;
  scene.name = output.filename().string();
  scene.frame = "frame: of the first camera; metres";
  scene.z_up = false;
  scene.live = "events";
  auto server = PageServer::start(options, viewer::page(scene, "plumbline live"));
  if (!server) return tl::unexpected(server.error());

  std::unique_ptr<LiveMap> live(new LiveMap);
  live->impl_ = std::make_unique<Impl>(std::move(*server));
  live->impl_->output = output;

  // The thread reads the members set above
  live->impl_->thread = std::thread([impl = live->impl_.get()] { impl->follow(); });
  return live;
}

LiveMap::~LiveMap() {
  try {
    impl_->end();
  } catch (const std::exception&) {
    return;  // the page does not hear that the run has ended
  }
}

std::string LiveMap::address() const { return impl_->server.address(); }

void LiveMap::place(const std::string& robot, const geometry::Rigid3& shared_from_robot) {
  const std::lock_guard lock(impl_->mutex);
  impl_->places[robot] = shared_from_robot;
}

void LiveMap::tell(const std::string& words) {
  const std::lock_guard lock(impl_->mutex);
  impl_->words = words;
}

}  // namespace plumbline::net
