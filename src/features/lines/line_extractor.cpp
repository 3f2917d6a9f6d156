// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/line_extractor.hpp"

namespace plumbline::features {

void LineOptions::declare(core::OptionTable& table) {
  detector.declare(table);
  depth.declare(table);
}

std::vector<LineFeature> LineExtractor::extract(const cv::Mat& gray, const cv::Mat& depth_m,
                                                const sensor::Pinhole& camera) const {
  const std::vector<LineSegment> segments = detector_.detect(gray);
  const std::vector<LineDescriptor> descriptors = describe_lines(gray, segments);
  std::vector<LineFeature> features(segments.size());
  for (std::size_t i = 0; i < segments.size(); ++i) {
    features[i].segment = segments[i];
    features[i].descriptor = descriptors[i];
    if (!depth_m.empty()) features[i].line3 = fit_line_depth(segments[i], depth_m, camera, options_.depth);
  }
  return features;
}

}  // namespace plumbline::features
