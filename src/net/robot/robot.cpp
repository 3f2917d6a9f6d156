// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/net/robot.hpp"

#include <fmt/format.h>

#include <chrono>
#include <system_error>
#include <thread>
#include <utility>

#include "plumbline/maps/output_folder.hpp"
#include "robot/robot_link.hpp"

namespace plumbline::net {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr const char* kStore = "map.db";

/// Checks the request and opens the link to the hub. `feedback`: as RobotLink's.
core::Result<std::unique_ptr<RobotLink>> open_link(const RobotRequest& request,
                                                   std::shared_ptr<mapping::OtherMapsInbox> feedback,
                                                   core::Log& log) {
  if (!is_robot_name(request.name)) {
    return core::usage_error(
        "--name: use at most 64 letters, digits, '.', '_' and '-', the first a letter or digit");
  }

  const auto options = checked(request.network, false);
  if (!options) return tl::unexpected(options.error());
  const std::string danger = "anybody on it can read the map and send data as " + request.name;
  if (auto secure = warn_of_security(*options, danger, log); !secure) return tl::unexpected(secure.error());

  auto bus =
      open_robot_bus(*options, request.name, [&log](const std::string& line) { log.debug("DDS: " + line); });
  if (!bus) return tl::unexpected(bus.error());
  return std::make_unique<RobotLink>(std::move(*bus), request.name, request.fresh_id, std::move(feedback),
                                     log);
}

std::string line_of(const LinkStatus& s, double kbytes_per_s) {
  if (!s.refused.empty()) return "refused by the hub";
  if (!s.found) return "no hub yet";
  if (!s.connected) return fmt::format("hub lost, behind by {} transactions", s.behind);
  return fmt::format("hub, behind by {} transactions, {:.0f} kB/s{}{}", s.behind, kbytes_per_s,
                     s.location.empty() ? "" : ", ", s.location);
}

/// Data rate in kB/s, over the last second or more.
class Rate {
 public:
  double operator()(std::uint64_t bytes) {
    const double since_s = std::chrono::duration<double>(Clock::now() - at_).count();
    if (since_s >= 1.0) {
      value_ = static_cast<double>(bytes - bytes_) / 1000.0 / since_s;
      at_ = Clock::now();
      bytes_ = bytes;
    }
    return value_;
  }

 private:
  Clock::time_point at_ = Clock::now();
  std::uint64_t bytes_ = 0;
  double value_ = 0.0;  ///< kB/s
};

/// Waits until the hub has received everything, or the robot gives up.
core::Result<RobotOutcome> deliver(const RobotRequest& request, const fs::path& folder, const RobotLink& link,
                                   RobotOutcome outcome, const core::StopToken& stop, const Status& status) {
  // Shown to the user if nothing is delivered
  const std::string command = fmt::format("plumbline robot '{}' {}", folder.string(), request.hand_in);
  const auto since = Clock::now();
  Rate rate;

  while (true) {
    // The hub has everything
    const LinkStatus now = link.status();
    if (now.done) {
      outcome.delivered = true;
      return outcome;
    }

    // A refused run stays in its folder
    if (!now.refused.empty()) {
      return core::usage_error(fmt::format("{}; the map is in {}", now.refused, folder.string()));
    }
    if (status) status(line_of(now, rate(now.sent_bytes)));

    // No hub was ever found
    const auto waited_s = [](Clock::time_point from) {
      return std::chrono::duration<double>(Clock::now() - from).count();
    };
    const bool stopped = stop.stop_requested();
    if (!now.found && (stopped || waited_s(since) > request.wait_s)) {
      outcome.undelivered = fmt::format("no hub has answered; the map is in {}. To send it later: {}",
                                        folder.string(), command);
      return outcome;
    }

    // The hub stopped making progress
    if (now.found && (stopped || waited_s(std::max(now.progress, since)) > request.wait_lost_s)) {
      const std::string why = now.problem.empty() ? "" : " (" + now.problem + ")";
      return core::failure(
          core::ErrorKind::kUntrustworthy,
          fmt::format("the hub has not received everything{}; the map is in {}. To send the rest: {}", why,
                      folder.string(), command));
    }

    std::this_thread::sleep_for(50ms);
  }
}

}  // namespace

/// The folder of a run with a store, complete or not.
fs::path earlier_run(const std::string& input) {
  std::error_code ec;
  if (input.rfind("synth:", 0) == 0) return {};
  if (fs::exists(fs::path(input) / kStore, ec)) return input;
  const fs::path partial = maps::OutputFolder::partial_of(input);
  if (fs::exists(partial / kStore, ec)) return partial;
  return {};
}

/// Sends the store of an earlier run.
core::Result<RobotOutcome> hand_in(const RobotRequest& request, const fs::path& folder, core::Log& log,
                                   const core::StopToken& stop, const Status& status) {
  if (auto heads = maps::store_heads(folder / kStore); !heads) return tl::unexpected(heads.error());
  auto link = open_link(request, nullptr, log);
  if (!link) return tl::unexpected(link.error());
  if (auto followed = (*link)->follow(folder / kStore); !followed) return tl::unexpected(followed.error());
  (*link)->finish(folder / kStore);
  return deliver(request, folder, **link, {}, stop, status);
}

core::Result<RobotOutcome> run_robot(const RobotRequest& request, const core::Executor& executor,
                                     core::Log& log, const core::StopToken& stop, const Status& status,
                                     const pipeline::Progress& progress) {
  // The link runs in parallel with the mapping
  const auto others = request.feedback ? std::make_shared<mapping::OtherMapsInbox>() : nullptr;
  auto link = open_link(request, others, log);
  if (!link) return tl::unexpected(link.error());

  // The store is followed once it exists
  pipeline::MapRequest map = request.map;
  map.feedback = others;
  map.prepared = [&](const fs::path& folder) {
    if (auto followed = (*link)->follow(folder / kStore); !followed) log.error(followed.error().message);
    if (request.map.prepared) request.map.prepared(folder);
  };

  // Progress shows tracking and transmission
  Rate rate;
  const auto frames = [&](std::size_t done, std::size_t total) {
    const LinkStatus now = (*link)->status();
    if (progress) progress(done, total);
    if (status) status(line_of(now, rate(now.sent_bytes)));
  };
  auto summary = pipeline::map_recording(map, executor, log, stop, frames);
  if (!summary) return tl::unexpected(summary.error());

  // A pipeline without a store has nothing to send
  std::error_code ec;
  const fs::path store = request.map.output / kStore;
  if (!fs::exists(store, ec)) {
    return core::usage_error(fmt::format(
        "{}: this pipeline writes no map.db, so there is nothing to send; add a stage of type store",
        request.map.pipeline));
  }

  // The rest is sent after the mapping
  (*link)->finish(store);
  RobotOutcome outcome;
  outcome.summary = std::move(*summary);
  const core::StopToken never;  // a stop that ended the mapping does not end the delivery
  return deliver(request, request.map.output, **link, std::move(outcome),
                 stop.stop_requested() ? never : stop, status);
}

}  // namespace plumbline::net
