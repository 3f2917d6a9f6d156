// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Counter-based random numbers: a value is a pure function of its seed and counter, so that frames come out
// the same in any order and on any number of threads.
#include <cmath>
#include <cstdint>
#include <iterator>

#include "plumbline/core/random.hpp"

namespace plumbline::synth {

inline std::uint64_t mix(std::uint64_t x) { return core::SplitMix(x).next(); }
inline std::uint64_t mix(std::uint64_t a, std::uint64_t b) {
  return mix(mix(a) ^ (b * 0xd1342543de82ef95ULL));
}
inline std::uint64_t mix(std::uint64_t a, std::uint64_t b, std::uint64_t c) { return mix(mix(a, b), c); }

/// Stream of numbers for one purpose.
class Rng {
 public:
  Rng(std::uint64_t seed, std::uint64_t purpose) : state_(mix(seed, purpose)) {}
  std::uint64_t bits() { return mix(state_, ++counter_); }
  double uniform() { return static_cast<double>(bits() >> 11U) * 0x1.0p-53; }  ///< [0, 1)
  double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }
  bool chance(double share) { return uniform() < share; }
  /// From lo to hi, both included.
  int integer(int lo, int hi) { return lo + static_cast<int>(uniform() * (hi - lo + 1)); }
  template <typename List>
  const auto& pick(const List& list) {
    return *(std::begin(list) + integer(0, static_cast<int>(std::size(list)) - 1));
  }
  double normal() {
    const double u = 1.0 - uniform(), v = uniform();
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * M_PI * v);
  }

 private:
  std::uint64_t state_;
  std::uint64_t counter_ = 0;
};

}  // namespace plumbline::synth
