// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Line band descriptor (Zhang & Koch 2013; docs/method/features.md), 256 bits, matched by Hamming distance.
#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/features/descriptor.hpp"
#include "plumbline/features/line_segment.hpp"

namespace plumbline::features {

using LineDescriptor = Descriptor256;

/// Number of differing bits, 0-256.
inline int hamming(const LineDescriptor& a, const LineDescriptor& b) { return hamming_distance(a, b); }

/// Normalised statistics of a line: for each of m = 9 bands (from left to right of the line) mean and
/// standard deviation of four gradient sums (along +, along -, across +, across -).
using BandStatistics = std::array<float, 72>;

/// Band statistics of every segment of the image `gray` (CV_8UC1, at least 2 x 2). The
/// bands are 7 rows of 1.5 px each, sampled from the blurred image at half resolution, at most 32 samples
/// along a line: this matches better than full resolution, at a quarter of the cost.
std::vector<BandStatistics> band_statistics(const cv::Mat& gray, const std::vector<LineSegment>& segments);

/// Binary descriptor: 32 fixed pairs of bands, 8 comparisons each.
LineDescriptor binarise(const BandStatistics& statistics);

/// Descriptors of every segment, in their order.
std::vector<LineDescriptor> describe_lines(const cv::Mat& gray, const std::vector<LineSegment>& segments);

}  // namespace plumbline::features
