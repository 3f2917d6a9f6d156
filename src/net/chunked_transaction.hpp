// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A transaction's rows, cut into chunks for the network.
#include <cstdint>

#include "bus.hpp"
#include "plumbline/maps/store_replica.hpp"

namespace plumbline::net {

class ChunkedTransaction {
 public:
  /// `after`: the previous transaction that left rows in this stream.
  ChunkedTransaction(maps::StoreStream stream, std::int64_t after, maps::StoreTransaction transaction);
  /// Chunk `index`, without name, run and incarnation of its robot.
  [[nodiscard]] Chunk chunk(std::uint32_t index) const;
  [[nodiscard]] maps::StoreStream stream() const { return stream_; }
  [[nodiscard]] std::int64_t number() const { return transaction_.number; }
  [[nodiscard]] std::uint64_t checksum() const { return checksum_; }
  [[nodiscard]] std::uint32_t count() const { return count_; }

 private:
  maps::StoreStream stream_;
  std::int64_t after_;
  maps::StoreTransaction transaction_;
  std::uint64_t checksum_;
  std::uint32_t count_;
};

}  // namespace plumbline::net
