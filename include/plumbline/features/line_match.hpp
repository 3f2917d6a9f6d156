// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Matching lines of two images by descriptor and shape.
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/features/lbd.hpp"
#include "plumbline/features/line_segment.hpp"

namespace plumbline::features {

/// One line with its descriptor, as match_lines wants it (LineFeature gives one).
struct DescribedLine {
  LineSegment segment;
  LineDescriptor descriptor{};
};

struct LineMatch {
  int a = -1;  ///< index into the first list
  int b = -1;  ///< index into the second list
  int distance = 256;
};

struct LineMatchOptions {
  int max_hamming = 60;
  double max_ratio = 0.9;         ///< best / second best distance; 1 = off
  bool mutual = true;             ///< each the other's best
  double max_angle_rad = 0.35;    ///< between directed segments; pi = off
  double min_length_ratio = 0.4;  ///< shorter / longer; 0 = off
  double max_distance_px =
      0.0;                   ///< of b's middle from a's (infinite) line and of the middles along it; 0 = off
  double min_overlap = 0.0;  ///< share of the shorter's length, projected on the other; 0 = off

  void declare(core::OptionTable& table);
};

/// Pairs in order of `a`. max_distance_px and min_overlap make sense only where both lists are in (nearly)
/// the same pixel frame, e.g. `a` predicted into b's image.
std::vector<LineMatch> match_lines(const std::vector<DescribedLine>& a, const std::vector<DescribedLine>& b,
                                   const LineMatchOptions& options = {});

/// Share of the shorter segment's length that projects onto the other, in [0, 1].
double overlap(const LineSegment& a, const LineSegment& b);

}  // namespace plumbline::features
