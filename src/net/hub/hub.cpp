// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/net/hub.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "hub/hub_server.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/own_files.hpp"
#include "plumbline/core/side_thread.hpp"
#include "plumbline/core/text.hpp"
#include "plumbline/maps/output_folder.hpp"
#include "plumbline/maps/stored_maps.hpp"
#include "plumbline/pipeline/verdict.hpp"

namespace plumbline::net {
namespace {

namespace fs = std::filesystem;

/// Writes every message to hub.log as well, with the time of day.
class LogFile : public core::Log {
 public:
  LogFile(const fs::path& file, core::Log& next) : file_(file, std::ios::app), next_(next) {}
  /// Also to the hub's file, with the time.
  void write(core::LogLevel level, const std::string& message) override {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      const std::time_t now = std::time(nullptr);
      file_ << fmt::format("{:%Y-%m-%d %H:%M:%S} {}\n", fmt::localtime(now), core::printable(message))
            << std::flush;
    }
    next_.write(level, message);
  }

 private:
  std::mutex mutex_;
  std::ofstream file_;
  core::Log& next_;
};

/// Moves all files of a folder into another, replacing those of the same name.
core::Result<void> move_all(const fs::path& from, const fs::path& to) {
  std::error_code ec;
  for (const auto& entry : fs::directory_iterator(from, ec)) {
    const fs::path target = to / entry.path().filename();
    if (fs::is_directory(entry.path(), ec) && fs::is_directory(target, ec)) {
      if (auto moved = move_all(entry.path(), target); !moved) return moved;
      continue;
    }
    fs::rename(entry.path(), target, ec);
    if (ec) return core::output_error(fmt::format("{}: cannot be made ({})", target.string(), ec.message()));
  }
  fs::remove(from, ec);
  return {};
}

/// Traffic of each robot, as in summary.json.
nlohmann::json json_of(const std::vector<RobotTraffic>& traffic) {
  nlohmann::json robots = nlohmann::json::object();
  for (const RobotTraffic& t : traffic) {
    robots[t.name] = {{"keyframes", t.keyframes},
                      {"complete", t.complete},
                      {"delivered", t.done},
                      {"bytes", {{"place", t.place_bytes}, {"map", t.map_bytes}, {"cloud", t.cloud_bytes}}},
                      {"sent_again_bytes", t.again_bytes},
                      {"longest_break_s", t.longest_break_s},
                      {"lag_s", {{"median", t.lag_median_s}, {"p95", t.lag_p95_s}}}};
  }
  return robots;
}

/// Adds the network's traffic, the meetings and the reason for doubt, if there is one, to the summary of the
/// fusion.
core::Result<void> add_network(const fs::path& file, const std::vector<RobotTraffic>& traffic,
                               const std::vector<pipeline::Meeting>& meetings, const std::string& reason) {
  auto read = core::read_json(file);
  if (!read) return core::output_error(read.error().message);
  nlohmann::ordered_json& summary = *read;
  summary["network"] = json_of(traffic);
  for (const pipeline::Meeting& m : meetings) {
    summary["meetings"].push_back(
        {{"number", m.number}, {"a", m.a}, {"b", m.b}, {"log", m.frame}, {"taken_back", m.taken_back}});
  }
  pipeline::add_to_verdict(reason, summary);
  return core::write_file(file, core::json_text(summary));
}

void add_reason(const std::string& why, std::string& reason) { reason += (reason.empty() ? "" : "; ") + why; }

/// Folders of the maps that were received; `reason` names what is missing.
std::vector<fs::path> received_maps(const fs::path& folder, const HubServer::Collected& collected,
                                    std::size_t expected, std::string& reason) {
  std::vector<fs::path> maps;
  for (const RobotTraffic& t : collected.traffic) {
    if (!t.done) add_reason(fmt::format("{} has not sent everything", t.name), reason);
    if (t.keyframes > 0) maps.push_back(folder / "robots" / t.name);
  }

  if (const std::size_t came = collected.traffic.size(); came < expected) {
    add_reason(fmt::format("{} of {} robots did not connect", expected - came, expected), reason);
  }

  return maps;
}

/// Removes maps that do not load from `maps`, and adds them to `reason`; false: all of them load.
bool leave_out_damaged(std::vector<fs::path>& maps, const core::Executor& executor, core::Log& log,
                       std::string& reason) {
  const auto is_damaged = [&](const fs::path& map) {
    const auto opened = maps::StoredMaps::open({map}, executor);
    if (opened) return false;
    const std::string name = map.filename().string();
    log.warning(fmt::format("{} is left out: {}", name, opened.error().message));
    add_reason(name + " is left out: its map does not load", reason);
    return true;
  };

  const auto kept = std::remove_if(maps.begin(), maps.end(), is_damaged);
  if (kept == maps.end()) return false;
  maps.erase(kept, maps.end());
  return true;
}

/// Only the hub learns why a participant with foreign keys gets nothing: lines on certificates become
/// warnings.
core::Result<std::unique_ptr<HubBus>> open_logged_bus(const NetworkOptions& options, core::Log& log) {
  const bool secured = !options.security.empty();
  return open_hub_bus(options, [&log, secured, reported = 0](const std::string& line) mutable {
    constexpr int kMostReported = 50;
    const bool keys = secured && line.find("ertificate") != std::string::npos && ++reported <= kMostReported;
    log.write(keys ? core::LogLevel::kWarning : core::LogLevel::kDebug, "DDS: " + line);
  });
}

/// The data of all robots, in the hub's folder.
struct Received {
  const fs::path& folder;
  const HubServer::Collected& collected;
  const HubMeetings& meetings;
};

/// Fuses the received maps; the summary's `reason` says why the result may not be trusted.
core::Result<pipeline::RunSummary> fuse_collected(const HubRequest& request, const Received& received,
                                                  const core::Executor& executor, core::Log& log,
                                                  const pipeline::Progress& progress) {
  // Result in a folder below the received data
  const fs::path& folder = received.folder;
  std::string reason;
  pipeline::FuseRequest last = request.fuse;
  last.maps = received_maps(folder, received.collected, request.robots, reason);
  last.output = folder / "fused";
  last.replace = true;
  // A run that was killed while it moved these has left some of them.
  if (auto removed = core::remove_own_files(last.output, maps::result_kind().files); !removed)
    return tl::unexpected(removed.error());

  // Without a map there is no result
  const auto fuse = [&]() -> core::Result<pipeline::RunSummary> {
    if (!last.maps.empty()) {
      return pipeline::fuse_stored_maps(last, executor, log, core::StopToken(), progress);
    }
    return core::failure(
        core::ErrorKind::kUntrustworthy,
        fmt::format("no map was received that could be fused{}; received data are in {}, --resume continues",
                    reason.empty() ? "" : " (" + reason + ")", folder.string()));
  };

  // A damaged map must not keep the others from being fused.
  auto summary = fuse();
  if (!summary && leave_out_damaged(last.maps, executor, log, reason)) summary = fuse();
  if (!summary) return tl::unexpected(summary.error());

  // The result moves into the hub's folder
  if (!reason.empty()) add_reason(reason, summary->reason);
  if (auto moved = move_all(last.output, folder); !moved) return tl::unexpected(moved.error());
  if (auto added = add_network(folder / "summary.json", received.collected.traffic,
                               received.meetings.meetings(), reason);
      !added) {
    return tl::unexpected(added.error());
  }
  return summary;
}

}  // namespace

core::Result<pipeline::RunSummary> run_hub(const HubRequest& request, const core::Executor& executor,
                                           core::Log& console, const core::StopToken& stop,
                                           const Status& status, const pipeline::Progress& progress) {
  // Received data stay even if the hub fails
  const auto options = checked(request.network, true);
  if (!options) return tl::unexpected(options.error());
  auto output = maps::OutputFolder::prepare(request.fuse.output, request.fuse.replace, request.resume);
  if (!output) return tl::unexpected(output.error());
  output->keep();
  const fs::path folder = output->path();

  // The log is kept with the data
  LogFile log(folder / "hub.log", console);
  if (auto secure = warn_of_security(*options, "anybody on it can read maps and send data", log); !secure)
    return tl::unexpected(secure.error());
  auto bus = open_logged_bus(*options, log);
  if (!bus) return tl::unexpected(bus.error());

  // Two hubs would answer the same robots
  auto server = HubServer::open(folder, request, std::move(*bus), executor, log);
  if (!server) return tl::unexpected(server.error());
  if (auto alone = (*server)->look_for_others(stop); !alone) return tl::unexpected(alone.error());
  log.info(fmt::format("waiting for {} on {}, domain {}",
                       request.robots > 0 ? fmt::format("{} robots", request.robots)
                                          : "robots; press Ctrl-C to fuse what was received",
                       options->interface, options->domain));

  // Until all robots are done or the user stops
  (*server)->serve(stop, status);
  const HubServer::Collected collected = (*server)->close();

  // Robots receive their final status during the fusion
  const core::SideThread farewell([&](const core::StopToken& enough) {
    (*server)->publisher().publish_final(collected.final_statuses, enough);
  });
  auto summary = fuse_collected(request, {folder, collected, (*server)->meetings()}, executor, log, progress);

  // A failed fusion keeps the received data
  if (!summary) {
    core::Error error = output->explained(summary.error());
    if (error.kind == core::ErrorKind::kOutput)
      error.message += fmt::format("; received data are in {}, --resume continues", folder.string());
    return tl::unexpected(error);
  }
  if (auto committed = output->commit(); !committed) return tl::unexpected(committed.error());
  return summary;
}

}  // namespace plumbline::net
