// SPDX-License-Identifier: BSD-3-Clause
#include "hub_desk.hpp"

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
constexpr int kPiecesAtATime = 4;           // of one robot, before the next one's
constexpr std::size_t kMostRobots = 64;     // when their number was not said
constexpr std::size_t kMostReported = 200;  // what strangers do fills no disk
constexpr const char* kDone = "done";

std::string key_of(const std::string& robot, const char* what) {
  return std::string("robot/") + robot + "/" + what;
}

}  // namespace

core::Result<std::unique_ptr<HubDesk>> HubDesk::open(const std::filesystem::path& folder,
                                                     const HubRequest& request, std::unique_ptr<HubBus> bus,
                                                     const core::Executor& executor, core::Log& log) {
  std::unique_ptr<HubDesk> desk(new HubDesk(folder, request, std::move(bus), executor, log));
  if (auto read = desk->read_ledger(); !read) return tl::unexpected(read.error());
  return desk;
}

core::Result<void> HubDesk::read_ledger() {
  const auto known = ledger().all();
  if (!known) return tl::unexpected(known.error());
  std::map<std::string, std::string> texts = *known;
  speaker_.set_id(texts["hub"].empty() ? request_.fresh_id : texts["hub"]);
  if (auto put = ledger().put({{"hub", speaker_.id()}}); !put) return put;
  for (const auto& [key, run] : *known) {
    constexpr std::size_t kAround = 10;  // of "robot/" and "/run"
    Hello hello;
    hello.name = key.size() > kAround ? key.substr(6, key.size() - kAround) : "";
    if (!is_robot_name(hello.name) || key != key_of(hello.name, "run")) continue;
    hello.run = run;
    hello.incarnation = std::strtoull(texts[key_of(hello.name, "incarnation")].c_str(), nullptr, 10);
    const auto robot = add(hello);
    if (!robot) return tl::unexpected(robot.error());
    (*robot)->done = texts[key_of(hello.name, "state")] == kDone;
    log_.info(fmt::format("{}: {} keyframes are here from before", hello.name, (*robot)->copy().keyframes()));
    if ((*robot)->copy().keyframes() > 0) meetings_.committed(hello.name);
  }
  return {};
}

core::Result<HubRobot*> HubDesk::add(const Hello& known) {
  auto robot = HubRobot::open(known, folder_ / "robots" / known.name / "map.db", request_.quota_bytes);
  if (!robot) return tl::unexpected(robot.error());
  if (auto listened = bus_->listen_to(known.name); !listened) return tl::unexpected(listened.error());
  return &robots_.insert_or_assign(known.name, std::move(*robot)).first->second;
}

core::Result<void> HubDesk::remember(const HubRobot& robot) const {
  const Hello& hello = robot.hello;
  return ledger().put({{key_of(hello.name, "run"), hello.run},
                       {key_of(hello.name, "incarnation"), std::to_string(hello.incarnation)},
                       {key_of(hello.name, "state"), robot.done ? kDone : "going on"}});
}

core::Result<void> HubDesk::look_for_others(const core::StopToken& stop) {
  const auto until = Clock::now() + kLookForOthers;
  while (Clock::now() < until && !stop.stop_requested()) {
    speaker_.say_presence();
    bus_->wait(kWait);
    for (const Word& word : bus_->hear_hubs()) {
      const bool first =
          word.up_s >= 0.0 || word.hub < speaker_.id();  // of two that begin together one stays
      if (word.hub == speaker_.id() || !first) continue;
      return core::usage_error(
          fmt::format("another hub is there in domain {}; end that one, or choose another --domain for this "
                      "one and its robots",
                      request_.network.domain));
    }
  }
  speaker_.serve();
  return {};
}

void HubDesk::report_once(const std::string& message) {
  if (reported_.size() < kMostReported && reported_.insert(message).second) log_.warning(message);
}

std::string HubDesk::refusal(const HeardHello& heard) const {
  const Hello& hello = heard.hello;
  if (hello.protocol != kProtocol || hello.store_format != maps::kStoreFormat) {
    return fmt::format("{} is of Plumbline {}, the hub of {}: use the same on both", hello.name,
                       hello.program, core::version());
  }
  const auto known = robots_.find(hello.name);
  if (known == robots_.end()) {
    const std::size_t most = request_.robots > 0 ? request_.robots : kMostRobots;
    if (robots_.size() < most) return {};
    std::string names;
    for (const auto& [name, robot] : robots_) names += (names.empty() ? "" : ", ") + name;
    return fmt::format("{}: the hub takes {} robots, and has {}; begin the hub with a larger --robots",
                       hello.name, most, names);
  }
  if (known->second.hello.run != hello.run) {
    return fmt::format(
        "{}: the hub has another run of that name; give this one another --name, or begin the hub without "
        "--resume in another folder",
        hello.name);
  }
  return {};
}

void HubDesk::hear(const HeardHello& heard) {
  const Hello& hello = heard.hello;
  if (!is_robot_name(hello.name)) return report_once("a robot with a name that cannot be is not listened to");
  if (heard.partition != hello.name) {
    return report_once(
        fmt::format("somebody who is not {} speaks in its name, and is not listened to", hello.name));
  }
  if (hello.run.empty()) return;
  const std::string why = refusal(heard);
  if (why.empty()) return let_in(hello);
  report_once(why);
  Word word;
  word.robot = hello.name;
  word.run = hello.run;
  word.incarnation = hello.incarnation;
  word.answer = Answer::kRefused;
  word.problem = why;
  speaker_.say(word);
}

void HubDesk::let_in(const Hello& hello) {
  auto known = robots_.find(hello.name);
  const bool is_new = known == robots_.end();
  const auto fail = [&](const core::Error& error) { report_once(hello.name + ": " + error.message); };
  if (is_new) {
    Hello known_by_name;
    known_by_name.name = hello.name;
    const auto added = add(known_by_name);
    if (!added) return fail(added.error());
    known = robots_.find(hello.name);
  }
  HubRobot& robot = known->second;
  if (hello.incarnation < robot.hello.incarnation) return;  // of a process that is gone
  const bool takes_over = hello.incarnation > robot.hello.incarnation;
  if (takes_over) robot.verdict = {};
  const auto rewound = robot.hear(hello);
  if (!rewound) return fail(rewound.error());
  if (*rewound) {
    log_.warning(hello.name + ": has lost what was here; everything is asked for again");
    meetings_.restart();
  }
  if (is_new || takes_over || *rewound) {
    if (auto put = remember(robot); !put) return fail(put.error());
    log_.info(fmt::format("{}: {} of its keyframes are here", hello.name, robot.copy().keyframes()));
    robot.changed = true;
  }
  if (robot.done != (robot.done && robot.has_all())) robot.done = false;
  finish(robot);
}

/// Remembered before it is said: a robot that was told may leave for ever.
void HubDesk::finish(HubRobot& robot) {
  if (!robot.has_all() || robot.verdict.answer == Answer::kRefused) return;
  if (!robot.done) {
    robot.done = true;
    if (auto put = remember(robot); !put) {
      robot.done = false;
      return report_once(robot.hello.name + ": " + put.error().message);
    }
    log_.info(fmt::format("{}: everything is here, {} keyframes{}", robot.hello.name,
                          robot.copy().keyframes(),
                          robot.copy().complete() ? "" : "; its run did not come to its end"));
  }
  robot.verdict.answer = Answer::kDone;
  robot.changed = true;
}

void HubDesk::take_pieces(HubRobot& robot) {
  const Hello& hello = robot.hello;
  HubRobot::Verdict& verdict = robot.verdict;
  for (const Piece& piece : bus_->take(hello.name, kPiecesAtATime)) {
    const bool other = piece.protocol != kProtocol || piece.name != hello.name || piece.run != hello.run ||
                       piece.incarnation != hello.incarnation;
    if (other || verdict.answer == Answer::kRefused || Clock::now() < verdict.until) continue;
    const std::int64_t before = robot.copy().heads().map;
    const auto taken = robot.take(piece);
    if (taken) {
      if (robot.copy().heads().map > before) meetings_.committed(hello.name);
      if (verdict.answer == Answer::kTrouble) verdict.answer = Answer::kAccepted;
      if (verdict.answer == Answer::kAccepted) verdict.problem.clear();
      finish(robot);
      continue;
    }
    const bool here = taken.error().kind == core::ErrorKind::kOutput;
    verdict.answer = here ? Answer::kTrouble : Answer::kRefused;
    verdict.problem =
        here ? fmt::format("{} cannot be stored at the hub: {}", hello.name, taken.error().message)
             : fmt::format(
                   "{} sent what no map of Plumbline {} holds ({}): check both ends for the same version, "
                   "then begin it again with --resume",
                   hello.name, core::version(), taken.error().message);
    log_.error(verdict.problem);
    robot.changed = true;
    if (here) verdict.until = Clock::now() + kTroubleLasts;
  }
}

Word HubDesk::word_for(const HubRobot& robot) const {
  Word word = robot.word();
  word.place = meetings_.place(word.robot);
  return word;
}

void HubDesk::say_all() {
  const bool again = speaker_.say_presence();
  for (auto& [name, robot] : robots_) {
    if (robot.hello.run.empty() || !(again || robot.changed)) continue;
    speaker_.say(word_for(robot));
    robot.changed = false;
  }
}

std::uint64_t HubDesk::received() const {
  std::uint64_t bytes = 0;
  for (const auto& [name, robot] : robots_) bytes += robot.traffic().received_bytes;
  return bytes;
}

std::string HubDesk::line(double kbytes_per_s) const {
  std::size_t keyframes = 0;
  std::size_t silent = 0;
  std::int64_t behind = 0;
  for (const auto& [name, robot] : robots_) {
    keyframes += robot.copy().keyframes();
    silent += robot.presence.silent() && !robot.done ? 1U : 0U;
    const std::int64_t lacks =
        std::max(robot.hello.map_head, robot.hello.clouds_head) - robot.copy().heads().last();
    behind += std::max<std::int64_t>(0, lacks);
  }
  const std::string of = request_.robots > 0 ? fmt::format(" of {}", request_.robots) : "";
  return fmt::format("{}{} robots ({} done{}), {} keyframes, {:.0f} kB/s, behind by {}", robots_.size(), of,
                     done(), silent > 0 ? fmt::format(", {} silent", silent) : "", keyframes, kbytes_per_s,
                     behind);
}

void HubDesk::listen() {
  for (const HeardHello& heard : bus_->hear()) hear(heard);
  for (const Word& word : bus_->hear_hubs()) {
    if (word.hub != speaker_.id() && word.up_s >= 0.0)
      report_once("another hub is there; robots stay with whom they found first");
  }
  for (auto& [name, robot] : robots_) {
    take_pieces(robot);
    const bool silent = robot.presence.silent() && !robot.done;
    if (robot.presence.tell(silent))
      log_.info(fmt::format("{}: {}", name, silent ? "is not heard any more" : "is heard"));
  }
}

void HubDesk::serve(const core::StopToken& stop, const Status& status) {
  auto line_at = Clock::now();
  std::uint64_t before = received();
  while (!stop.stop_requested()) {
    bus_->wait(kWait);
    listen();
    if (meetings_.step()) {
      for (auto& [name, robot] : robots_) robot.changed = true;
    }
    say_all();
    feedback_.step(robots_, meetings_, *bus_);
    const double since_s = std::chrono::duration<double>(Clock::now() - line_at).count();
    if (status && since_s >= 1.0) {
      const std::uint64_t now = received();
      status(line(static_cast<double>(now - before) / 1000.0 / since_s));
      before = now;
      line_at = Clock::now();
    }
    if (request_.robots > 0 && done() >= request_.robots) break;
  }
  meetings_.finish();
}

HubDesk::Collected HubDesk::close() {
  Collected collected;
  for (const auto& [name, robot] : robots_) {
    collected.traffic.push_back(robot.traffic());
    if (robot.done) collected.last_words.push_back(word_for(robot));
  }
  robots_.clear();
  return collected;
}

std::size_t HubDesk::done() const {
  return static_cast<std::size_t>(
      std::count_if(robots_.begin(), robots_.end(), [](const auto& entry) { return entry.second.done; }));
}

}  // namespace plumbline::net
