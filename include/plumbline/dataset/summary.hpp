// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What there is to know about a recording before it is mapped; `plumbline info` prints it.
#include <cstddef>
#include <string>
#include <vector>

#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

struct RecordingSummary {
  std::string name;
  std::string format;
  std::string camera;  ///< name of the calibration
  int width = 0;
  int height = 0;
  bool distorted = false;
  bool registers_depth = false;  ///< depth has a camera of its own
  double depth_scale = 0.0;      ///< raw units per metre
  std::size_t pairs = 0;
  double duration_s = 0.0;  ///< from the first colour stamp to the last
  double fps = 0.0;         ///< from the median step between colour stamps; 0 for fewer than 2 pairs
  double longest_gap_s = 0.0;
  std::size_t sampled = 0;           ///< frames that were decoded for the numbers below
  std::size_t unreadable = 0;        ///< of the sampled ones
  double median_depth_m = 0.0;       ///< 0 when no depth was measured
  double missing_depth_share = 0.0;  ///< of the pixels of the readable sampled frames, [0, 1]
  bool has_truth = false;
};

/// Decodes up to `samples` frames, evenly spread.
RecordingSummary describe(const FrameSource& source, std::size_t samples = 5);

/// A few lines of text, "key: value".
std::string to_text(const RecordingSummary& summary);

/// Up to `samples` positions, evenly spread over [0, count), the first and the last among them.
std::vector<std::size_t> spread(std::size_t count, std::size_t samples);

}  // namespace plumbline::dataset
