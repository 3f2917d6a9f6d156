// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Random numbers that are the same on every machine, which those of <random>'s distributions are not.
#include <cstddef>
#include <cstdint>

namespace plumbline::core {

/// splitmix64 (Steele, Lea & Flood 2014, public domain): one number after the other from a seed.
class SplitMix {
 public:
  explicit SplitMix(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31U);
  }
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(next() % count); }

 private:
  std::uint64_t state_;
};

}  // namespace plumbline::core
