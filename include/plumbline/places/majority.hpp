// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clusters of binary descriptors (k-majority, Grana et al., ICME 2013): centres are bitwise majorities.
#include <cstdint>
#include <vector>

#include "plumbline/features/descriptor.hpp"

namespace plumbline::places {

/// Counts how often each of 256 bits is set, 64 bits at a time.
class BitCounter {
 public:
  void add(const features::Descriptor256& descriptor);
  /// Bits set in more than half of the added descriptors; a tie gives 0.
  [[nodiscard]] features::Descriptor256 majority() const;
  [[nodiscard]] std::uint32_t count() const { return count_; }

 private:
  std::vector<features::Descriptor256> planes_;  ///< binary digits of the counts, lowest first
  std::uint32_t count_ = 0;
};

struct Clusters {
  std::vector<features::Descriptor256> centres;
  std::vector<int> member_of;  ///< by descriptor
};

/// At most `k` clusters, none empty, all centres different; fewer if there are fewer different descriptors.
/// First centres are spread like those of k-means++ (drawn with `seed`), then `iterations` rounds. Ties go to
/// the first centre. Deterministic.
Clusters k_majority(const std::vector<features::Descriptor256>& descriptors, int k, int iterations,
                    std::uint64_t seed);

}  // namespace plumbline::places
