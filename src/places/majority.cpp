// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/places/majority.hpp"

#include <algorithm>

#include "plumbline/core/random.hpp"

namespace plumbline::places {
namespace {

using features::Descriptor256;

class Distances {
 public:
  explicit Distances(const std::vector<Descriptor256>& descriptors)
      : descriptors_(descriptors), result_(descriptors.size()) {}
  const std::vector<int>& from(const Descriptor256& centre) {
    features::hamming_distances(centre, descriptors_.data(), descriptors_.size(), result_.data());
    return result_;
  }

 private:
  const std::vector<Descriptor256>& descriptors_;
  std::vector<int> result_;
};

/// k-means++: each next centre is drawn with a chance that grows with the squared distance from those there.
std::vector<Descriptor256> first_centres(const std::vector<Descriptor256>& descriptors, int k,
                                         std::uint64_t seed, Distances& distances) {
  core::SplitMix random(seed);
  std::vector<Descriptor256> centres{descriptors[random.below(descriptors.size())]};
  std::vector<int> nearest = distances.from(centres.front());
  while (static_cast<int>(centres.size()) < k) {
    std::uint64_t total = 0;
    for (const int d : nearest) total += static_cast<std::uint64_t>(d) * static_cast<std::uint64_t>(d);
    if (total == 0) break;  // all descriptors are centres

    // A draw in proportion to the squared distances
    std::uint64_t draw = random.next() % total;
    std::size_t chosen = 0;
    for (; chosen < nearest.size(); ++chosen) {
      const auto d = static_cast<std::uint64_t>(nearest[chosen]);
      if (draw < d * d) break;
      draw -= d * d;
    }

    // Distances from the nearest centre
    centres.push_back(descriptors[chosen]);
    const std::vector<int>& added = distances.from(centres.back());
    for (std::size_t i = 0; i < nearest.size(); ++i) nearest[i] = std::min(nearest[i], added[i]);
  }

  return centres;
}

// Number of the nearest centre of each descriptor.
std::vector<int> assign(const std::vector<Descriptor256>& centres, std::size_t count, Distances& distances) {
  std::vector<int> member_of(count, 0);
  std::vector<int> nearest(count, 257);
  for (std::size_t c = 0; c < centres.size(); ++c) {
    const std::vector<int>& d = distances.from(centres[c]);
    for (std::size_t i = 0; i < count; ++i) {
      if (d[i] < nearest[i]) {
        nearest[i] = d[i];
        member_of[i] = static_cast<int>(c);
      }
    }
  }
  return member_of;
}

/// Removes centres without members, and repeated ones.
void drop_idle(std::vector<Descriptor256>& centres, const std::vector<BitCounter>& counters) {
  std::vector<Descriptor256> kept;
  for (std::size_t c = 0; c < centres.size(); ++c) {
    if (counters[c].count() == 0) continue;
    if (std::find(kept.begin(), kept.end(), centres[c]) == kept.end()) kept.push_back(centres[c]);
  }
  centres = std::move(kept);
}

}  // namespace

void BitCounter::add(const Descriptor256& descriptor) {
  ++count_;

  // Binary addition with carry, for all bits at once
  Descriptor256 carry = descriptor;
  for (std::size_t level = 0;; ++level) {
    if ((carry[0] | carry[1] | carry[2] | carry[3]) == 0) return;
    if (level == planes_.size()) planes_.push_back({});
    Descriptor256& plane = planes_[level];
    for (std::size_t w = 0; w < 4; ++w) {
      const std::uint64_t both = plane[w] & carry[w];
      plane[w] ^= carry[w];
      carry[w] = both;
    }
  }
}

Descriptor256 BitCounter::majority() const {
  const std::uint32_t half = count_ / 2;  // a count beyond it is more than half
  Descriptor256 above{};
  if ((static_cast<std::uint64_t>(half) >> planes_.size()) != 0) return above;
  Descriptor256 equal;
  equal.fill(~0ULL);

  // Counts are compared with half, highest digit first
  for (std::size_t level = planes_.size(); level-- > 0;) {
    const std::uint64_t digit = ((half >> level) & 1U) != 0 ? ~0ULL : 0ULL;
    for (std::size_t w = 0; w < 4; ++w) {
      above[w] |= equal[w] & planes_[level][w] & ~digit;
      equal[w] &= ~(planes_[level][w] ^ digit);
    }
  }
  return above;
}

Clusters k_majority(const std::vector<Descriptor256>& descriptors, int k, int iterations,
                    std::uint64_t seed) {
  Clusters clusters;
  if (descriptors.empty() || k < 1) return clusters;
  Distances distances(descriptors);
  clusters.centres = first_centres(descriptors, k, seed, distances);

  // Bits of the members of each centre are counted
  for (int round = 0; round < iterations; ++round) {
    clusters.member_of = assign(clusters.centres, descriptors.size(), distances);
    std::vector<BitCounter> counters(clusters.centres.size());
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      counters[static_cast<std::size_t>(clusters.member_of[i])].add(descriptors[i]);
    }

    // Centres become the majority of their members
    const std::vector<Descriptor256> before = clusters.centres;
    for (std::size_t c = 0; c < counters.size(); ++c) clusters.centres[c] = counters[c].majority();
    drop_idle(clusters.centres, counters);
    if (clusters.centres == before) break;
  }

  // After the last assignment a moved centre may have no members: it is dropped, and its neighbours are
  // assigned again.
  for (;;) {
    clusters.member_of = assign(clusters.centres, descriptors.size(), distances);
    std::vector<BitCounter> counters(clusters.centres.size());
    for (const int c : clusters.member_of) counters[static_cast<std::size_t>(c)].add({});
    const std::size_t before = clusters.centres.size();
    drop_idle(clusters.centres, counters);
    if (clusters.centres.size() == before) return clusters;
  }
}

}  // namespace plumbline::places
