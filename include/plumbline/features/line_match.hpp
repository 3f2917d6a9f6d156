// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Matching lines of two images by descriptor and shape.
#include <vector>

#include "plumbline/features/line_extractor.hpp"

namespace plumbline::features {

struct LineMatch {
  int a = -1;  ///< index into the first list
  int b = -1;  ///< index into the second list
  int distance = 256;
};

struct LineMatchOptions {
  int max_hamming = 60;
  double max_ratio = 0.9;         ///< best / second best distance; 1 = off
  double max_angle_rad = 0.35;    ///< between directed segments; pi = off
  double min_length_ratio = 0.4;  ///< shorter / longer; 0 = off
};

/// Pairs that are each other's best, in order of `a`.
std::vector<LineMatch> match_lines(const std::vector<LineFeature>& a, const std::vector<LineFeature>& b,
                                   const LineMatchOptions& options = {});

/// Share of the shorter segment's length that projects onto the other, in [0, 1].
double overlap(const LineSegment& a, const LineSegment& b);

}  // namespace plumbline::features
