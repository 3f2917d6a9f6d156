// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Line segments of an image (docs/method/features.md): LSD, EDLines or FLD behind one interface, then joined,
// cleaned and put in a fixed order.
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/features/line_segment.hpp"

namespace plumbline::features {

enum class LineMethod {
  kLsd,      ///< von Gioi et al. 2010, the paper's choice
  kEdlines,  ///< Akinlar & Topal 2011, edge drawing
  kFld,      ///< Lee et al. 2014, fast line detector
};
enum class LineScale { kHalf, kFull };

struct LineDetectorOptions {
  LineMethod method = LineMethod::kLsd;
  LineScale scale = LineScale::kHalf;
  /// LSD: smallest gradient, grey levels per px at the detection scale; under 5.2 where strong ones are few.
  double min_gradient = 3.0;
  double min_length_px = 25.0;
  double border_px = 4.0;
  bool border_either = false;  ///< also drop lines with one end in that margin, not only those along a side
  bool exact_nfa = false;      ///< LSD's number of false alarms by its sum, not by a bound
  int max_count = 0;
  bool join = true;
  double join_gap_px = 12.0;
  double join_angle_rad = 0.035;
  double join_offset_px = 1.5;

  void declare(core::OptionTable& table);
};

/// Thread-safe: detect keeps no state between calls.
class LineDetector {
 public:
  explicit LineDetector(const LineDetectorOptions& options = {}) : options_(options) {}

  /// Segments of `gray` (CV_8UC1), longest first, ties by position; none for an empty or tiny image. Lengths,
  /// margins and coordinates are full-resolution pixels whatever the scale of detection. Constant borders
  /// (valid_region) are masked.
  [[nodiscard]] std::vector<LineSegment> detect(const cv::Mat& gray) const;

 private:
  LineDetectorOptions options_;
};

/// Joins collinear pieces of the same direction and drops near-duplicates that overlap within 1 px; parallel
/// edges further apart stay apart. Result longest first, ties by position.
std::vector<LineSegment> join_collinear(std::vector<LineSegment> segments,
                                        const LineDetectorOptions& options);

}  // namespace plumbline::features
