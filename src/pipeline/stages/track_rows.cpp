// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "plumbline/mapping/slam.hpp"
#include "stages/stages.hpp"

namespace plumbline::pipeline {
namespace {

std::string columns_of(const mapping::ConeTerms& c) {
  return fmt::format("{},{:.4f},{},{},{},{:.4f},{:.4f},{:.4f},{:.2f},{:.2f},{:.4f},{:.4f}",
                     c.candidate ? 1 : 0, c.shared, c.now.matched, c.now.all, c.now.changed,
                     c.threshold.theta, c.threshold.beta, c.threshold.alpha, c.threshold.initial,
                     c.threshold.adaptive, c.balance.ecog, c.balance.offset);
}

std::string columns_of(const mapping::BundleReport& b) {
  if (!b.keyframe.valid()) return "-1,,,0";
  const double ratio = b.summary.initial_cost > 0.0 ? b.summary.final_cost / b.summary.initial_cost : 1.0;
  return fmt::format("{},{:.4f},{},{}", b.keyframe.index, ratio,
                     b.summary.point_outliers + b.summary.line_outliers, b.refused ? 1 : 0);
}

}  // namespace

const char* const kRowColumns =
    "stamp,reference,keyframe,component,relocalised,points,points_rms,lines,lines_rms,surface,surface_rms,"
    "photometric,photometric_rms,min_eigenvalue,weak_directions,frames_since_keyframe,shared,overlap,"
    "parallax,rotation_rad,mapper_idle,cone_candidate,cone_shared,cone_matched,cone_all,cone_changed,"
    "cone_theta,cone_beta,cone_alpha,cone_initial,cone_adaptive,cone_ecog,cone_offset,wanted,urgent,"
    "bundle,bundle_cost,bundle_outliers,bundle_refused";

std::string row_columns(const mapping::FrameReport& r) {
  const mapping::KeyframeDecision& d = r.decision;
  return fmt::format(
      "{:.6f},{},{},{},{},{},{:.4f},{},{:.4f},{},{:.4f},{},{:.4f},{:.6g},{},{},{:.4f},{:.4f},{:.4f},{:.4f},{}"
      ",{}"
      ",{},{},{}",
      r.stamp, r.reference.index, r.keyframe.index, r.component.index, r.relocalised ? 1 : 0,
      r.points.inliers, r.points.rms, r.lines.inliers, r.lines.rms, r.surface.inliers, r.surface.rms,
      r.photometric.inliers, r.photometric.rms, r.min_eigenvalue, r.degenerate_directions, d.frames_since,
      d.shared, d.overlap, d.parallax, d.rotation_rad, d.mapper_idle ? 1 : 0, columns_of(d.cone),
      d.wanted ? 1 : 0, d.urgent ? 1 : 0, columns_of(r.bundle));
}

}  // namespace plumbline::pipeline
