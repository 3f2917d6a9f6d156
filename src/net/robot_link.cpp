// SPDX-License-Identifier: BSD-3-Clause
#include "robot_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <system_error>
#include <utility>

#include "plumbline/core/hash.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr std::size_t kPieceBytes = 256U << 10U;  // what a bad link carries in a few seconds
constexpr auto kSayEvery = 500ms;
constexpr auto kLookEvery = 50ms;
constexpr auto kPause = 10ms;    // whoever speaks without one: the tracker's time is not theirs
constexpr auto kHubGone = 5s;    // without a word
constexpr auto kOtherHub = 10s;  // until another hub is listened to
constexpr auto kSilence = 10s;   // until silence is told
constexpr int kAtATime = 4;      // pieces before the hub is heard again
/// What was sent, arrived and is not in the hub's words for so long was lost with a link or a process.
constexpr auto kLost = 1600ms;
constexpr auto kFreshWord = 1100ms;
constexpr std::size_t kMostBegan = 64;
constexpr std::size_t kMostLags = 10000;

std::uint64_t hash_of(const std::uint8_t* bytes, std::size_t size) {
  core::Hash hash;
  hash.bytes(bytes, size);
  return hash.value();
}

std::vector<std::uint64_t> numbers_of(const std::string& text) {
  std::istringstream words(text);
  std::vector<std::uint64_t> numbers;
  for (std::uint64_t number = 0; words >> number;) numbers.push_back(number);
  return numbers;
}

std::string text_of(const std::vector<std::uint64_t>& numbers) {
  std::string text;
  for (const std::uint64_t number : numbers) text += fmt::format("{}{}", text.empty() ? "" : " ", number);
  return text;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

}  // namespace

RobotLink::RobotLink(std::unique_ptr<RobotBus> bus, std::string name, std::string fresh, core::Log& log)
    : bus_(std::move(bus)), name_(std::move(name)), fresh_(std::move(fresh)), log_(log) {
  hello_.name = name_;
  hello_.program = core::version();
  hello_.store_format = maps::kStoreFormat;
  status_.progress = began_;
  published_ = status_;
  thread_ = std::thread([this] { run(); });
}

RobotLink::~RobotLink() {
  stop_ = true;
  thread_.join();
}

core::Result<void> RobotLink::follow(const fs::path& store) {
  const maps::Ledger ledger(store.parent_path() / "network.db");
  const auto known = ledger.all();
  if (!known) return tl::unexpected<core::Error>(known.error());
  const auto text = [&](const char* name) {
    const auto found =
        std::find_if(known->begin(), known->end(), [&](const auto& entry) { return entry.first == name; });
    return found == known->end() ? std::string() : found->second;
  };
  std::error_code ignored;
  const auto heads = fs::exists(store, ignored) ? maps::store_heads(store) : maps::StoreHeads();
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool anew = following_ && known->empty();  // the next incarnation of this run, with an empty store
  hello_.run = text("run").empty() ? fresh_ : text("run");
  if (!anew) hello_.began = numbers_of(text("began"));
  hello_.began.push_back(heads ? static_cast<std::uint64_t>(heads->last()) : 0);
  const std::vector<std::uint64_t> incarnation = numbers_of(text("incarnation"));
  if (!anew) hello_.incarnation = incarnation.empty() ? 0 : incarnation.front();
  ++hello_.incarnation;
  if (hello_.began.size() > kMostBegan) hello_.began.erase(hello_.began.begin());
  const auto put = ledger.put({{"run", hello_.run},
                               {"name", name_},
                               {"began", text_of(hello_.began)},
                               {"incarnation", std::to_string(hello_.incarnation)}});
  if (!put) return put;
  store_ = store;
  store_size_ = 0;
  following_ = true;
  hello_.map_head = hello_.clouds_head = 0;
  word_ = {};
  sending_.reset();
  noticed_.clear();
  return {};
}

void RobotLink::over(const fs::path& store) {
  const std::lock_guard<std::mutex> lock(mutex_);
  store_ = store;
  store_size_ = 0;
  hello_.over = true;
}

LinkStatus RobotLink::status() const {
  const std::lock_guard<std::mutex> lock(published_mutex_);
  return published_;
}

void RobotLink::run() {
  auto looked_at = Clock::time_point();
  while (!stop_) {
    std::this_thread::sleep_for(kPause);
    bus_->wait(kLookEvery);
    for (const Word& word : bus_->hear()) take(word);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (following_ && Clock::now() - looked_at >= kLookEvery) {
      look_at_store();
      looked_at = Clock::now();
    }
    status_.hub_now = status_.heard && Clock::now() - heard_at_ < kHubGone;
    if (following_) {
      send();
      if (hello_changed_ || Clock::now() - said_at_ >= kSayEvery) say();
    }
    report_silence();
    const std::lock_guard<std::mutex> publish(published_mutex_);
    published_ = status_;
  }
}

void RobotLink::say() {
  hello_.lag_median_s = quantile(lags_s_, 0.5);
  hello_.lag_p95_s = quantile(lags_s_, 0.95);
  bus_->say(hello_);
  said_at_ = Clock::now();
  hello_changed_ = false;
}

/// At the latest now somebody should know that nobody answers.
void RobotLink::report_silence() {
  if (silence_reported_ || status_.heard || Clock::now() - began_ < kSilence) return;
  silence_reported_ = true;
  log_.warning(bus_->others() > 0
                   ? "no answer in 10 s; a participant is there: is it no hub, are keys missing or foreign?"
                   : "no answer in 10 s; is the hub started, in the same domain, and reachable?");
}

void RobotLink::take(const Word& word) {
  if (word.protocol == kProtocol && word.up_s < 0.0) return;  // it is not serving yet
  const std::lock_guard<std::mutex> lock(mutex_);
  status_.heard = true;
  if (word.protocol != kProtocol || word.store_format != hello_.store_format) {
    status_.refused = fmt::format("the hub is of Plumbline {}, this robot of {}: use the same on both",
                                  word.program, hello_.program);
    return;
  }
  if (hub_ != word.hub) {
    if (!hub_.empty() && Clock::now() - heard_at_ < kOtherHub) {
      if (!std::exchange(foreign_reported_, true))
        log_.warning("another hub is there; it is not listened to");
      return;
    }
    log_.info("hub found");
    hub_ = word.hub;
    word_ = {};
    sending_.reset();
  }
  heard_at_ = Clock::now();
  if (word.robot != name_ || word.run != hello_.run || !following_) return;
  // A hub that is about to leave tells what the process before this one brought; nothing came since.
  const bool all = word.answer == Answer::kDone && hello_.over && word.map == hello_.map_head &&
                   word.clouds == hello_.clouds_head &&
                   hello_.began.back() == static_cast<std::uint64_t>(std::max(word.map, word.clouds));
  if (all) status_.done = true;
  if (word.incarnation == hello_.incarnation) {
    take_answer(word);
  }
}

void RobotLink::take_answer(const Word& word) {
  status_.problem = word.answer == Answer::kTrouble ? word.problem : "";
  if (!word.problem.empty() && word.problem != problem_reported_) log_.warning("hub: " + word.problem);
  problem_reported_ = word.problem;
  if (word.answer == Answer::kRefused) {
    status_.refused = word.problem;
    return;
  }
  if (word.answer == Answer::kDone) status_.done = hello_.over;
  const bool moved = word.map != word_.map || word.clouds != word_.clouds || word.pieces != word_.pieces;
  if (moved) status_.progress = Clock::now();
  word_ = word;
  note_place(word.place);
  note_lags();
}

/// Told when the frame is another one; where in it is kept up in the status.
void RobotLink::note_place(const Place& place) {
  status_.place.clear();
  const bool changed = std::exchange(frame_of_, place.frame_of) != place.frame_of;
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
                              place.frame_of == name_ ? "its own frame" : place.frame_of + "'s frame", at[0],
                              at[1], at[2], 1e3 * sigma(0, 6, 11), kDegrees * sigma(15, 18, 20));
  if (changed) log_.info("hub: others are met; now " + status_.place);
}

void RobotLink::note_lags() {
  while (!noticed_.empty()) {
    const auto& [heads, since] = noticed_.front();
    if (word_.map < heads.map || word_.clouds < heads.clouds) break;
    if (lags_s_.size() < kMostLags) {
      lags_s_.push_back(std::chrono::duration<double>(Clock::now() - since).count());
    }
    noticed_.pop_front();
  }
  status_.behind = noticed_.empty() ? 0 : noticed_.back().first.last() - std::max(word_.map, word_.clouds);
  if (!noticed_.empty()) status_.behind = std::max<std::int64_t>(status_.behind, 1);
}

/// Only when the file or its log changed: the heads are looked for in all tables.
void RobotLink::look_at_store() {
  std::error_code ignored;
  const fs::path log = store_.string() + "-wal";
  const bool has_log = fs::exists(log, ignored);
  const fs::path& written = has_log ? log : store_;
  if (!fs::exists(written, ignored)) return;
  const auto time = fs::last_write_time(written, ignored);
  const auto size = fs::file_size(written, ignored);
  if (time == store_time_ && size == store_size_) return;
  const auto heads = maps::store_heads(store_);
  if (!heads) return;  // it is just being made, or its folder just got its name
  store_time_ = time;
  store_size_ = size;
  if (heads->map == hello_.map_head && heads->clouds == hello_.clouds_head) return;
  if (heads->map < hello_.map_head || heads->clouds < hello_.clouds_head) {
    log_.debug("the store was begun anew");
    sending_.reset();
    noticed_.clear();
  }
  hello_.map_head = heads->map;
  hello_.clouds_head = heads->clouds;
  hello_changed_ = true;
  noticed_.emplace_back(*heads, Clock::now());
  note_lags();
}

/// The first transaction that the hub lacks; what is no cloud goes first.
void RobotLink::choose() {
  for (const maps::StoreShare share : maps::kStoreShares) {
    const bool map = share == maps::StoreShare::kMap;
    const std::int64_t after = map ? word_.map : word_.clouds;
    if ((map ? hello_.map_head : hello_.clouds_head) <= after) continue;
    auto next = maps::next_transaction(store_, share, after);
    if (!next || !*next) continue;
    Sending sending;
    sending.share = share;
    sending.after = after;
    sending.transaction = std::move(**next);
    const std::vector<std::uint8_t>& rows = sending.transaction.rows;
    sending.edition = hash_of(rows.data(), rows.size());
    sending.count = static_cast<std::uint32_t>((rows.size() + kPieceBytes - 1) / kPieceBytes);
    if (word_.number == sending.transaction.number && word_.edition == sending.edition) {
      sending.index = word_.pieces;
    }
    sending_ = std::move(sending);
    return;
  }
}

Piece RobotLink::piece(std::uint32_t index) const {
  Piece piece;
  piece.name = name_;
  piece.run = hello_.run;
  piece.incarnation = hello_.incarnation;
  piece.share = static_cast<std::uint8_t>(sending_->share);
  piece.after = sending_->after;
  piece.number = sending_->transaction.number;
  piece.edition = sending_->edition;
  piece.index = index;
  piece.count = sending_->count;
  const std::vector<std::uint8_t>& rows = sending_->transaction.rows;
  const std::size_t begin = std::min(rows.size(), index * kPieceBytes);
  const std::size_t size = std::min(kPieceBytes, rows.size() - begin);
  piece.bytes.assign(rows.data() + begin, rows.data() + begin + size);
  piece.hash = hash_of(piece.bytes.data(), piece.bytes.size());
  return piece;
}

void RobotLink::send() {
  const bool accepted = word_.answer == Answer::kAccepted || word_.answer == Answer::kDone;
  if (!accepted || !status_.hub_now || !status_.refused.empty()) return;
  const bool listened = bus_->listened_to();
  if (listened && !listened_ && sending_)
    sending_.reset();  // read again: what the hub lacks may be less by now
  listened_ = listened;
  if (!listened) return;
  if (sending_ && (sending_->share == maps::StoreShare::kMap ? word_.map : word_.clouds) >=
                      sending_->transaction.number) {
    sending_.reset();
  }
  if (!sending_) choose();
  if (!sending_) return;
  for (int i = 0; i < kAtATime && sending_->index < sending_->count; ++i) {
    const Piece next = piece(sending_->index);
    if (!bus_->send(next)) return;
    status_.sent_bytes += next.bytes.size();
    if (sending_->index < sending_->most) status_.again_bytes += next.bytes.size();
    sending_->most = std::max(sending_->most, ++sending_->index);
    sending_->settled.reset();
  }
  if (sending_->index == sending_->count) send_again();
}

/// What arrived and is not acknowledged was lost with a link or a process.
void RobotLink::send_again() {
  if (!bus_->all_received()) {
    sending_->settled.reset();
    return;
  }
  if (!sending_->settled) sending_->settled = Clock::now();
  if (Clock::now() - *sending_->settled < kLost || heard_at_ - *sending_->settled < kFreshWord) return;
  const bool same = word_.number == sending_->transaction.number && word_.edition == sending_->edition;
  sending_->index = same ? std::min(word_.pieces, sending_->count) : 0;
  sending_->settled.reset();
}

}  // namespace plumbline::net
