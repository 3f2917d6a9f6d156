// SPDX-License-Identifier: BSD-3-Clause
#include "robot/hub_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;

constexpr auto kDisconnected = 5s;  // without a status
constexpr auto kOtherHub = 10s;     // without a status, until another hub is accepted
constexpr auto kSilence = 10s;      // without any hub, until a warning

}  // namespace

/// One warning if no hub answers.
void HubSession::report_silence(RobotBus& bus) {
  if (silence_reported_ || status_.found || Clock::now() - started_ < kSilence) return;
  silence_reported_ = true;
  log_.warning(
      bus.participants() > 0
          ? "no answer in 10 s, but another participant is on the network: it may be no hub, or keys "
            "may be missing or foreign"
          : "no answer in 10 s; is the hub started, in the same domain, and reachable?");
}

LinkStatus HubSession::status() const {
  LinkStatus status = status_;
  status.connected = status.found && Clock::now() - received_at_ < kDisconnected;
  return status;
}

bool HubSession::accepts() const {
  const bool accepted = hub_.answer == Answer::kAccepted || hub_.answer == Answer::kDone;
  return accepted && status().connected && status_.refused.empty();
}

/// Keeps the hub that was found first as long as it is there. True: this is the selected hub.
bool HubSession::select(const HubStatus& hub) {
  if (id_ == hub.hub) return true;
  if (!id_.empty() && Clock::now() - received_at_ < kOtherHub) {
    if (!std::exchange(other_hub_reported_, true)) log_.warning("a second hub is running; it is ignored");
    return false;
  }
  log_.info("hub found");
  id_ = hub.hub;
  hub_ = {};
  return true;
}

bool HubSession::apply(const HubStatus& hub, const RobotStatus& robot) {
  // A hub of another version cannot read the store
  if (hub.protocol == kProtocol && hub.up_s < 0.0) return false;  // it is not serving yet
  status_.found = true;
  if (hub.protocol != kProtocol || hub.store_format != robot.store_format) {
    status_.refused = fmt::format("the hub runs Plumbline {}, this robot {}: use the same version on both",
                                  hub.program, robot.program);
    return false;
  }

  // One hub at a time; others are ignored
  const bool another = id_ != hub.hub;
  if (!select(hub)) return false;
  received_at_ = Clock::now();
  if (hub.robot != robot.name || hub.run != robot.run || robot.incarnation == 0) return another;

  // A hub that is about to leave answers the previous incarnation; that counts if nothing was added since.
  const bool complete =
      hub.answer == Answer::kDone && robot.finished && hub.map_held == robot.map_head &&
      hub.clouds_held == robot.clouds_head &&
      robot.heads_at_start.back() == static_cast<std::uint64_t>(std::max(hub.map_held, hub.clouds_held));
  if (complete) status_.done = true;
  if (hub.incarnation == robot.incarnation) apply_answer(hub, robot.finished);
  return another;
}

/// The hub's answer about this run.
void HubSession::apply_answer(const HubStatus& hub, bool finished) {
  status_.problem = hub.answer == Answer::kTrouble ? hub.problem : "";
  if (!hub.problem.empty() && hub.problem != hub_.problem) log_.warning("hub: " + hub.problem);
  if (hub.answer == Answer::kRefused) {
    status_.refused = hub.problem;
    hub_.problem = hub.problem;
    return;
  }

  if (hub.answer == Answer::kDone) status_.done = finished;
  const bool moved =
      hub.map_held != hub_.map_held || hub.clouds_held != hub_.clouds_held || hub.chunks != hub_.chunks;
  if (moved) status_.progress = Clock::now();
  report_frame(hub.frame, hub.robot);
  hub_ = hub;
}

/// Logs a change of the shared frame; the pose in it goes into the status only.
void HubSession::report_frame(const SharedFrame& frame, const std::string& name) {
  status_.location.clear();
  const bool changed = hub_.frame.frame_of != frame.frame_of;
  if (frame.frame_of.empty() || !is_robot_name(frame.frame_of)) {
    if (changed) log_.warning("hub: the meeting is taken back; this map is in its own frame again");
    return;
  }

  const auto sigma = [&](std::size_t x, std::size_t y, std::size_t z) {
    return std::sqrt(std::max(0.0, frame.covariance[x] + frame.covariance[y] + frame.covariance[z]));
  };
  constexpr double kDegrees = 180.0 / 3.14159265358979323846;
  const std::array<double, 7>& at = frame.frame_from_camera;
  status_.location = fmt::format("in {} at {:.2f} {:.2f} {:.2f} m (known to {:.0f} mm, {:.1f} deg)",
                                 frame.frame_of == name ? "its own frame" : frame.frame_of + "'s frame",
                                 at[0], at[1], at[2], 1e3 * sigma(0, 6, 11), kDegrees * sigma(15, 18, 20));
  if (changed) log_.info("hub: this robot met others; now " + status_.location);
}

}  // namespace plumbline::net
