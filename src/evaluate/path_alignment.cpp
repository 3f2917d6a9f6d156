// SPDX-License-Identifier: BSD-3-Clause
#include "path_alignment.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::evaluate {
namespace {

/// Alignment of the positions, without those from `skip_begin` to before `skip_end`.
geometry::ScaledRigid3 align_positions(const std::vector<MatchedPose>& poses, bool scaled,
                                       std::size_t skip_begin = 0, std::size_t skip_end = 0) {
  std::vector<Eigen::Vector3d> source;
  std::vector<Eigen::Vector3d> target;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i >= skip_begin && i < skip_end) continue;
    source.push_back(poses[i].estimate.translation);
    target.push_back(poses[i].truth.translation);
  }
  if (scaled) return geometry::align_points_scaled(source, target);
  return {1.0, geometry::align_points(source, target)};
}

}  // namespace

/// The similarity that takes the estimate to the truth.
geometry::ScaledRigid3 align_path(const std::vector<MatchedPose>& poses, TrajectoryAlignment align) {
  switch (align) {
    case TrajectoryAlignment::kNone:
      return {};
    case TrajectoryAlignment::kStart:
      return {1.0, poses.front().truth * poses.front().estimate.inverse()};
    case TrajectoryAlignment::kSe3:
    case TrajectoryAlignment::kSim3:
      break;
  }
  return align_positions(poses, align == TrajectoryAlignment::kSim3);
}

geometry::Rigid3 aligned(const geometry::ScaledRigid3& alignment, const geometry::Rigid3& pose) {
  geometry::Rigid3 result = alignment.rigid * pose;
  if (alignment.scale != 1.0) result.translation = alignment * pose.translation;
  return result;
}

ScaleReport scale_report(const std::vector<MatchedPose>& poses, double scale) {
  // Errors of neighbouring poses are alike, so that parts of the path are left out and not poses.
  constexpr std::size_t kParts = 10;
  constexpr double kDoubtful = 3.0;  // standard deviations
  ScaleReport report;
  report.value = scale;

  // Scale without one part each: delete-a-group jackknife
  const std::size_t parts = std::min(kParts, poses.size());
  std::vector<double> scales;
  for (std::size_t k = 0; k < parts; ++k) {
    const std::size_t begin = k * poses.size() / parts;
    const std::size_t end = (k + 1) * poses.size() / parts;
    scales.push_back(align_positions(poses, true, begin, end).scale);
  }

  // Jackknife variance
  double mean = 0.0;
  for (const double s : scales) mean += s / static_cast<double>(parts);
  double squares = 0.0;
  for (const double s : scales) squares += (s - mean) * (s - mean);
  report.sigma = std::sqrt(squares * static_cast<double>(parts - 1) / static_cast<double>(parts));
  report.doubtful = std::abs(scale - 1.0) <= kDoubtful * report.sigma + 1e-4;
  return report;
}

}  // namespace plumbline::evaluate
