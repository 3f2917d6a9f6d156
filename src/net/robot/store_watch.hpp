// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A robot's own store as it grows, and how long its transactions wait for the hub.
#include <cstdint>
#include <deque>
#include <filesystem>
#include <utility>
#include <vector>

#include "bus.hpp"
#include "plumbline/maps/store_replica.hpp"

namespace plumbline::net {

class StoreWatch {
 public:
  enum class Change { kNone, kGrown, kRestarted };

  StoreWatch() = default;
  /// Watches this file from now on; it need not exist yet.
  void follow(std::filesystem::path store) { *this = StoreWatch(std::move(store), std::move(lags_s_)); }
  /// The store's folder was renamed.
  void moved(std::filesystem::path store);
  /// Reads the heads again if the file has changed.
  Change poll();
  [[nodiscard]] const std::filesystem::path& store() const { return store_; }
  [[nodiscard]] const maps::StoreHeads& heads() const { return heads_; }
  /// Number of transactions that a hub which holds all up to `held` still lacks.
  std::int64_t behind(const maps::StoreHeads& held);
  /// Quantile of the seconds from a transaction to its acknowledgement; 0: not known.
  [[nodiscard]] double lag_s(double quantile) const;

 private:
  StoreWatch(std::filesystem::path store, std::vector<double> lags_s)
      : store_(std::move(store)), lags_s_(std::move(lags_s)) {}

  std::filesystem::path store_;
  std::filesystem::file_time_type time_;
  std::uintmax_t size_ = 0;
  maps::StoreHeads heads_;
  std::deque<std::pair<maps::StoreHeads, Clock::time_point>> unacknowledged_;
  std::vector<double> lags_s_;
};

}  // namespace plumbline::net
