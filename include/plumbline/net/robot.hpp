// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// `plumbline robot` as a call: a recording is mapped, and the map sent to a hub beside it
// (docs/method/network.md).
#include <filesystem>
#include <optional>
#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/net/hub.hpp"
#include "plumbline/net/options.hpp"
#include "plumbline/pipeline/map_recording.hpp"

namespace plumbline::net {

struct RobotRequest {
  pipeline::MapRequest map;  ///< `output` is the result folder; a `prepared` of the caller's is called, too
  std::string name;
  NetworkOptions network;
  bool feedback = false;       ///< maps of other robots serve for relocalisation and loops
  double wait_s = 30.0;        ///< for a hub that was never heard, after the last frame
  double wait_lost_s = 600.0;  ///< for one that was, since it acknowledged something
  std::string fresh_id;        ///< made up at random, 16 letters or digits
  std::string hand_in;         ///< arguments of the command that hands the map in later, without the folder
};

struct RobotOutcome {
  std::optional<pipeline::RunSummary> summary;  ///< of the run; none when a map was only handed in
  bool delivered = false;                       ///< a hub has all of it
  std::string undelivered;                      ///< why not, and the command that does it later
};

/// The folder with the map of an earlier run that `input` names, finished or interrupted; empty: it is none.
std::filesystem::path earlier_run(const std::string& input);

/// The map is a function of recording, camera and configuration, whatever the network does, but with
/// feedback: nothing of it is waited for before the last frame. Errors as pipeline::map_recording; (kUsage)
/// options, a hub that refuses this robot; (kUntrustworthy) a hub was there and has not got everything: the
/// message has the command. `status` and `progress` may be empty.
core::Result<RobotOutcome> run_robot(const RobotRequest& request, const core::Executor& executor,
                                     core::Log& log, const core::StopToken& stop, const Status& status,
                                     const pipeline::Progress& progress);

/// Sends the map of an earlier run: `folder` as earlier_run gives it. As run_robot.
core::Result<RobotOutcome> hand_in(const RobotRequest& request, const std::filesystem::path& folder,
                                   core::Log& log, const core::StopToken& stop, const Status& status);

}  // namespace plumbline::net
