// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/descriptor.hpp"

namespace plumbline::features {

// The popcnt clone is chosen at load time; plain x86-64 has no such instruction.
__attribute__((target_clones("popcnt", "default"))) int hamming_distance(const Descriptor256& a,
                                                                         const Descriptor256& b) {
  int sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += __builtin_popcountll(a[k] ^ b[k]);
  return sum;
}

// Compiled twice: processors with popcnt take the faster variant.
__attribute__((target_clones("popcnt", "default"))) void hamming_distances(const Descriptor256& query,
                                                                           const Descriptor256* others,
                                                                           std::size_t count,
                                                                           int* distances) {
  for (std::size_t i = 0; i < count; ++i) {
    int sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += __builtin_popcountll(query[k] ^ others[i][k]);
    distances[i] = sum;
  }
}

}  // namespace plumbline::features
