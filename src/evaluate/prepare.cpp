// SPDX-License-Identifier: BSD-3-Clause
#include "prepare.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace plumbline::evaluate {
namespace {

using Points = std::vector<Eigen::Vector3f>;

Eigen::Vector3f unit_or_zero(const Eigen::Vector3f& n) {
  const float length = n.norm();
  if (!n.allFinite() || !(length > 1e-6F)) return Eigen::Vector3f::Zero();
  return n / length;
}

/// True if the normals fit the surface; some files carry a constant in their place.
bool plausible(const Points& normals, const PointIndex& index) {
  constexpr std::size_t kMost = 2000;
  const std::size_t stride = (index.size() + kMost - 1) / kMost;
  Points some;
  Points own;
  for (std::size_t k = 0; k < index.size(); k += stride) {
    some.push_back(index.points()[index.order()[k]]);
    own.push_back(normals[index.order()[k]]);
  }
  std::vector<double> cosines;
  std::vector<Neighbor> found;
  for (std::size_t k = 0; k < some.size(); ++k) {
    index.nearest(some[k].cast<double>(), 12, found);
    const Eigen::Vector3f estimate =
        found.size() >= 4 ? flat_normal(index.points(), found) : Eigen::Vector3f::Zero();
    if (!estimate.isZero() && !own[k].isZero()) cosines.push_back(std::abs(estimate.dot(own[k])));
  }
  return cosines.size() < 20 || summarize(cosines).median > 0.5;
}

}  // namespace

/// Lengths must be above zero, shares within one.
core::Result<void> check(const CloudOptions& o) {
  const auto above = [](double value, double limit) { return std::isfinite(value) && value > limit; };
  if (!above(o.mesh_spacing_m, 0.0)) return core::usage_error("mesh_spacing must be above 0");
  if (!above(o.icp_max_distance_m, 0.0)) return core::usage_error("icp_max_distance must be above 0");
  if (!above(o.icp_trim, 0.0) || o.icp_trim > 1.0) return core::usage_error("icp_trim must be in (0, 1]");
  if (!above(o.wall.patch_m, 0.0) || !above(o.wall.cell_m, 0.0) || !above(o.wall.max_spacing_m, 0.0) ||
      !above(o.wall.flatness_m, 0.0)) {
    return core::usage_error("wall_patch, wall_cell, wall_max_spacing and wall_flatness must be above 0");
  }
  return {};
}

core::Result<void> check(const Reference& reference) {
  // Points of the mesh or of the cloud
  const TriangleMesh& mesh = reference.mesh;
  const Points& points = mesh.triangles.empty() ? reference.samples.points : mesh.vertices;
  const std::string name = reference.name.empty() ? "the reference" : reference.name;
  if (points.empty()) return core::input_error(fmt::format("{}: no points to measure against", name));

  // Infinite coordinates would spoil every distance
  const auto bad = std::count_if(points.begin(), points.end(), [](const auto& p) { return !p.allFinite(); });
  if (bad > 0) {
    return core::input_error(
        fmt::format("{}: {} of {} points have a coordinate that is not finite", name, bad, points.size()));
  }

  // Faces must refer to vertices
  for (const auto& triangle : mesh.triangles) {
    if (*std::max_element(triangle.begin(), triangle.end()) >= mesh.vertices.size()) {
      return core::input_error(fmt::format("{}: a face has a vertex out of range", name));
    }
  }

  // Normals and visibility belong to points
  const SurfaceSamples& s = reference.samples;
  const bool fits = (s.normals.empty() || s.normals.size() == s.points.size()) &&
                    (s.visible.empty() || s.visible.size() == s.points.size()) &&
                    (mesh.visible.empty() || mesh.visible.size() == mesh.vertices.size());
  if (!fits) return core::input_error(fmt::format("{}: normals or visibility do not match its points", name));
  return {};
}

core::Result<PreparedCloud> prepare(const SurfaceSamples& cloud, const core::Executor& executor,
                                    CloudReport& report) {
  // Each point has a normal, or none has
  const bool normals = !cloud.normals.empty();
  if (normals && cloud.normals.size() != cloud.points.size()) {
    return core::input_error("the cloud has not as many normals as points");
  }

  // Finite points only, with their old numbers
  PreparedCloud out;
  out.samples = std::make_unique<SurfaceSamples>();
  out.samples->shift = cloud.shift;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    out.samples->points.push_back(cloud.points[i]);
    if (normals) out.samples->normals.push_back(unit_or_zero(cloud.normals[i]));
    out.source.push_back(static_cast<std::uint32_t>(i));
  }

  // Without points nothing can be measured
  report.points = out.samples->points.size();
  report.not_finite = cloud.points.size() - report.points;
  if (report.points == 0) {
    return core::input_error(
        cloud.points.empty() ? std::string("the cloud has no points")
                             : fmt::format("none of the cloud's {} points is finite", cloud.points.size()));
  }

  // Such points are only reported
  if (report.not_finite > 0) {
    report.warnings.push_back(fmt::format("{} of {} points of the cloud are not finite and were left out",
                                          report.not_finite, cloud.points.size()));
  }

  // Density decides the sizes of cells
  out.index = std::make_unique<PointIndex>(out.samples->points);
  out.density = density(*out.index, executor);
  report.density_per_m2 = out.density.points_per_m2;
  report.spacing_mm = 1000.0 * out.density.spacing_m;

  // Normals of another frame would distort the comparison
  auto& own = out.samples->normals;
  const bool any = std::any_of(own.begin(), own.end(), [](const Eigen::Vector3f& n) { return !n.isZero(); });
  if (any && !plausible(own, *out.index)) {
    report.warnings.push_back("the cloud's normals do not fit its points and were not used");
    own.clear();
  }
  if (!any) own.clear();
  return out;
}

/// Given normals; estimated ones where these are missing.
Points known_normals(const Points& given, const PointIndex& index, const core::Executor& executor) {
  Points normals(index.size(), Eigen::Vector3f::Zero());
  bool all = !given.empty();
  for (std::size_t i = 0; i < given.size(); ++i) {
    normals[i] = unit_or_zero(given[i]);
    all = all && !normals[i].isZero();
  }
  if (all) return normals;
  const Points estimated = estimate_normals(index, executor);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (normals[i].isZero()) normals[i] = estimated[i];
  }
  return normals;
}

void move(const geometry::Rigid3& target_from_source, SurfaceSamples& samples) {
  for (Eigen::Vector3f& p : samples.points) p = (target_from_source * p.cast<double>()).cast<float>();
  for (Eigen::Vector3f& n : samples.normals)
    n = (target_from_source.rotation * n.cast<double>()).cast<float>();
}

/// Area of all triangles, in double precision.
double surface_area(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d p = mesh.vertices[a].cast<double>();
    area += 0.5 * (mesh.vertices[b].cast<double>() - p).cross(mesh.vertices[c].cast<double>() - p).norm();
  }
  return area;
}

}  // namespace plumbline::evaluate
