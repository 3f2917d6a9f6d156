// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Made-up pictures: sets of descriptors that look alike when they show the same place.
#include <cstdint>
#include <memory>

#include "plumbline/features/frame_features.hpp"

namespace plumbline::tests {

class Bits {
 public:
  explicit Bits(std::uint32_t seed) : state_(seed * 2654435761ULL + 1) {}
  std::uint64_t next() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return (state_ >> 32U) | (state_ << 32U);
  }

 private:
  std::uint64_t state_;
};

inline features::Descriptor256 random_descriptor(Bits& bits) {
  features::Descriptor256 d{};
  for (auto& word : d) word = bits.next() ^ (bits.next() << 17U);
  return d;
}

inline features::Descriptor256 flipped(features::Descriptor256 d, int count, Bits& bits) {
  for (int i = 0; i < count; ++i) {
    const std::uint64_t r = bits.next() >> 8U;
    d[r & 3U] ^= 1ULL << ((r >> 2U) & 63U);
  }
  return d;
}

/// What features look like is not spread evenly: one of 4000 kinds of thing, varied.
inline features::Descriptor256 thing(Bits& bits) {
  Bits of_kind(static_cast<std::uint32_t>(77777 + (bits.next() >> 8U) % 4000));
  return flipped(random_descriptor(of_kind), 20, bits);
}

/// View `view` of place `place`: 300 points and 60 lines, `noise` bits of each different from view to view.
inline std::shared_ptr<const features::FrameFeatures> picture(std::uint32_t place, std::uint32_t view,
                                                              int noise = 12) {
  auto features = std::make_shared<features::FrameFeatures>();
  Bits of_place(1000 + place);
  Bits of_view(place * 7919 + view + 1);
  for (int i = 0; i < 300; ++i) {
    features->descriptors.push_back(flipped(thing(of_place), noise, of_view));
    features->points.emplace_back();
  }
  for (int i = 0; i < 60; ++i) {
    features->lines.emplace_back();
    features->lines.back().descriptor = flipped(thing(of_place), noise, of_view);
  }
  return features;
}

}  // namespace plumbline::tests
