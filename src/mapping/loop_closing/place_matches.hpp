// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "plumbline/features/frame_features.hpp"

namespace plumbline::mapping {

/// Sizes of features in space, in octaves of the pyramid, where their depth is known (else NaN). Images
/// of cameras with other focal lengths show one corner in octaves that lie far apart; its size in space is
/// the same.
struct SizeGate {
  std::vector<float> size_in_a;
  std::vector<float> size_in_b;
  float tolerance = 2.0F;  ///< octaves
};
SizeGate size_gate(const features::FrameFeatures& a, double focal_a_px, const features::FrameFeatures& b,
                   double focal_b_px, double scale_factor);

/// Points of two images that look like each other and like no other: each is the other's nearest by
/// descriptor, clearly nearer than whatever lies at another place of its image. By index in `a`. `gate`: only
/// features of one size match; null: whatever their sizes.
std::vector<std::pair<std::size_t, std::size_t>> alike_both_ways(const features::FrameFeatures& a,
                                                                 const features::FrameFeatures& b,
                                                                 const SizeGate* gate = nullptr);

}  // namespace plumbline::mapping
