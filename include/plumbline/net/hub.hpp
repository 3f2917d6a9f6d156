// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// `plumbline hub` as a call: receives robots' maps over a network and fuses them into one result folder
// (docs/method/network.md).
#include <cstdint>
#include <functional>
#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/net/options.hpp"
#include "plumbline/pipeline/fuse_maps.hpp"

namespace plumbline::net {

/// Counts of what one robot sent.
struct RobotTraffic {
  std::string name;
  std::size_t keyframes = 0;
  bool complete = false;             ///< its run came to an end
  bool done = false;                 ///< the hub holds everything that it has
  std::uint64_t received_bytes = 0;  ///< bytes of rows received by this process
  std::uint64_t place_bytes = 0;     ///< by purpose: features and poses of keyframes,
  std::uint64_t map_bytes = 0;       ///< landmarks, edges and frames,
  std::uint64_t cloud_bytes = 0;     ///< clouds
  std::uint64_t again_bytes = 0;     ///< received more than once
  double longest_break_s = 0.0;      ///< longest time without any message from the robot, seconds
  double lag_median_s = 0.0;         ///< time from a transaction in its store to the acknowledgement
  double lag_p95_s = 0.0;
};

struct HubRequest {
  /// The fusion at the end; `maps` is filled in, `output` is the result folder.
  pipeline::FuseRequest fuse;
  NetworkOptions network;
  std::size_t robots = 0;                      ///< number to wait for; 0: until it is stopped
  bool resume = false;                         ///< continue an interrupted hub from OUT.partial
  std::uint64_t quota_bytes = 20'000'000'000;  ///< of disk for each robot
  std::string fresh_id;                        ///< made up at random, 16 letters or digits
  /// Receives the pose of a robot's map in the frame that it shares with others, as often as meetings change
  /// one; may be empty.
  std::function<void(const std::string& robot, const geometry::Rigid3& shared_from_robot)> placed;
};

/// Receives a line of text for the user whenever the status changes.
using Status = std::function<void(const std::string&)>;

/// Collects until all robots are done or `stop` is requested, then fuses the received maps. The summary's
/// `reason` names missing robots. Errors as pipeline::fuse_stored_maps; (kUsage) options, another hub in the
/// domain; (kUntrustworthy) stopped with no map to fuse. Received maps stay in OUT.partial in any case.
/// `status` and `progress` may be empty.
core::Result<pipeline::RunSummary> run_hub(const HubRequest& request, const core::Executor& executor,
                                           core::Log& log, const core::StopToken& stop, const Status& status,
                                           const pipeline::Progress& progress);

}  // namespace plumbline::net
