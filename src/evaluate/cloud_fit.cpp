// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/evaluate/cloud_fit.hpp"

#include "icp.hpp"
#include "prepare.hpp"
#include "surfaces/measured_surface.hpp"
#include "surfaces/point_index.hpp"

namespace plumbline::evaluate {

CloudFit fit_cloud(const SurfaceSamples& cloud, const SurfaceSamples& reference,
                   const geometry::Rigid3& start, double reach_m, const core::Executor& executor) {
  // The start remains if nothing can be compared
  CloudFit fit;
  fit.reference_from_cloud = start;
  if (cloud.points.empty() || reference.points.empty()) return fit;

  // Distances to the planes of the reference's samples
  const PointIndex index(reference.points);
  const SampledSurface surface(index, known_normals(reference.normals, index, executor),
                               density(index, executor).cell_m(), SampleDistance::kSurface);

  // Shifts are removed for precision, then restored
  geometry::Rigid3 moved = start;  // of points without their shifts
  moved.translation += start.rotation * cloud.shift - reference.shift;
  const IcpResult icp = align_icp(cloud.points, surface, moved, {reach_m}, executor);
  fit.reference_from_cloud = icp.reference_from_cloud;
  fit.reference_from_cloud.translation += reference.shift - icp.reference_from_cloud.rotation * cloud.shift;
  fit.overlap = icp.overlap;
  fit.rmse_m = icp.rmse_m;
  fit.found = icp.converged && icp.determined;
  return fit;
}

}  // namespace plumbline::evaluate
