// SPDX-License-Identifier: BSD-3-Clause
#include "outbox.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

#include "plumbline/core/hash.hpp"
#include "plumbline/core/numbers.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr std::size_t kPieceBytes = 256U << 10U;  // what a bad link carries in a few seconds
constexpr int kAtATime = 4;                       // pieces before the hub is heard again
/// What was sent, arrived and is not in the hub's words for so long was lost with a link or a process.
constexpr auto kLost = 1600ms;
constexpr auto kFreshWord = 1100ms;

std::uint64_t hash_of(const std::uint8_t* bytes, std::size_t size) {
  core::Hash hash;
  hash.bytes(bytes, size);
  return hash.value();
}

std::int64_t held(const Word& word, maps::StoreShare share) {
  return share == maps::StoreShare::kMap ? word.map : word.clouds;
}

}  // namespace

void StoreWatch::moved(fs::path store) {
  store_ = std::move(store);
  size_ = 0;
}

/// Only when the file or its log changed: the heads are looked for in all tables.
StoreWatch::Seen StoreWatch::look() {
  std::error_code ignored;
  const fs::path log = store_.string() + "-wal";
  const bool has_log = fs::exists(log, ignored);
  const fs::path& written = has_log ? log : store_;
  if (!fs::exists(written, ignored)) return Seen::kNothingNew;
  const auto time = fs::last_write_time(written, ignored);
  const auto size = fs::file_size(written, ignored);
  if (time == time_ && size == size_) return Seen::kNothingNew;
  const auto heads = maps::store_heads(store_);
  if (!heads) return Seen::kNothingNew;  // it is just being made, or its folder just got its name
  time_ = time;
  size_ = size;
  if (heads->map == heads_.map && heads->clouds == heads_.clouds) return Seen::kNothingNew;
  const bool anew = heads->map < heads_.map || heads->clouds < heads_.clouds;
  if (anew) noticed_.clear();
  heads_ = *heads;
  noticed_.emplace_back(*heads, Clock::now());
  return anew ? Seen::kBegunAnew : Seen::kGrown;
}

std::int64_t StoreWatch::behind(const maps::StoreHeads& held) {
  constexpr std::size_t kMostLags = 10000;
  while (!noticed_.empty()) {
    const auto& [heads, since] = noticed_.front();
    if (held.map < heads.map || held.clouds < heads.clouds) break;
    if (lags_s_.size() < kMostLags) {
      lags_s_.push_back(std::chrono::duration<double>(Clock::now() - since).count());
    }
    noticed_.pop_front();
  }
  return noticed_.empty() ? 0 : std::max<std::int64_t>(1, noticed_.back().first.last() - held.last());
}

double StoreWatch::lag_s(double quantile) const { return core::quantile(lags_s_, quantile, 0.0); }

Parcel::Parcel(maps::StoreShare share, std::int64_t after, maps::StoreTransaction transaction)
    : share_(share),
      after_(after),
      transaction_(std::move(transaction)),
      edition_(hash_of(transaction_.rows.data(), transaction_.rows.size())),
      count_(static_cast<std::uint32_t>((transaction_.rows.size() + kPieceBytes - 1) / kPieceBytes)) {}

Piece Parcel::piece(std::uint32_t index) const {
  Piece piece;
  piece.share = static_cast<std::uint8_t>(share_);
  piece.after = after_;
  piece.number = transaction_.number;
  piece.edition = edition_;
  piece.index = index;
  piece.count = count_;
  const std::vector<std::uint8_t>& rows = transaction_.rows;
  const std::size_t begin = std::min(rows.size(), index * kPieceBytes);
  const std::size_t size = std::min(kPieceBytes, rows.size() - begin);
  piece.bytes.assign(rows.data() + begin, rows.data() + begin + size);
  piece.hash = hash_of(piece.bytes.data(), piece.bytes.size());
  return piece;
}

/// The first transaction that the hub lacks; what is no cloud goes first.
void Outbox::choose(const StoreWatch& own, const Word& word) {
  for (const maps::StoreShare share : maps::kStoreShares) {
    const std::int64_t after = held(word, share);
    if (own.heads()[share] <= after) continue;
    auto next = maps::next_transaction(own.store(), share, after);
    if (!next || !*next) continue;
    sending_.emplace(Sending{Parcel(share, after, std::move(**next)), 0, 0, std::nullopt});
    const Parcel& parcel = sending_->parcel;
    if (word.number == parcel.number() && word.edition == parcel.edition()) sending_->index = word.pieces;
    return;
  }
}

void Outbox::send(const Hello& hello, const StoreWatch& own, const Word& word, Clock::time_point heard_at) {
  const bool listened = bus_->listened_to();
  if (listened && !listened_) sending_.reset();  // read again: what the hub lacks may be less by now
  listened_ = listened;
  if (!listened) return;
  if (sending_ && held(word, sending_->parcel.share()) >= sending_->parcel.number()) sending_.reset();
  if (!sending_) choose(own, word);
  if (!sending_) return;
  for (int i = 0; i < kAtATime && sending_->index < sending_->parcel.count(); ++i) {
    Piece next = sending_->parcel.piece(sending_->index);
    next.name = hello.name;
    next.run = hello.run;
    next.incarnation = hello.incarnation;
    if (!bus_->send(next)) return;
    sent_bytes_ += next.bytes.size();
    if (sending_->index < sending_->most) again_bytes_ += next.bytes.size();
    sending_->most = std::max(sending_->most, ++sending_->index);
    sending_->settled.reset();
  }
  if (sending_->index == sending_->parcel.count()) send_again(word, heard_at);
}

/// What arrived and is not acknowledged was lost with a link or a process.
void Outbox::send_again(const Word& word, Clock::time_point heard_at) {
  if (!bus_->all_received()) {
    sending_->settled.reset();
    return;
  }
  if (!sending_->settled) sending_->settled = Clock::now();
  if (Clock::now() - *sending_->settled < kLost || heard_at - *sending_->settled < kFreshWord) return;
  const Parcel& parcel = sending_->parcel;
  const bool same = word.number == parcel.number() && word.edition == parcel.edition();
  sending_->index = same ? std::min(word.pieces, parcel.count()) : 0;
  sending_->settled.reset();
}

}  // namespace plumbline::net
