// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Sums by key: what many points of a picture add to the few cells that they lie in.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace plumbline::cloud {

/// A hash table of sums, in the order in which their keys came first. `Sum` has a `key` (64 bits) and is zero
/// when it is made. Neighbours in a picture mostly share their cell: asking for the last key again is cheap.
template <typename Sum>
class SumTable {
 public:
  SumTable() : table_(kFirstTable, 0) {}

  /// Of a key; until the next call.
  Sum& of(std::uint64_t key) {
    if (last_ < sums_.size() && sums_[last_].key == key) return sums_[last_];
    std::size_t slot = slot_of(key);
    if (table_[slot] == 0) {
      sums_.emplace_back();
      sums_.back().key = key;
      table_[slot] = static_cast<std::uint32_t>(sums_.size());
      if (2 * sums_.size() > table_.size()) {
        grow();
        slot = slot_of(key);
      }
    }
    last_ = table_[slot] - 1;
    return sums_[last_];
  }
  [[nodiscard]] const std::vector<Sum>& sums() const { return sums_; }
  /// In the order of their keys; used up.
  [[nodiscard]] std::vector<Sum> sorted() {
    std::sort(sums_.begin(), sums_.end(), [](const Sum& a, const Sum& b) { return a.key < b.key; });
    return std::move(sums_);
  }

 private:
  static constexpr std::size_t kFirstTable = 1024;

  [[nodiscard]] std::size_t slot_of(std::uint64_t key) const {
    const std::size_t mask = table_.size() - 1;
    std::size_t slot = static_cast<std::size_t>(key * 0x9E3779B97F4A7C15ULL >> 32) & mask;
    while (table_[slot] != 0 && sums_[table_[slot] - 1].key != key) slot = (slot + 1) & mask;
    return slot;
  }
  void grow() {
    table_.assign(2 * table_.size(), 0);
    for (std::size_t i = 0; i < sums_.size(); ++i)
      table_[slot_of(sums_[i].key)] = static_cast<std::uint32_t>(i + 1);
  }

  std::vector<Sum> sums_;
  std::vector<std::uint32_t> table_;  ///< open addressing: index into sums_ + 1, 0 = free
  std::size_t last_ = 0;
};

}  // namespace plumbline::cloud
