// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages and who carries them. The carrier is CycloneDDS, in the part plumbline_dds.so (core/part.hpp): a
// run without a network loads none of it.
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

constexpr std::uint32_t kProtocol = 2;

/// messages.idl says what the fields are.
struct Hello {
  std::uint32_t protocol = kProtocol;
  std::uint32_t store_format = 0;
  std::string program;
  std::string name;
  std::string run;
  std::uint64_t incarnation = 0;
  std::vector<std::uint64_t> began;
  std::int64_t map_head = 0;
  std::int64_t clouds_head = 0;
  bool over = false;
  double lag_median_s = 0.0;
  double lag_p95_s = 0.0;
};

enum class Answer : std::uint8_t {
  kPresence,  ///< to all: there is a hub
  kAccepted,  ///< go on
  kRefused,   ///< this robot as it is will never be accepted
  kTrouble,   ///< the hub cannot take it now, and asks again
  kDone,      ///< everything is here: the robot may leave
};

struct Place {
  std::string frame_of;
  std::array<double, 7> frame_from_robot{};
  std::array<double, 7> frame_from_camera{};
  std::array<double, 21> covariance{};
};

struct Word {
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
  std::int64_t map = 0;
  std::int64_t clouds = 0;
  std::int64_t number = 0;
  std::uint64_t edition = 0;
  std::uint32_t pieces = 0;
  Place place;
};

struct Piece {
  std::uint32_t protocol = kProtocol;
  std::string name;
  std::string run;
  std::uint64_t incarnation = 0;
  std::uint8_t share = 0;
  std::int64_t after = 0;
  std::int64_t number = 0;
  std::uint64_t edition = 0;
  std::uint32_t index = 0;
  std::uint32_t count = 0;
  std::uint64_t hash = 0;
  std::vector<std::uint8_t> bytes;
};

/// What the carrier tells of itself: whole lines of its log.
using BusLog = std::function<void(const std::string&)>;

/// A robot's end. Not thread-safe; no call waits longer than 0.2 s but wait().
class RobotBus {
 public:
  virtual ~RobotBus() = default;
  virtual void say(const Hello& hello) = 0;
  /// False: no room now; try again.
  virtual bool send(const Piece& piece) = 0;
  virtual std::vector<Word> hear() = 0;  ///< also those to other robots
  /// Rows of other robots' maps; the hub sends them from the first call on.
  virtual std::vector<Piece> hear_of_others() = 0;
  [[nodiscard]] virtual bool listened_to() = 0;   ///< somebody takes this robot's pieces
  [[nodiscard]] virtual bool all_received() = 0;  ///< of those who take them, all have all that was sent
  [[nodiscard]] virtual int others() = 0;         ///< participants that are there, of any kind
  virtual void wait(std::chrono::milliseconds most) = 0;
};

/// A hello, and in which partition it came: only who may speak for that name is let in there.
struct HeardHello {
  Hello hello;
  std::string partition;
};

/// The hub's end. As RobotBus.
class HubBus {
 public:
  virtual ~HubBus() = default;
  virtual void say(const Word& word) = 0;
  virtual std::vector<HeardHello> hear() = 0;
  virtual std::vector<Word> hear_hubs() = 0;  ///< also this one's own
  /// From now on takes the pieces of this robot.
  virtual core::Result<void> listen_to(const std::string& robot) = 0;
  virtual std::vector<Piece> take(const std::string& robot, int most) = 0;
  /// How many times this robot has begun to hear of others; 0: it does not now. What was sent before the last
  /// time may be lost.
  [[nodiscard]] virtual int begun_to_hear(const std::string& robot) = 0;
  /// A piece of another one's map for this robot. False: no room now; try again. Never waits.
  virtual bool tell(const std::string& robot, const Piece& piece) = 0;
  virtual void wait(std::chrono::milliseconds most) = 0;
};

/// The part.
struct BusPart {
  static constexpr const char* kPart = "dds";
  static constexpr std::uint64_t layout() {
    return core::layout_of<BusPart, Hello, Word, Piece, NetworkOptions>();
  }
  core::Result<std::unique_ptr<RobotBus>> (*open_robot)(const NetworkOptions& options,
                                                        const std::string& name, const BusLog& log);
  core::Result<std::unique_ptr<HubBus>> (*open_hub)(const NetworkOptions& options, const BusLog& log);
  // keys.hpp of the part
  core::Result<void> (*make_authority)(const std::filesystem::path& folder);
  core::Result<void> (*make_keys)(const std::filesystem::path& folder, const std::string& name);
  core::Result<void> (*revoke)(const std::filesystem::path& folder, const std::vector<std::string>& names);
  core::Result<int> (*days_left)(const std::filesystem::path& folder);
};

/// Through the part. Errors: (kUsage) no such interface, port in use, keys that cannot be read; (kInternal)
/// the part is missing.
core::Result<std::unique_ptr<RobotBus>> open_robot_bus(const NetworkOptions& options, const std::string& name,
                                                       const BusLog& log);
core::Result<std::unique_ptr<HubBus>> open_hub_bus(const NetworkOptions& options, const BusLog& log);

/// Warns of what others on the network could do without keys (`danger`, in words), and of keys that expire
/// soon. Errors (kUsage): keys cannot be read.
core::Result<void> warn_of_security(const NetworkOptions& options, const std::string& danger, core::Log& log);

}  // namespace plumbline::net
