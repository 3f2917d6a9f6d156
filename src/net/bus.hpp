// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages between robots and hub, and their transport. The transport is CycloneDDS, in the part
// plumbline_dds.so (core/part.hpp): a run without a network does not load it.
#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/part.hpp"
#include "plumbline/net/options.hpp"

namespace plumbline::net {

using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kProtocol = 3;

/// A robot's identity and the content of its store. messages.idl documents the fields.
struct RobotStatus {
  std::uint32_t protocol = kProtocol;
  std::uint32_t store_format = 0;
  std::string program;
  std::string name;
  std::string run;
  std::uint64_t incarnation = 0;
  std::vector<std::uint64_t> heads_at_start;
  std::int64_t map_head = 0;
  std::int64_t clouds_head = 0;
  bool finished = false;
  double lag_median_s = 0.0;
  double lag_p95_s = 0.0;
};

enum class Answer : std::uint8_t {
  kPresence,  ///< to all robots: there is a hub
  kAccepted,  ///< the robot may send
  kRefused,   ///< this run of the robot will never be accepted
  kTrouble,   ///< the hub cannot store the rows now, and requests them again later
  kDone,      ///< the hub holds everything: the robot may leave
};

/// Pose of a robot in the frame that it shares with those it met.
struct SharedFrame {
  std::string frame_of;
  std::array<double, 7> frame_from_robot{};
  std::array<double, 7> frame_from_camera{};
  std::array<double, 21> covariance{};
};

/// The hub's identity and the state of its copy of one robot's store.
struct HubStatus {
  std::uint32_t protocol = kProtocol;
  std::uint32_t store_format = 0;
  std::string program;
  std::string hub;
  double up_s = 0.0;
  std::string robot;
  std::string run;
  std::uint64_t incarnation = 0;
  Answer answer = Answer::kPresence;
  std::string problem;
  std::int64_t map_held = 0;
  std::int64_t clouds_held = 0;
  std::int64_t incoming = 0;
  std::uint64_t checksum = 0;
  std::uint32_t chunks = 0;
  SharedFrame frame;
};

/// Part of a transaction's rows.
struct Chunk {
  std::uint32_t protocol = kProtocol;
  std::string name;
  std::string run;
  std::uint64_t incarnation = 0;
  std::uint8_t stream = 0;
  std::int64_t after = 0;
  std::int64_t number = 0;
  std::uint64_t checksum = 0;
  std::uint32_t index = 0;
  std::uint32_t count = 0;
  std::uint64_t hash = 0;
  std::vector<std::uint8_t> bytes;
};

/// Receives whole lines of the transport's own log.
using BusLog = std::function<void(const std::string&)>;

/// The robot's side of the transport. Not thread-safe; no call but wait() blocks for more than 0.2 s.
class RobotBus {
 public:
  virtual ~RobotBus() = default;
  virtual void publish(const RobotStatus& status) = 0;
  /// False: the queue is full; try again.
  virtual bool send(const Chunk& chunk) = 0;
  virtual std::vector<HubStatus> poll_hub() = 0;  ///< statuses addressed to other robots included
  /// Chunks of other robots' maps; the hub sends them from the first call on.
  virtual std::vector<Chunk> poll_feedback() = 0;
  [[nodiscard]] virtual bool has_reader() = 0;  ///< true if a hub subscribes to this robot's chunks
  /// True if every subscriber has acknowledged all sent chunks.
  [[nodiscard]] virtual bool all_received() = 0;
  [[nodiscard]] virtual int participants() = 0;  ///< number of others on the network, of any kind
  virtual void wait(std::chrono::milliseconds most) = 0;
};

/// A status and the partition it came in: only a process that may publish under that name is admitted.
struct ReceivedStatus {
  RobotStatus status;
  std::string partition;
};

/// The hub's side of the transport. Thread safety and blocking as RobotBus.
class HubBus {
 public:
  virtual ~HubBus() = default;
  virtual void publish(const HubStatus& status) = 0;
  virtual std::vector<ReceivedStatus> poll_robots() = 0;
  virtual std::vector<HubStatus> poll_hubs() = 0;  ///< this hub's own included
  /// Subscribes to the chunks of this robot.
  virtual core::Result<void> subscribe(const std::string& robot) = 0;
  virtual std::vector<Chunk> receive(const std::string& robot, int most) = 0;
  /// Number of times that this robot has subscribed to feedback; 0 if it is not subscribed now. Chunks sent
  /// before the last subscription may be lost.
  [[nodiscard]] virtual int feedback_subscriptions(const std::string& robot) = 0;
  /// Sends a chunk of another robot's map to this robot. False: the queue is full; try again. Never waits.
  virtual bool send_feedback(const std::string& robot, const Chunk& chunk) = 0;
  virtual void wait(std::chrono::milliseconds most) = 0;
};

/// Functions of the part.
struct BusPart {
  static constexpr const char* kPart = "dds";
  static constexpr std::uint64_t layout() {
    return core::layout_of<BusPart, RobotStatus, HubStatus, Chunk, NetworkOptions>();
  }
  core::Result<std::unique_ptr<RobotBus>> (*open_robot)(const NetworkOptions& options,
                                                        const std::string& name, const BusLog& log);
  core::Result<std::unique_ptr<HubBus>> (*open_hub)(const NetworkOptions& options, const BusLog& log);
  // Functions of the part's keys.hpp.
  core::Result<void> (*make_authority)(const std::filesystem::path& folder);
  core::Result<void> (*make_keys)(const std::filesystem::path& folder, const std::string& name);
  core::Result<void> (*revoke)(const std::filesystem::path& folder, const std::vector<std::string>& names);
  core::Result<int> (*days_left)(const std::filesystem::path& folder);
};

/// Open the transport of the part. Errors: (kUsage) no such interface, port in use, keys that cannot be read;
/// (kInternal) the part is missing.
core::Result<std::unique_ptr<RobotBus>> open_robot_bus(const NetworkOptions& options, const std::string& name,
                                                       const BusLog& log);
core::Result<std::unique_ptr<HubBus>> open_hub_bus(const NetworkOptions& options, const BusLog& log);

/// Warns of what others on the network could do without keys (`danger`, in words), and of keys that expire
/// soon. Errors (kUsage): keys cannot be read.
core::Result<void> warn_of_security(const NetworkOptions& options, const std::string& danger, core::Log& log);

}  // namespace plumbline::net
