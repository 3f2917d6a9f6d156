// SPDX-License-Identifier: BSD-3-Clause
#include "hub_robot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <system_error>
#include <utility>

#include "plumbline/core/output_file.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;

constexpr auto kSilent = 3s;
constexpr std::uint32_t kMostPieces = 1U << 20U;

tl::unexpected<core::Error> refuse(const char* why) { return core::input_error(why); }

}  // namespace

void Presence::note() {
  if (heard_at_) longest_break_s_ = std::max(longest_break_s_, silent_s());
  heard_at_ = Clock::now();
}

double Presence::silent_s() const {
  return heard_at_ ? std::chrono::duration<double>(Clock::now() - *heard_at_).count() : 0.0;
}

bool Presence::silent() const { return !heard_at_ || Clock::now() - *heard_at_ > kSilent; }

core::Result<HubRobot> HubRobot::open(Hello known, const std::filesystem::path& file,
                                      std::uint64_t quota_bytes) {
  if (auto made = core::make_folder(file.parent_path()); !made) return tl::unexpected(made.error());
  auto copy = maps::StoreReplica::open(file);
  if (!copy) return tl::unexpected(copy.error());
  HubRobot robot;
  robot.hello = std::move(known);
  robot.file_ = file;
  robot.quota_bytes_ = quota_bytes;
  robot.copy_.emplace(std::move(*copy));
  return robot;
}

/// Transactions above the result may be of a process that was ended with the power cut: the robot has others
/// by these numbers now.
std::int64_t HubRobot::lost_below(const Hello& next) const {
  if (next.incarnation <= hello.incarnation) return std::numeric_limits<std::int64_t>::max();
  const std::uint64_t since = next.incarnation - hello.incarnation;
  if (since > next.began.size()) return 0;
  return static_cast<std::int64_t>(
      *std::min_element(next.began.end() - static_cast<std::ptrdiff_t>(since), next.began.end()));
}

core::Result<bool> HubRobot::hear(const Hello& next) {
  presence.note();
  const maps::StoreHeads& heads = copy_->heads();
  // A store that is just being opened tells no heads yet.
  const bool tells = next.map_head > 0 || next.clouds_head > 0;
  const bool lost = heads.last() > lost_below(next) ||
                    (tells && (heads.map > next.map_head || heads.clouds > next.clouds_head));
  if (next.incarnation > hello.incarnation) forget();
  hello = next;
  if (!lost) return false;
  forget();
  if (auto cleared = copy_->clear(); !cleared) return tl::unexpected(cleared.error());
  done = false;
  return true;
}

bool HubRobot::has_all() const {
  return hello.over && copy_->heads().map == hello.map_head && copy_->heads().clouds == hello.clouds_head &&
         hello.map_head > 0;
}

void HubRobot::forget() {
  copy_->forget();
  coming_ = {};
  changed = true;
}

core::Result<void> HubRobot::begin(const Piece& piece) {
  std::error_code ignored;
  const std::uintmax_t size = std::filesystem::file_size(file_, ignored);
  if (size != static_cast<std::uintmax_t>(-1) && size > quota_bytes_) {
    return core::output_error(
        fmt::format("{}: its map takes {} MB at the hub, more than the {} MB it may have; begin the hub with "
                    "a larger --quota",
                    hello.name, size / 1000000, quota_bytes_ / 1000000));
  }
  forget();
  if (auto begun = copy_->begin(static_cast<maps::StoreShare>(piece.share), piece.number); !begun)
    return begun;
  coming_.number = piece.number;
  coming_.edition = piece.edition;
  return {};
}

core::Result<void> HubRobot::take(const Piece& piece) {
  counted_.received_bytes += piece.bytes.size();
  if (piece.share > 1) return refuse("a share that is not known");
  const auto share = static_cast<maps::StoreShare>(piece.share);
  if (piece.count == 0 || piece.count > kMostPieces || piece.index >= piece.count || piece.number <= 0) {
    return refuse("numbers that cannot be");
  }
  const bool old = piece.number <= copy_->heads()[share];
  const bool same = piece.number == coming_.number && piece.edition == coming_.edition;
  if (old || (same && piece.index < coming_.pieces)) {
    counted_.again_bytes += piece.bytes.size();
    changed = true;
    return {};
  }
  if (piece.after != copy_->heads()[share]) return {};  // something before it was lost: the word tells
  if (!same) {
    if (piece.index != 0) return {};
    if (auto begun = begin(piece); !begun) return begun;
  }
  if (piece.index != coming_.pieces) return {};
  core::Hash hash;
  hash.bytes(piece.bytes.data(), piece.bytes.size());
  coming_.all.bytes(piece.bytes.data(), piece.bytes.size());
  const bool last = piece.index + 1 == piece.count;
  if (hash.value() != piece.hash || (last && coming_.all.value() != coming_.edition)) {
    forget();
    return refuse("bytes were changed on the way");
  }
  core::Result<void> taken = copy_->take(piece.bytes.data(), piece.bytes.size());
  if (taken && last) taken = copy_->commit();
  if (!taken) {
    forget();
    return taken;
  }
  ++coming_.pieces;
  if (last) forget();
  changed = true;
  return {};
}

Word HubRobot::word() const {
  Word word;
  word.robot = hello.name;
  word.run = hello.run;
  word.incarnation = hello.incarnation;
  word.answer = verdict.answer;
  // A robot whose pieces could not be stored is asked for them again.
  if (word.answer == Answer::kTrouble && Clock::now() >= verdict.until) word.answer = Answer::kAccepted;
  word.problem = verdict.problem;
  word.map = copy_->heads().map;
  word.clouds = copy_->heads().clouds;
  word.number = coming_.number;
  word.edition = coming_.edition;
  word.pieces = coming_.pieces;
  return word;
}

RobotTraffic HubRobot::traffic() const {
  RobotTraffic t = counted_;
  t.name = hello.name;
  t.keyframes = copy_->keyframes();
  t.complete = copy_->complete();
  t.done = done;
  t.place_bytes = copy_->bytes().place;
  t.map_bytes = copy_->bytes().map;
  t.cloud_bytes = copy_->bytes().cloud;
  t.longest_break_s =
      done ? presence.longest_break_s() : std::max(presence.longest_break_s(), presence.silent_s());
  t.lag_median_s = hello.lag_median_s;
  t.lag_p95_s = hello.lag_p95_s;
  return t;
}

}  // namespace plumbline::net
