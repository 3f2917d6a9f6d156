// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// `plumbline hub` as a call: robots' maps come in over a network, one result folder comes out
// (docs/method/network.md).
#include <cstdint>
#include <functional>
#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/net/options.hpp"
#include "plumbline/pipeline/fuse_maps.hpp"

namespace plumbline::net {

/// What came from one robot.
struct RobotTraffic {
  std::string name;
  std::size_t keyframes = 0;
  bool complete = false;             ///< its run came to an end
  bool done = false;                 ///< everything that it has is here
  std::uint64_t received_bytes = 0;  ///< of rows, by this process
  std::uint64_t place_bytes = 0;     ///< of these, by what they are for: features and poses of keyframes,
  std::uint64_t map_bytes = 0;       ///< landmarks, edges and frames,
  std::uint64_t cloud_bytes = 0;     ///< clouds
  std::uint64_t again_bytes = 0;     ///< had come before
  double longest_break_s = 0.0;      ///< without a sign of it
  double lag_median_s = 0.0;         ///< from a transaction in its store to the acknowledgement
  double lag_p95_s = 0.0;
};

struct HubRequest {
  pipeline::FuseRequest
      fuse;  ///< what is done in the end; `maps` is filled in, `output` is the result folder
  NetworkOptions network;
  std::size_t robots = 0;                      ///< that are waited for; 0: until it is stopped
  bool resume = false;                         ///< go on with what an interrupted hub left in OUT.partial
  std::uint64_t quota_bytes = 20'000'000'000;  ///< of disk, for each robot
  std::string fresh_id;                        ///< made up at random, 16 letters or digits
};

/// One line for people, whenever there is something new.
using Status = std::function<void(const std::string&)>;

/// Collects until all robots are done or `stop` is asked for, then fuses what is there. The summary's
/// `reason` names robots that are missing. Errors as pipeline::fuse_stored_maps; (kUsage) options, another
/// hub in the domain; (kUntrustworthy) stopped with no map to fuse: what came is kept. What came stays in
/// OUT.partial whatever happens. `status` and `progress` may be empty.
core::Result<pipeline::RunSummary> run_hub(const HubRequest& request, const core::Executor& executor,
                                           core::Log& log, const core::StopToken& stop, const Status& status,
                                           const pipeline::Progress& progress);

}  // namespace plumbline::net
