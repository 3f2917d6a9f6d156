// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Faults of colour cameras.
#include <opencv2/core.hpp>

#include "scene/faults.hpp"

namespace plumbline::synth {

/// Factor on the exposure's gain, t seconds after the first frame; `row_t`: when the row was taken.
float faulty_gain(const ColorFaults& faults, double t, double row_t, std::uint64_t seed);

/// Marks on lens and chip of one camera, the same in all its pictures.
class LensMarks {
 public:
  LensMarks() = default;
  LensMarks(const ColorFaults& faults, const cv::Size& size, std::uint64_t seed);
  void apply(cv::Mat3b& image) const;

 private:
  cv::Mat1f light_;  ///< share of light that passes; empty: all
  cv::Mat1f dots_;   ///< added, 0-255; empty: none
};

}  // namespace plumbline::synth
