// SPDX-License-Identifier: BSD-3-Clause
#include "hub/hub_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "plumbline/core/version.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;

constexpr auto kWait = 50ms;
constexpr auto kLookForOthers = 2500ms;
constexpr auto kTroubleLasts = 3s;
constexpr int kReceivedAtATime = 4;         // of one robot, before the next one's
constexpr std::size_t kMaxRobots = 64;      // without --robots
constexpr std::size_t kMostReported = 200;  // messages about strangers: they must not fill the disk
constexpr const char* kDone = "done";

std::string key_of(const std::string& robot, const char* what) {
  return std::string("robot/") + robot + "/" + what;
}

}  // namespace

/// Opens the folder with all robots that are known from before.
core::Result<std::unique_ptr<HubServer>> HubServer::open(const std::filesystem::path& folder,
                                                         const HubRequest& request,
                                                         std::unique_ptr<HubBus> bus,
                                                         const core::Executor& executor, core::Log& log) {
  std::unique_ptr<HubServer> server(new HubServer(folder, request, std::move(bus), executor, log));
  if (auto loaded = server->load_ledger(); !loaded) return tl::unexpected(loaded.error());
  return server;
}

core::Result<void> HubServer::load_ledger() {
  // The hub keeps its identity across restarts
  const auto known = ledger().all();
  if (!known) return tl::unexpected(known.error());
  std::map<std::string, std::string> texts = *known;
  publisher_.set_id(texts["hub"].empty() ? request_.fresh_id : texts["hub"]);
  if (auto put = ledger().put({{"hub", publisher_.id()}}); !put) return put;

  // Robots of the ledger, with their copies
  for (const auto& [key, run] : *known) {
    constexpr std::size_t kAround = 10;  // length of "robot/" and "/run"
    RobotStatus robot;
    robot.name = key.size() > kAround ? key.substr(6, key.size() - kAround) : "";
    if (!is_robot_name(robot.name) || key != key_of(robot.name, "run")) continue;
    robot.run = run;
    robot.incarnation = std::strtoull(texts[key_of(robot.name, "incarnation")].c_str(), nullptr, 10);

    // A robot that was done stays done
    const auto session = open_session(robot);
    if (!session) return tl::unexpected(session.error());
    (*session)->done = texts[key_of(robot.name, "state")] == kDone;
    const std::size_t keyframes = (*session)->copy().keyframes();
    log_.info(fmt::format("{}: {} keyframes are here from before", robot.name, keyframes));

    // Known keyframes may already meet others
    if (keyframes > 0) meetings_.mark_changed(robot.name);
  }
  return {};
}

core::Result<void> HubServer::save(const RobotSession& session) const {
  const RobotStatus& robot = session.robot;
  return ledger().put({{key_of(robot.name, "run"), robot.run},
                       {key_of(robot.name, "incarnation"), std::to_string(robot.incarnation)},
                       {key_of(robot.name, "state"), session.done ? kDone : "going on"}});
}

core::Result<RobotSession*> HubServer::open_session(const RobotStatus& known) {
  auto session = RobotSession::open(known, folder_ / "robots" / known.name / "map.db", request_.quota_bytes);
  if (!session) return tl::unexpected(session.error());
  if (auto subscribed = bus_->subscribe(known.name); !subscribed) return tl::unexpected(subscribed.error());
  return &robots_.insert_or_assign(known.name, std::move(*session)).first->second;
}

core::Result<void> HubServer::look_for_others(const core::StopToken& stop) {
  const auto until = Clock::now() + kLookForOthers;
  std::vector<ReceivedStatus> early;  // received meanwhile: unread ones would end each wait at once

  // Statuses of robots are kept for later
  while (Clock::now() < until && !stop.stop_requested()) {
    publisher_.publish_presence();
    bus_->wait(kWait);
    for (ReceivedStatus& received : bus_->poll_robots()) early.push_back(std::move(received));

    for (const HubStatus& other : bus_->poll_hubs()) {
      // If two hubs start together, the one with the lower id stays.
      const bool stays = other.up_s >= 0.0 || other.hub < publisher_.id();
      if (other.hub == publisher_.id() || !stays) continue;
      return core::usage_error(fmt::format(
          "another hub is running in domain {}; end that one, or choose another --domain for this "
          "one and its robots",
          request_.network.domain));
    }
  }

  // The search is over: answer the robots
  publisher_.serve();
  for (const ReceivedStatus& received : early) receive_status(received);
  return {};
}

void HubServer::report_once(const std::string& message) {
  if (reported_.size() < kMostReported && reported_.insert(message).second) log_.warning(message);
}

std::string HubServer::refusal(const RobotStatus& robot) const {
  // Versions must agree
  if (robot.protocol != kProtocol || robot.store_format != maps::kStoreFormat) {
    return fmt::format("{} runs Plumbline {}, the hub {}: use the same version on both", robot.name,
                       robot.program, core::version());
  }

  // A new robot needs a free place
  const auto known = robots_.find(robot.name);
  if (known == robots_.end()) {
    const std::size_t most = request_.robots > 0 ? request_.robots : kMaxRobots;
    if (robots_.size() < most) return {};
    std::string names;
    for (const auto& [name, session] : robots_) names += (names.empty() ? "" : ", ") + name;
    return fmt::format("{}: the hub accepts {} robots, and has {}; start the hub with a larger --robots",
                       robot.name, most, names);
  }

  // A name belongs to one run
  if (known->second.robot.run != robot.run) {
    return fmt::format(
        "{}: the hub has another run of that name; give this one another --name, or start the hub without "
        "--resume in another folder",
        robot.name);
  }
  return {};
}

/// Admits the robot or tells it why not.
void HubServer::receive_status(const ReceivedStatus& received) {
  const RobotStatus& robot = received.status;
  if (!is_robot_name(robot.name)) return report_once("a robot with an invalid name is ignored");
  if (received.partition != robot.name) {
    return report_once(fmt::format("another participant sends in the name of {}; it is ignored", robot.name));
  }
  if (robot.run.empty()) return;
  const std::string why = refusal(robot);
  if (why.empty()) return admit(robot);

  report_once(why);
  HubStatus answer;
  answer.robot = robot.name;
  answer.run = robot.run;
  answer.incarnation = robot.incarnation;
  answer.answer = Answer::kRefused;
  answer.problem = why;
  publisher_.publish(answer);
}

void HubServer::admit(const RobotStatus& robot) {
  // The robot's copy is opened once
  const auto fail = [&](const core::Error& error) { report_once(robot.name + ": " + error.message); };
  auto known = robots_.find(robot.name);
  const bool is_new = known == robots_.end();
  if (is_new) {
    RobotStatus name_only;
    name_only.name = robot.name;
    if (const auto opened = open_session(name_only); !opened) return fail(opened.error());
    known = robots_.find(robot.name);
  }

  // A newer process replaces the older one
  RobotSession& session = known->second;
  if (robot.incarnation < session.robot.incarnation) return;  // from a process that has ended
  const bool takes_over = robot.incarnation > session.robot.incarnation;
  if (takes_over) session.reply = {};
  const auto emptied = session.apply(robot);
  if (!emptied) return fail(emptied.error());

  // A robot that lost data sends everything again
  if (*emptied) {
    log_.warning(robot.name + ": has lost transactions that are here; everything is requested again");
    meetings_.restart();
  }

  // The ledger follows every change
  if (is_new || takes_over || *emptied) {
    if (auto saved = save(session); !saved) return fail(saved.error());
    log_.info(fmt::format("{}: {} of its keyframes are here", robot.name, session.copy().keyframes()));
    session.changed = true;
  }

  // New data make a finished robot unfinished
  if (!session.has_all()) session.done = false;
  confirm_if_complete(session);
}

/// Saves completion before it is published: a robot that learned of it may leave for ever.
void HubServer::confirm_if_complete(RobotSession& session) {
  if (!session.has_all() || session.reply.answer == Answer::kRefused) return;
  if (!session.done) {
    session.done = true;
    if (auto saved = save(session); !saved) {
      session.done = false;
      return report_once(session.robot.name + ": " + saved.error().message);
    }
    log_.info(fmt::format("{}: everything is here, {} keyframes{}", session.robot.name,
                          session.copy().keyframes(),
                          session.copy().complete() ? "" : "; its run did not finish"));
  }
  session.reply.answer = Answer::kDone;
  session.changed = true;
}

/// Chunks of this process of the robot; failures are answered in its status.
void HubServer::receive_chunks(RobotSession& session) {
  const RobotStatus& robot = session.robot;
  RobotSession::Reply& reply = session.reply;
  for (const Chunk& chunk : bus_->receive(robot.name, kReceivedAtATime)) {
    const bool foreign = chunk.protocol != kProtocol || chunk.name != robot.name || chunk.run != robot.run ||
                         chunk.incarnation != robot.incarnation;
    if (foreign || reply.answer == Answer::kRefused || Clock::now() < reply.until) continue;

    const std::int64_t before = session.copy().heads().map;
    if (const auto received = session.receive(chunk); !received) {
      apply_failure(session, received.error());
      continue;
    }
    if (session.copy().heads().map > before) meetings_.mark_changed(robot.name);
    if (reply.answer == Answer::kTrouble) reply.answer = Answer::kAccepted;
    if (reply.answer == Answer::kAccepted) reply.problem.clear();
    confirm_if_complete(session);
  }
}

/// Refuses a robot whose rows are wrong; lets it wait if this machine cannot store them.
void HubServer::apply_failure(RobotSession& session, const core::Error& error) {
  RobotSession::Reply& reply = session.reply;
  const std::string& name = session.robot.name;
  if (error.kind == core::ErrorKind::kOutput) {
    reply.answer = Answer::kTrouble;
    reply.problem = fmt::format("{} cannot be stored at the hub: {}", name, error.message);
    reply.until = Clock::now() + kTroubleLasts;
  } else {
    reply.answer = Answer::kRefused;
    reply.problem = fmt::format(
        "{} sent data that Plumbline {} cannot store ({}): check both ends for the same version, then start "
        "it again with --resume",
        name, core::version(), error.message);
  }
  log_.error(reply.problem);
  session.changed = true;
}

HubStatus HubServer::status_of(const RobotSession& session) const {
  HubStatus status = session.status();
  status.frame = meetings_.frame(status.robot);
  return status;
}

/// Statuses are repeated, since any may be lost.
void HubServer::publish_all() {
  const bool due = publisher_.publish_presence();
  for (auto& [name, session] : robots_) {
    if (session.robot.run.empty() || !(due || session.changed)) continue;
    publisher_.publish(status_of(session));
    session.changed = false;
  }
}

std::uint64_t HubServer::received_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [name, session] : robots_) bytes += session.traffic().received_bytes;
  return bytes;
}

/// One line for the terminal.
std::string HubServer::progress_line(double kbytes_per_s) const {
  std::size_t keyframes = 0;
  std::size_t silent = 0;
  std::int64_t behind = 0;
  for (const auto& [name, session] : robots_) {
    keyframes += session.copy().keyframes();
    silent += session.presence.silent() && !session.done ? 1U : 0U;
    const std::int64_t head = std::max(session.robot.map_head, session.robot.clouds_head);
    behind += std::max<std::int64_t>(0, head - session.copy().heads().last());
  }

  const std::string of = request_.robots > 0 ? fmt::format(" of {}", request_.robots) : "";
  return fmt::format("{}{} robots ({} done{}), {} keyframes, {:.0f} kB/s, behind by {}", robots_.size(), of,
                     done(), silent > 0 ? fmt::format(", {} silent", silent) : "", keyframes, kbytes_per_s,
                     behind);
}

/// Everything received since the last step.
void HubServer::poll() {
  for (const ReceivedStatus& received : bus_->poll_robots()) receive_status(received);
  for (const HubStatus& hub : bus_->poll_hubs()) {
    if (hub.hub != publisher_.id() && hub.up_s >= 0.0)
      report_once("another hub is running; robots stay with the one that they found first");
  }
  for (auto& [name, session] : robots_) {
    receive_chunks(session);
    const bool silent = session.presence.silent() && !session.done;
    if (session.presence.report(silent))
      log_.info(fmt::format("{}: {}", name, silent ? "has fallen silent" : "is connected"));
  }
}

void HubServer::serve(const core::StopToken& stop, const Status& status) {
  // Rates are measured between two lines
  auto line_at = Clock::now();
  std::uint64_t before = received_bytes();

  // Statuses and chunks first
  while (!stop.stop_requested()) {
    bus_->wait(kWait);
    poll();

    // Meetings change the common frames
    if (meetings_.step(robots_)) {
      for (auto& [name, session] : robots_) {
        session.changed = true;
        const SharedFrame frame = meetings_.frame(name);
        if (request_.placed && !frame.frame_of.empty()) request_.placed(name, pose_of(frame));
      }
    }

    // Answers, feedback and display
    publish_all();
    feedback_.step(robots_, meetings_, *bus_);
    show_.step(robots_, meetings_);

    // A line per second
    const double since_s = std::chrono::duration<double>(Clock::now() - line_at).count();
    if (status && since_s >= 1.0) {
      const std::uint64_t now = received_bytes();
      status(progress_line(static_cast<double>(now - before) / 1000.0 / since_s));
      before = now;
      line_at = Clock::now();
    }
    if (request_.robots > 0 && done() >= request_.robots) break;
  }

  meetings_.finish(robots_);
}

/// Traffic and final statuses; the copies are closed.
HubServer::Collected HubServer::close() {
  show_.finish();
  Collected collected;
  for (const auto& [name, session] : robots_) {
    collected.traffic.push_back(session.traffic());
    if (session.done) collected.final_statuses.push_back(status_of(session));
  }
  robots_.clear();
  return collected;
}

std::size_t HubServer::done() const {
  return static_cast<std::size_t>(
      std::count_if(robots_.begin(), robots_.end(), [](const auto& entry) { return entry.second.done; }));
}

}  // namespace plumbline::net
