// SPDX-License-Identifier: BSD-3-Clause
#include "robot/store_watch.hpp"

#include <algorithm>
#include <system_error>

#include "plumbline/core/numbers.hpp"

namespace plumbline::net {

namespace fs = std::filesystem;

void StoreWatch::moved(fs::path store) {
  store_ = std::move(store);
  size_ = 0;
}

StoreWatch::Change StoreWatch::poll() {
  // SQLite writes to the log first
  std::error_code ignored;
  const fs::path log = store_.string() + "-wal";
  const fs::path& written = fs::exists(log, ignored) ? log : store_;
  if (!fs::exists(written, ignored)) return Change::kNone;

  // Reading the heads searches all tables: only when the file or its log has changed.
  const auto time = fs::last_write_time(written, ignored);
  const auto size = fs::file_size(written, ignored);
  if (time == time_ && size == size_) return Change::kNone;
  const auto heads = maps::store_heads(store_);
  if (!heads) return Change::kNone;  // the file is being made, or its folder renamed
  time_ = time;
  size_ = size;
  if (heads->map == heads_.map && heads->clouds == heads_.clouds) return Change::kNone;

  // A store that was replaced begins again
  const bool restarted = heads->map < heads_.map || heads->clouds < heads_.clouds;
  if (restarted) unacknowledged_.clear();
  heads_ = *heads;
  unacknowledged_.emplace_back(*heads, Clock::now());
  return restarted ? Change::kRestarted : Change::kGrown;
}

/// Transactions that the hub lacks; also measures the delay of those it has.
std::int64_t StoreWatch::behind(const maps::StoreHeads& held) {
  constexpr std::size_t kMostLags = 10000;
  while (!unacknowledged_.empty()) {
    const auto& [heads, since] = unacknowledged_.front();
    if (held.map < heads.map || held.clouds < heads.clouds) break;
    if (lags_s_.size() < kMostLags) {
      lags_s_.push_back(std::chrono::duration<double>(Clock::now() - since).count());
    }
    unacknowledged_.pop_front();
  }
  if (unacknowledged_.empty()) return 0;
  return std::max<std::int64_t>(1, unacknowledged_.back().first.last() - held.last());
}

double StoreWatch::lag_s(double quantile) const { return core::quantile(lags_s_, quantile, 0.0); }

}  // namespace plumbline::net
