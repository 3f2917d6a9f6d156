// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/geometry/line_triangulation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

namespace plumbline::geometry {
namespace {

using Status = LineTriangulationStatus;
using Matrix4 = Eigen::Matrix4d;
using Vector4 = Eigen::Vector4d;

/// Plane through the camera's centre and the segment: normal . x = offset in the world frame.
struct Plane {
  Eigen::Vector3d normal;
  double offset;
};

/// Plane through the camera's centre and the seen segment; none: the segment is too short.
std::optional<Plane> interpretation_plane(const LineView& view) {
  const Eigen::Vector3d normal = view.start.homogeneous().cross(view.end.homogeneous());
  const double length = normal.norm();
  if (!std::isfinite(length) || !((view.end - view.start).norm() > 2.0 * view.sigma) || !(view.sigma > 0.0))
    return std::nullopt;
  const Eigen::Vector3d world = view.camera_from_world.rotation.transpose() * (normal / length);
  return Plane{world, world.dot(view.camera_from_world.inverse().translation)};
}

/// Largest angle between two planes, the parallax of the line.
double largest_angle(const std::vector<Plane>& planes) {
  double sine = 0.0;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    for (std::size_t j = i + 1; j < planes.size(); ++j)
      sine = std::max(sine, planes[i].normal.cross(planes[j].normal).norm());
  }
  return std::asin(std::min(1.0, sine));
}

/// Least squares over the planes: v is what all normals are perpendicular to, the point is nearest to all.
PluckerLine meet(const std::vector<Plane>& planes) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Plane& plane : planes) {
    a += plane.normal * plane.normal.transpose();
    b += plane.normal * plane.offset;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(a);
  const Eigen::Vector3d v = eigen.eigenvectors().col(0);
  // In the plane through the origin perpendicular to v, where `a` has full rank.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int i = 1; i < 3; ++i) {
    const Eigen::Vector3d e = eigen.eigenvectors().col(i);
    point += e * (e.dot(b) / eigen.eigenvalues()(i));
  }
  return {point.cross(v), v};
}

/// Distances of the measured ends from the line's image, in standard deviations, and their derivatives by
/// the orthonormal parameters. False where the line has no image.
bool residuals_of(const LineView& view, const OrthonormalLine& line, Eigen::Vector2d& residual,
                  Eigen::Matrix<double, 2, 4>& jacobian) {
  // The unscaled vector (w1 u1, w2 u2): a residual does not depend on the line's scale.
  const Eigen::Vector3d n = line.w1 * line.u.col(0);
  const Eigen::Vector3d v = line.w2 * line.u.col(1);
  const Eigen::Matrix3d& r = view.camera_from_world.rotation;
  const Eigen::Matrix3d tr = skew(view.camera_from_world.translation) * r;
  const Eigen::Vector3d l = r * n + tr * v;
  const double norm_sq = l.head<2>().squaredNorm();
  if (!(norm_sq > 1e-16)) return false;

  // Chain rule over the projected line.
  Eigen::Matrix<double, 3, 6> dl;
  dl << r, tr;
  const Eigen::Matrix<double, 3, 4> dl_dp = dl * orthonormal_jacobian(line);
  const double w = 1.0 / (std::sqrt(norm_sq) * view.sigma);
  const Eigen::Vector3d ends[2] = {view.start.homogeneous(), view.end.homogeneous()};

  // Distance of each end from the line.
  for (int i = 0; i < 2; ++i) {
    const double dot = ends[i].dot(l);
    residual(i) = w * dot;
    Eigen::RowVector3d by_l = w * ends[i].transpose();
    by_l.head<2>() -= (w * dot / norm_sq) * l.head<2>().transpose();
    jacobian.row(i) = by_l * dl_dp;
  }

  return true;
}

struct Fit {
  OrthonormalLine line;
  Matrix4 information = Matrix4::Zero();
  double squared = 0.0;
  double worst = 0.0;
  bool valid = false;
};

/// Residuals, information and gradient at a line.
Fit evaluate(const std::vector<LineView>& views, const OrthonormalLine& line, Vector4& gradient) {
  Fit fit;
  fit.line = line;
  gradient.setZero();
  for (const LineView& view : views) {
    Eigen::Vector2d r;
    Eigen::Matrix<double, 2, 4> j;
    if (!residuals_of(view, line, r, j)) return fit;
    fit.information += j.transpose() * j;
    gradient += j.transpose() * r;
    fit.squared += r.squaredNorm();
    fit.worst = std::max(fit.worst, r.cwiseAbs().maxCoeff());
  }
  fit.valid = std::isfinite(fit.squared);
  return fit;
}

/// Gauss-Newton from a start, until the error no longer falls.
Fit refine(const std::vector<LineView>& views, const OrthonormalLine& start) {
  constexpr int kIterations = 8;
  Vector4 gradient;
  Fit fit = evaluate(views, start, gradient);
  for (int i = 0; i < kIterations && fit.valid; ++i) {
    const Vector4 step = -fit.information.ldlt().solve(gradient);
    if (!step.allFinite()) break;
    Vector4 next_gradient;
    const Fit next = evaluate(views, update(fit.line, step), next_gradient);
    if (!next.valid || next.squared > fit.squared) break;
    fit = next;
    gradient = next_gradient;
    if (step.cwiseAbs().maxCoeff() < 1e-10) break;
  }
  return fit;
}

/// Depth (z) in the camera's frame at which the line passes the ray through an image point: where the line
/// meets the plane of the ray and the image line's normal.
double depth_at(const PluckerLine& world, const LineView& view, const Eigen::Vector2d& image) {
  const PluckerLine line = transform(view.camera_from_world, world);
  const Eigen::Vector3d ray = image.homogeneous();
  const Eigen::Vector3d across(line.n.x(), line.n.y(), 0.0);
  const Eigen::Vector3d cut = ray.cross(across);  // plane through the centre that contains the ray
  const Eigen::Vector3d foot = line.v.cross(line.n) / line.v.squaredNorm();
  const double along = cut.dot(line.v);
  return foot.z() - line.v.z() * (cut.dot(foot) / along);
}

Eigen::Vector3d on_line(const PluckerLine& world, const LineView& view, const Eigen::Vector2d& image) {
  const double z = depth_at(world, view, image);
  return nearest_point(world, view.camera_from_world.inverse() * (z * image.homogeneous()));
}

/// First-order standard deviation of that depth.
double depth_sigma(const Fit& fit, const LineView& view, const Eigen::Vector2d& image) {
  constexpr double kStep = 1e-6;
  Vector4 derivative;
  for (int i = 0; i < 4; ++i) {
    const Vector4 d = kStep * Vector4::Unit(i);
    derivative(i) = (depth_at(to_plucker(update(fit.line, d)), view, image) -
                     depth_at(to_plucker(update(fit.line, -d)), view, image)) /
                    (2.0 * kStep);
  }
  return std::sqrt(derivative.dot(fit.information.ldlt().solve(derivative)));
}

/// True if a view that sees the segment [a, b] (world) at all sees it at the observed position; false behind
/// the camera.
bool overlaps(const LineView& view, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double min_depth,
              double min_overlap, bool& in_front) {
  const Eigen::Vector3d p = view.camera_from_world * a;
  const Eigen::Vector3d q = view.camera_from_world * b;
  in_front = p.z() >= min_depth && q.z() >= min_depth;
  if (!in_front) return false;
  const Eigen::Vector2d along = view.end - view.start;
  const double length = along.norm();
  const double s = along.dot(p.hnormalized() - view.start) / length;
  const double e = along.dot(q.hnormalized() - view.start) / length;
  const double common = std::min(std::max(s, e), length) - std::max(std::min(s, e), 0.0);
  // Directed: the darker side is on the same hand in all views.
  return e > s && common >= min_overlap * std::min(length, e - s);
}

/// Empty if a view is degenerate.
std::optional<std::vector<Plane>> interpretation_planes(const std::vector<LineView>& views) {
  std::vector<Plane> planes;
  for (const LineView& view : views) {
    const auto plane = interpretation_plane(view);
    if (!plane || !std::isfinite(plane->offset)) return std::nullopt;
    planes.push_back(*plane);
  }
  return planes;
}

/// In the frame of the first view, where numbers stay small however far away the world's origin is.
TriangulatedLine triangulate_local(const std::vector<LineView>& views,
                                   const LineTriangulationOptions& options) {
  TriangulatedLine result;
  const auto refused = [&result](Status status) {
    result.status = status;
    return result;
  };

  // Planes must meet at a sufficient angle.
  const auto planes = interpretation_planes(views);
  if (!planes) return refused(Status::kDegenerate);
  result.angle_rad = largest_angle(*planes);
  if (result.angle_rad < options.min_angle_rad) return refused(Status::kTooLittleParallax);

  // Refined in all views, judged by the residuals.
  const Fit fit = refine(views, to_orthonormal(meet(*planes)));
  if (!fit.valid) return refused(Status::kDegenerate);
  result.line = to_plucker(fit.line);
  const double redundant = 2.0 * static_cast<double>(views.size()) - 4.0;
  result.rms = redundant > 0.0 ? std::sqrt(fit.squared / redundant) : 0.0;
  if (fit.worst > options.max_residual) return refused(Status::kInconsistent);

  // Both ends must be at a possible depth.
  const LineView& first = views.front();
  const double start_depth = depth_at(result.line, first, first.start);
  const double end_depth = depth_at(result.line, first, first.end);
  for (const double z : {start_depth, end_depth}) {
    if (!(z >= options.min_depth_m && z <= options.max_depth_m)) return refused(Status::kOutOfRange);
  }

  // Depth of both ends must be certain enough.
  result.start = on_line(result.line, first, first.start);
  result.end = on_line(result.line, first, first.end);
  result.start_sigma = depth_sigma(fit, first, first.start);
  result.end_sigma = depth_sigma(fit, first, first.end);
  if (!(result.start_sigma <= options.max_relative_sigma * start_depth) ||
      !(result.end_sigma <= options.max_relative_sigma * end_depth)) {
    return refused(Status::kUncertain);
  }

  // Every view must see it where it was observed.
  for (const LineView& view : views) {
    bool in_front = false;
    if (overlaps(view, result.start, result.end, options.min_depth_m, options.min_overlap, in_front))
      continue;
    return refused(in_front ? Status::kInconsistent : Status::kOutOfRange);
  }

  // The direction runs from start to end.
  if (result.line.v.dot(result.end - result.start) < 0.0) result.line = {-result.line.n, -result.line.v};
  result.status = Status::kOk;
  return result;
}

}  // namespace

TriangulatedLine triangulate_line(const std::vector<LineView>& views,
                                  const LineTriangulationOptions& options) {
  if (views.size() < 2) return {};

  // World coordinates may be large, local ones are not.
  const Rigid3 world_from_first = views.front().camera_from_world.inverse();
  std::vector<LineView> local = views;
  for (LineView& view : local) view.camera_from_world = view.camera_from_world * world_from_first;
  local.front().camera_from_world = {};
  TriangulatedLine result = triangulate_local(local, options);
  if (!result.ok()) return result;

  // Back into the world.
  result.line = transform(world_from_first, result.line);
  result.start = world_from_first * result.start;
  result.end = world_from_first * result.end;
  return result;
}

}  // namespace plumbline::geometry
