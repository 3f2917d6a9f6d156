// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/pose_terms.hpp"

#include <cmath>

#include "plumbline/geometry/plucker.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::tracking {

std::vector<optimize::PointTerm> point_terms(const maps::Map& map, const std::vector<PointMatch>& matches,
                                             const features::FrameFeatures& features,
                                             const AssociationOptions& options) {
  std::vector<optimize::PointTerm> terms;
  terms.reserve(matches.size());

  for (const PointMatch& match : matches) {
    const features::PointFeature& f = features.points[static_cast<std::size_t>(match.feature)];
    optimize::PointTerm term;
    term.world = map.point(match.point).position;
    term.pixel = (f.pixel + match.shift).cast<double>();
    term.pixel_sigma =
        std::pow(options.scale_factor, f.octave) * (match.aligned ? options.aligned_sigma : 1.0);

    const float depth = features.depth_beside(static_cast<std::size_t>(match.feature), match.shift);
    if (depth > 0.0F) {
      term.depth = static_cast<double>(depth);
      // The landmark's depth is no more accurate than the measurement.
      term.depth_sigma = std::sqrt(2.0) * sensor::depth_sigma(term.depth);
    }

    terms.push_back(term);
  }

  return terms;
}

std::vector<optimize::LineTerm> line_terms(const maps::Map& map, const std::vector<LineMatch>& matches,
                                           const features::FrameFeatures& features, double sigma_px) {
  std::vector<optimize::LineTerm> terms;
  terms.reserve(matches.size());
  for (const LineMatch& match : matches) {
    const maps::MapLine& line = map.line(match.line);
    const features::LineSegment& s = features.lines[static_cast<std::size_t>(match.feature)].segment;

    // An infinite line, since ends are not repeatable
    optimize::LineTerm term;
    term.world = geometry::line_through(line.start, line.end);
    term.start = s.start.cast<double>();
    term.end = s.end.cast<double>();
    term.pixel_sigma = sigma_px;
    terms.push_back(term);
  }
  return terms;
}

}  // namespace plumbline::tracking
