// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// `plumbline robot` as a call: maps a recording and sends the map to a hub meanwhile
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
  pipeline::MapRequest map;  ///< `output` is the result folder; the caller's `prepared` is called, too
  std::string name;
  NetworkOptions network;
  bool feedback = false;       ///< use maps of other robots for relocalisation and loops
  double wait_s = 30.0;        ///< time to wait after the last frame for a hub to answer
  double wait_lost_s = 600.0;  ///< time to wait since the last acknowledgement of a hub that has answered
  std::string fresh_id;        ///< random id, 16 letters or digits
  std::string hand_in;         ///< arguments of the command that sends the map later, without the folder
};

struct RobotOutcome {
  std::optional<pipeline::RunSummary> summary;  ///< of the run; none if an existing map was sent
  bool delivered = false;                       ///< a hub holds the whole map
  std::string undelivered;  ///< why it was not delivered, and the command that sends it later
};

/// Folder of the earlier run, finished or interrupted, that `input` names; empty: it names none.
std::filesystem::path earlier_run(const std::string& input);

/// Without feedback the map depends on recording, camera and configuration only: the run never waits for the
/// network before its last frame. Errors as pipeline::map_recording; (kUsage) options, a hub that refuses
/// this robot; (kUntrustworthy) a hub has answered but not received everything: the message has the command
/// to continue. `status` and `progress` may be empty.
core::Result<RobotOutcome> run_robot(const RobotRequest& request, const core::Executor& executor,
                                     core::Log& log, const core::StopToken& stop, const Status& status,
                                     const pipeline::Progress& progress);

/// Sends the map of an earlier run: `folder` as earlier_run gives it. As run_robot.
core::Result<RobotOutcome> hand_in(const RobotRequest& request, const std::filesystem::path& folder,
                                   core::Log& log, const core::StopToken& stop, const Status& status);

}  // namespace plumbline::net
