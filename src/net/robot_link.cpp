// SPDX-License-Identifier: BSD-3-Clause
#include "robot_link.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

#include "plumbline/core/version.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr auto kSayEvery = 500ms;
constexpr auto kLookEvery = 50ms;
constexpr auto kPause = 10ms;    // whoever speaks without one: the tracker's time is not theirs
constexpr auto kHubGone = 5s;    // without a word
constexpr auto kOtherHub = 10s;  // until another hub is listened to
constexpr auto kSilence = 10s;   // until silence is told
constexpr std::size_t kMostBegan = 64;

std::vector<std::uint64_t> numbers_of(const std::string& text) {
  std::istringstream words(text);
  return {std::istream_iterator<std::uint64_t>(words), std::istream_iterator<std::uint64_t>()};
}

Hello hello_of(std::string name, std::string run) {
  Hello hello;
  hello.name = std::move(name);
  hello.run = std::move(run);
  hello.program = core::version();
  hello.store_format = maps::kStoreFormat;
  return hello;
}

}  // namespace

void HeardHub::report_silence(RobotBus& bus) {
  if (silence_reported_ || status_.heard || Clock::now() - began_ < kSilence) return;
  silence_reported_ = true;
  log_.warning(bus.others() > 0
                   ? "no answer in 10 s; a participant is there: is it no hub, are keys missing or foreign?"
                   : "no answer in 10 s; is the hub started, in the same domain, and reachable?");
}

LinkStatus HeardHub::status() const {
  LinkStatus status = status_;
  status.hub_now = status.heard && Clock::now() - heard_at_ < kHubGone;
  return status;
}

bool HeardHub::accepts() const {
  const bool accepted = word_.answer == Answer::kAccepted || word_.answer == Answer::kDone;
  return accepted && status().hub_now && status_.refused.empty();
}

bool HeardHub::take(const Word& word, const Hello& hello) {
  if (word.protocol == kProtocol && word.up_s < 0.0) return false;  // it is not serving yet
  status_.heard = true;
  if (word.protocol != kProtocol || word.store_format != hello.store_format) {
    status_.refused = fmt::format("the hub is of Plumbline {}, this robot of {}: use the same on both",
                                  word.program, hello.program);
    return false;
  }
  const bool another = hub_ != word.hub;
  if (another) {
    if (!hub_.empty() && Clock::now() - heard_at_ < kOtherHub) {
      if (!std::exchange(foreign_reported_, true))
        log_.warning("another hub is there; it is not listened to");
      return false;
    }
    log_.info("hub found");
    hub_ = word.hub;
    word_ = {};
  }
  heard_at_ = Clock::now();
  if (word.robot != hello.name || word.run != hello.run || hello.incarnation == 0) return another;
  // A hub that is about to leave tells what the process before this one brought; nothing came since.
  const bool all = word.answer == Answer::kDone && hello.over && word.map == hello.map_head &&
                   word.clouds == hello.clouds_head &&
                   hello.began.back() == static_cast<std::uint64_t>(std::max(word.map, word.clouds));
  if (all) status_.done = true;
  if (word.incarnation == hello.incarnation) take_answer(word, hello.over);
  return another;
}

void HeardHub::take_answer(const Word& word, bool over) {
  status_.problem = word.answer == Answer::kTrouble ? word.problem : "";
  if (!word.problem.empty() && word.problem != word_.problem) log_.warning("hub: " + word.problem);
  if (word.answer == Answer::kRefused) {
    status_.refused = word.problem;
    word_.problem = word.problem;
    return;
  }
  if (word.answer == Answer::kDone) status_.done = over;
  const bool moved = word.map != word_.map || word.clouds != word_.clouds || word.pieces != word_.pieces;
  if (moved) status_.progress = Clock::now();
  note_place(word.place, word.robot);
  word_ = word;
}

/// Told when the frame is another one; where in it is kept up in the status.
void HeardHub::note_place(const Place& place, const std::string& name) {
  status_.place.clear();
  const bool changed = word_.place.frame_of != place.frame_of;
  if (place.frame_of.empty() || !is_robot_name(place.frame_of)) {
    if (changed) log_.warning("hub: what was met is taken back; this map is in a frame of its own again");
    return;
  }
  const auto sigma = [&](std::size_t x, std::size_t y, std::size_t z) {
    return std::sqrt(std::max(0.0, place.covariance[x] + place.covariance[y] + place.covariance[z]));
  };
  constexpr double kDegrees = 180.0 / 3.14159265358979323846;
  const std::array<double, 7>& at = place.frame_from_camera;
  status_.place = fmt::format("in {} at {:.2f} {:.2f} {:.2f} m (known to {:.0f} mm, {:.1f} deg)",
                              place.frame_of == name ? "its own frame" : place.frame_of + "'s frame", at[0],
                              at[1], at[2], 1e3 * sigma(0, 6, 11), kDegrees * sigma(15, 18, 20));
  if (changed) log_.info("hub: others are met; now " + status_.place);
}

RobotLink::RobotLink(std::unique_ptr<RobotBus> bus, std::string name, std::string fresh,
                     std::shared_ptr<mapping::OtherMapsInbox> feedback, core::Log& log)
    : bus_(std::move(bus)),
      hello_(hello_of(std::move(name), std::move(fresh))),
      outbox_(*bus_),
      hub_(log),
      others_(feedback == nullptr ? std::nullopt
                                  : std::optional<OtherRobots>(std::in_place, hello_.name, feedback)),
      thread_([this](const core::StopToken& stop) { run(stop); }) {}

core::Result<void> RobotLink::follow(const fs::path& store) {
  const maps::Ledger ledger(store.parent_path() / "network.db");
  auto known = ledger.all();
  if (!known) return tl::unexpected(known.error());
  std::error_code ignored;
  const auto heads = fs::exists(store, ignored) ? maps::store_heads(store) : maps::StoreHeads();
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool anew = following() && known->empty();  // the next incarnation of this run, with an empty store
  Hello next = hello_;
  std::map<std::string, std::string>& texts = *known;
  if (!texts["run"].empty()) next.run = texts["run"];
  if (!anew) next.began = numbers_of(texts["began"]);
  next.began.push_back(heads ? static_cast<std::uint64_t>(heads->last()) : 0);
  const std::vector<std::uint64_t> incarnation = numbers_of(texts["incarnation"]);
  if (!anew) next.incarnation = incarnation.empty() ? 0 : incarnation.front();
  ++next.incarnation;
  if (next.began.size() > kMostBegan) next.began.erase(next.began.begin());
  const auto put = ledger.put({{"run", next.run},
                               {"name", next.name},
                               {"began", fmt::format("{}", fmt::join(next.began, " "))},
                               {"incarnation", std::to_string(next.incarnation)}});
  if (!put) return put;
  next.map_head = next.clouds_head = 0;
  hello_ = std::move(next);
  store_.follow(store);
  hub_.forget();
  outbox_.forget();
  return {};
}

void RobotLink::over(const fs::path& store) {
  const std::lock_guard<std::mutex> lock(mutex_);
  store_.moved(store);
  hello_.over = true;
}

void RobotLink::run(const core::StopToken& stop) {
  while (!stop.stop_requested()) {
    std::this_thread::sleep_for(kPause);
    bus_->wait(kLookEvery);
    const std::vector<Word> words = bus_->hear();
    talk(words);
    if (others_) hear_of_others(words);
  }
}

void RobotLink::talk(const std::vector<Word>& words) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const Word& word : words) {
    if (hub_.take(word, hello_)) outbox_.forget();
  }
  if (following()) {
    look();
    if (hub_.accepts()) outbox_.send(hello_, store_, hub_.word(), hub_.heard_at());
    if (Clock::now() - said_at_ >= kSayEvery) say();
  }
  hub_.report_silence(*bus_);
  publish();
}

void RobotLink::hear_of_others(const std::vector<Word>& words) {
  for (const Word& word : words) others_->take(word);
  for (const Piece& piece : bus_->hear_of_others()) others_->take(piece);
  others_->publish();
}

void RobotLink::look() {
  const StoreWatch::Seen seen = store_.look();
  if (seen == StoreWatch::Seen::kNothingNew) return;
  if (seen == StoreWatch::Seen::kBegunAnew) outbox_.forget();
  hello_.map_head = store_.heads().map;
  hello_.clouds_head = store_.heads().clouds;
  said_at_ = {};
}

void RobotLink::say() {
  hello_.lag_median_s = store_.lag_s(0.5);
  hello_.lag_p95_s = store_.lag_s(0.95);
  bus_->say(hello_);
  said_at_ = Clock::now();
}

void RobotLink::publish() {
  auto status = std::make_shared<LinkStatus>(hub_.status());
  status->behind = store_.behind({hub_.word().map, hub_.word().clouds});
  status->sent_bytes = outbox_.sent_bytes();
  status->again_bytes = outbox_.again_bytes();
  std::atomic_store(&status_, std::shared_ptr<const LinkStatus>(std::move(status)));
}

}  // namespace plumbline::net
