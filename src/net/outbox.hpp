// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// From a robot's own store, as it grows beside the run, to the hub.
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "bus.hpp"
#include "plumbline/maps/store_replica.hpp"

namespace plumbline::net {

/// The store, and how long its transactions wait for the hub.
class StoreWatch {
 public:
  enum class Seen { kNothingNew, kGrown, kBegunAnew };

  /// From now on what is or comes to be there.
  void follow(std::filesystem::path store) { *this = StoreWatch(std::move(store), std::move(lags_s_)); }
  /// Its folder has another name now.
  void moved(std::filesystem::path store);
  Seen look();
  [[nodiscard]] const std::filesystem::path& store() const { return store_; }
  [[nodiscard]] const maps::StoreHeads& heads() const { return heads_; }
  /// How many transactions a hub that holds all up to `held` is behind.
  std::int64_t behind(const maps::StoreHeads& held);
  /// Seconds from a transaction to its acknowledgement, that so much of all took at most; 0: not known.
  [[nodiscard]] double lag_s(double quantile) const;

  StoreWatch() = default;

 private:
  StoreWatch(std::filesystem::path store, std::vector<double> lags_s)
      : store_(std::move(store)), lags_s_(std::move(lags_s)) {}

  std::filesystem::path store_;
  std::filesystem::file_time_type time_;
  std::uintmax_t size_ = 0;
  maps::StoreHeads heads_;
  std::deque<std::pair<maps::StoreHeads, Clock::time_point>> noticed_;  ///< not acknowledged yet
  std::vector<double> lags_s_;
};

/// A transaction's rows in parts; `share` and `after` as in messages.idl.
class Parcel {
 public:
  Parcel(maps::StoreShare share, std::int64_t after, maps::StoreTransaction transaction);
  /// Part `index`, without whose it is.
  [[nodiscard]] Piece piece(std::uint32_t index) const;
  [[nodiscard]] maps::StoreShare share() const { return share_; }
  [[nodiscard]] std::int64_t number() const { return transaction_.number; }
  [[nodiscard]] std::uint64_t edition() const { return edition_; }
  [[nodiscard]] std::uint32_t count() const { return count_; }

 private:
  maps::StoreShare share_;
  std::int64_t after_;
  maps::StoreTransaction transaction_;
  std::uint64_t edition_;
  std::uint32_t count_;
};

class Outbox {
 public:
  explicit Outbox(RobotBus& bus) : bus_(&bus) {}
  /// Of `own`, what the hub's `word` of `heard_at` says that it lacks, some pieces at a time.
  void send(const Hello& hello, const StoreWatch& own, const Word& word, Clock::time_point heard_at);
  /// What is under way is chosen anew.
  void forget() { sending_.reset(); }
  [[nodiscard]] std::uint64_t sent_bytes() const { return sent_bytes_; }
  [[nodiscard]] std::uint64_t again_bytes() const { return again_bytes_; }  ///< of these, sent before

 private:
  struct Sending {
    Parcel parcel;
    std::uint32_t index = 0;                   ///< the next piece
    std::uint32_t most = 0;                    ///< pieces that were sent at least once
    std::optional<Clock::time_point> settled;  ///< since when DDS owes nobody a piece
  };
  void choose(const StoreWatch& own, const Word& word);
  void send_again(const Word& word, Clock::time_point heard_at);

  RobotBus* bus_;
  bool listened_ = false;
  std::optional<Sending> sending_;
  std::uint64_t sent_bytes_ = 0;
  std::uint64_t again_bytes_ = 0;
};

}  // namespace plumbline::net
