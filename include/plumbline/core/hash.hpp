// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// FNV-1a, 64 bits: distinguishes contents; no protection against intent.
#include <cstddef>
#include <cstdint>

namespace plumbline::core {

class Hash {
 public:
  void bytes(const void* data, std::size_t size) {
    const auto* at = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) value_ = (value_ ^ at[i]) * 0x100000001b3ULL;
  }
  template <typename T>
  void number(T value) {
    bytes(&value, sizeof value);
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

}  // namespace plumbline::core
