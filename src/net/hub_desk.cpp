// SPDX-License-Identifier: BSD-3-Clause
#include "hub_desk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <thread>
#include <utility>

#include "plumbline/core/version.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;

constexpr auto kWait = 50ms;
constexpr auto kSayAgain = 500ms;
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
  if (auto read = desk->read_ledger(); !read) return tl::unexpected<core::Error>(read.error());
  return desk;
}

core::Result<void> HubDesk::read_ledger() {
  const auto known = ledger_.all();
  if (!known) return tl::unexpected<core::Error>(known.error());
  std::map<std::string, std::string> texts(known->begin(), known->end());
  id_ = texts["hub"];
  if (id_.empty()) {
    id_ = request_.fresh_id;
    if (auto put = ledger_.put({{"hub", id_}}); !put) return put;
  }
  for (const auto& [key, run] : *known) {
    constexpr std::size_t kPrefix = 6;
    const std::string ending = "/run";
    if (key.rfind("robot/", 0) != 0 || key.size() <= kPrefix + ending.size()) continue;
    if (key.compare(key.size() - ending.size(), ending.size(), ending) != 0) continue;
    Hello hello;
    hello.name = key.substr(kPrefix, key.size() - kPrefix - ending.size());
    if (!is_robot_name(hello.name)) continue;
    hello.run = run;
    const auto robot = add(hello);
    if (!robot) return tl::unexpected<core::Error>(robot.error());
    (*robot)->run = run;
    (*robot)->incarnation = std::strtoull(texts[key_of(hello.name, "incarnation")].c_str(), nullptr, 10);
    (*robot)->done = texts[key_of(hello.name, "state")] == kDone;
    log_.info(fmt::format("{}: {} keyframes are here from before", hello.name, (*robot)->copy().keyframes()));
    if ((*robot)->copy().keyframes() > 0) meetings_.committed(hello.name);
  }
  return {};
}

core::Result<HubRobot*> HubDesk::add(const Hello& hello) {
  auto robot = HubRobot::open(hello.name, folder_ / "robots" / hello.name / "map.db", request_.quota_bytes);
  if (!robot) return tl::unexpected<core::Error>(robot.error());
  if (auto listened = bus_->listen_to(hello.name); !listened)
    return tl::unexpected<core::Error>(listened.error());
  return &robots_.insert_or_assign(hello.name, std::move(*robot)).first->second;
}

core::Result<void> HubDesk::remember(const HubRobot& robot) const {
  return ledger_.put({{key_of(robot.name, "run"), robot.run},
                      {key_of(robot.name, "incarnation"), std::to_string(robot.incarnation)},
                      {key_of(robot.name, "state"), robot.done ? kDone : "going on"}});
}

core::Result<void> HubDesk::look_for_others(const core::StopToken& stop) {
  const auto until = Clock::now() + kLookForOthers;
  while (Clock::now() < until && !stop.stop_requested()) {
    if (Clock::now() - said_at_ >= kSayAgain) {
      say({});
      said_at_ = Clock::now();
    }
    bus_->wait(kWait);
    for (const Word& word : bus_->hear_hubs()) {
      const bool first = word.up_s >= 0.0 || word.hub < id_;  // of two that begin together one stays
      if (word.hub == id_ || !first) continue;
      return core::usage_error(fmt::format(
          "another hub is there in domain {}; end that one, or choose another --domain for this one "
          "and its robots",
          request_.network.domain));
    }
  }
  serving_ = true;
  began_ = Clock::now();
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
  if (known->second.run != hello.run) {
    return fmt::format(
        "{}: the hub has another run of that name; give this one another --name, or begin the hub without "
        "--resume "
        "in another folder",
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
  say(word);
}

void HubDesk::let_in(const Hello& hello) {
  auto known = robots_.find(hello.name);
  const bool is_new = known == robots_.end();
  const auto fail = [&](const core::Error& error) { report_once(hello.name + ": " + error.message); };
  if (is_new) {
    const auto added = add(hello);
    if (!added) return fail(added.error());
    known = robots_.find(hello.name);
  }
  HubRobot& robot = known->second;
  if (hello.incarnation < robot.incarnation) return;  // of a process that is gone
  const bool takes_over = hello.incarnation > robot.incarnation;
  if (takes_over) {
    robot.answer = Answer::kAccepted;
    robot.problem.clear();
  }
  const auto rewound = robot.hear(hello);
  if (!rewound) return fail(rewound.error());
  if (*rewound) {
    log_.warning(robot.name + ": has lost what was here; everything is asked for again");
    meetings_.restart();
  }
  if (is_new || takes_over || *rewound) {
    if (auto put = remember(robot); !put) return fail(put.error());
    log_.info(fmt::format("{}: {} of its keyframes are here", robot.name, robot.copy().keyframes()));
    robot.changed = true;
  }
  if (robot.done != (robot.done && robot.has_all())) robot.done = false;
  close(robot);
}

/// Remembered before it is said: a robot that was told may leave for ever.
void HubDesk::close(HubRobot& robot) {
  if (!robot.has_all() || robot.answer == Answer::kRefused) return;
  if (!robot.done) {
    robot.done = true;
    if (auto put = remember(robot); !put) {
      robot.done = false;
      return report_once(robot.name + ": " + put.error().message);
    }
    log_.info(fmt::format("{}: everything is here, {} keyframes{}", robot.name, robot.copy().keyframes(),
                          robot.copy().complete() ? "" : "; its run did not come to its end"));
  }
  robot.answer = Answer::kDone;
  robot.changed = true;
}

void HubDesk::take_pieces(HubRobot& robot) {
  for (const Piece& piece : bus_->take(robot.name, kPiecesAtATime)) {
    const bool other = piece.protocol != kProtocol || piece.name != robot.name || piece.run != robot.run ||
                       piece.incarnation != robot.incarnation;
    if (other || robot.answer == Answer::kRefused || Clock::now() < trouble_[robot.name]) continue;
    const std::int64_t before = robot.copy().heads().map;
    const auto taken = robot.take(piece);
    if (taken) {
      if (robot.copy().heads().map > before) meetings_.committed(robot.name);
      if (robot.answer == Answer::kTrouble) robot.answer = Answer::kAccepted;
      if (robot.answer == Answer::kAccepted) robot.problem.clear();
      close(robot);
      continue;
    }
    const bool here = taken.error().kind == core::ErrorKind::kOutput;
    robot.answer = here ? Answer::kTrouble : Answer::kRefused;
    robot.problem =
        here ? fmt::format("{} cannot be stored at the hub: {}", robot.name, taken.error().message)
             : fmt::format(
                   "{} sent what no map of Plumbline {} holds ({}): check both ends for the same version, "
                   "then begin it again with --resume",
                   robot.name, core::version(), taken.error().message);
    log_.error(robot.problem);
    robot.changed = true;
    if (here) trouble_[robot.name] = Clock::now() + kTroubleLasts;
  }
}

void HubDesk::say(Word word) {
  word.store_format = maps::kStoreFormat;
  word.program = core::version();
  word.hub = id_;
  word.up_s = serving_ ? std::chrono::duration<double>(Clock::now() - began_).count() : -1.0;
  bus_->say(word);
}

void HubDesk::say_all() {
  const bool again = Clock::now() - said_at_ >= kSayAgain;
  if (again) {
    say({});
    said_at_ = Clock::now();
  }
  for (auto& [name, robot] : robots_) {
    if (robot.run.empty() || !(again || robot.changed)) continue;
    // A robot whose pieces could not be stored is asked for them again.
    Word word = robot.word();
    word.place = meetings_.place(name);
    if (word.answer == Answer::kTrouble && Clock::now() >= trouble_[name]) word.answer = Answer::kAccepted;
    say(word);
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
    silent += robot.silent() && !robot.done ? 1U : 0U;
    const std::int64_t lacks =
        std::max(robot.hello.map_head, robot.hello.clouds_head) - robot.copy().heads().last();
    behind += std::max<std::int64_t>(0, lacks);
  }
  const std::string of = request_.robots > 0 ? fmt::format(" of {}", request_.robots) : "";
  return fmt::format("{}{} robots ({} done{}), {} keyframes, {:.0f} kB/s, behind by {}", robots_.size(), of,
                     done(), silent > 0 ? fmt::format(", {} silent", silent) : "", keyframes, kbytes_per_s,
                     behind);
}

std::vector<RobotTraffic> HubDesk::serve(const core::StopToken& stop, const Status& status) {
  auto line_at = Clock::now();
  std::uint64_t before = received();
  while (!stop.stop_requested()) {
    bus_->wait(kWait);
    for (const HeardHello& heard : bus_->hear()) hear(heard);
    for (const Word& word : bus_->hear_hubs()) {
      if (word.hub != id_ && word.up_s >= 0.0)
        report_once("another hub is there; robots stay with whom they found first");
    }
    for (auto& [name, robot] : robots_) {
      take_pieces(robot);
      const bool silent = robot.silent() && !robot.done;
      if (std::exchange(robot.silence_reported, silent) != silent)
        log_.info(fmt::format("{}: {}", name, silent ? "is not heard any more" : "is heard"));
    }
    if (meetings_.step()) {
      for (auto& [name, robot] : robots_) robot.changed = true;
    }
    say_all();
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
  std::vector<RobotTraffic> traffic;
  for (const auto& [name, robot] : robots_) {
    traffic.push_back(robot.traffic());
    if (!robot.done) continue;
    last_words_.push_back(robot.word());
    last_words_.back().place = meetings_.place(name);
  }
  robots_.clear();
  return traffic;
}

void HubDesk::say_goodbye(const core::StopToken& stop) {
  for (int i = 0; i < 10 || !stop.stop_requested(); ++i) {
    for (const Word& word : last_words_) say(word);
    bus_->hear();
    std::this_thread::sleep_for(stop.stop_requested() ? kWait : kSayAgain / 2);
  }
}

std::size_t HubDesk::done() const {
  return static_cast<std::size_t>(
      std::count_if(robots_.begin(), robots_.end(), [](const auto& entry) { return entry.second.done; }));
}

}  // namespace plumbline::net
