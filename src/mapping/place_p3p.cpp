// SPDX-License-Identifier: BSD-3-Clause
#include "place_p3p.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace plumbline::mapping {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Rigid3;

/// Squared distances of the points and cosines between the rays, of the pairs 12, 13, 23.
struct Triangle {
  double a12, a13, a23;
  double c12, c13, c23;
};

/// A real root of x^3 + b x^2 + c x + d, the one where the cubic is steepest: it is known best.
double cubic_root(double b, double c, double d) {
  const double p = c - b * b / 3.0;
  const double q = (2.0 * b * b * b - 9.0 * b * c + 27.0 * d) / 27.0;
  const double discriminant = q * q / 4.0 + p * p * p / 27.0;
  double x = 0.0;
  if (discriminant > 0.0) {
    const double root = std::sqrt(discriminant);
    const double u = std::cbrt(-q / 2.0 + (q < 0.0 ? root : -root));
    x = u - (u != 0.0 ? p / (3.0 * u) : 0.0);
  } else {
    // Three roots; the outer one that lies away from the other two.
    const double r = std::sqrt(std::max(0.0, -p / 3.0));
    const double cosine = r > 0.0 ? std::clamp(-q / (2.0 * r * r * r), -1.0, 1.0) : 1.0;
    const double angle = std::acos(std::abs(cosine)) / 3.0;
    x = (cosine < 0.0 ? -2.0 : 2.0) * r * std::cos(angle);
  }
  x -= b / 3.0;
  for (int round = 0; round < 2; ++round) {
    const double slope = (3.0 * x + 2.0 * b) * x + c;
    if (slope == 0.0) break;
    x -= (((x + b) * x + c) * x + d) / slope;
  }
  return x;
}

/// Newton on l_i^2 + l_j^2 - 2 c_ij l_i l_j = a_ij.
Vector3d polished(Vector3d l, const Triangle& t) {
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    const Vector3d wrong(l[0] * l[0] + l[1] * l[1] - 2.0 * t.c12 * l[0] * l[1] - t.a12,
                         l[0] * l[0] + l[2] * l[2] - 2.0 * t.c13 * l[0] * l[2] - t.a13,
                         l[1] * l[1] + l[2] * l[2] - 2.0 * t.c23 * l[1] * l[2] - t.a23);
    Matrix3d slope;
    slope << l[0] - t.c12 * l[1], l[1] - t.c12 * l[0], 0.0,  //
        l[0] - t.c13 * l[2], 0.0, l[2] - t.c13 * l[0],       //
        0.0, l[1] - t.c23 * l[2], l[2] - t.c23 * l[1];
    const Vector3d next = l - 0.5 * (slope.inverse() * wrong);
    if (!next.allFinite()) break;
    l = next;
  }
  return l;
}

/// Distances that lie in a plane through the origin.
void add_distances(const Vector3d& plane, const Triangle& t, std::array<Vector3d, 4>& found,
                   std::size_t& count) {
  const double w0 = -plane[1] / plane[0];  // l1 = w0 l2 + w1 l3
  const double w1 = -plane[2] / plane[0];
  // a13 (l1^2 + l2^2 - 2 c12 l1 l2) = a12 (l1^2 + l3^2 - 2 c13 l1 l3), l2 = 1, l3 = x.
  const double square = (t.a13 - t.a12) * w1 * w1 + 2.0 * t.a12 * t.c13 * w1 - t.a12;
  const double linear = 2.0 * ((t.a13 - t.a12) * w0 * w1 - t.a13 * t.c12 * w1 + t.a12 * t.c13 * w0);
  const double constant = (t.a13 - t.a12) * w0 * w0 - 2.0 * t.a13 * t.c12 * w0 + t.a13;
  double under = linear * linear - 4.0 * square * constant;
  if (under < 0.0 && under > -1e-9 * linear * linear) under = 0.0;  // a tangent
  if (!(under >= 0.0)) return;
  const double half = -0.5 * (linear + std::copysign(std::sqrt(under), linear));
  for (const double x : {half / square, constant / half}) {
    const double d = 1.0 + x * (x - 2.0 * t.c23);
    if (!std::isfinite(x) || !(x > 0.0) || !(d > 0.0) || count == found.size()) continue;
    const double l2 = std::sqrt(t.a23 / d);
    const Vector3d l = polished({l2 * (w0 + w1 * x), l2, l2 * x}, t);
    if (l.minCoeff() > 0.0) found[count++] = l;
  }
}

/// The two planes of the pair that is the degenerate quadric `m`; false: they are not real.
bool split(const Matrix3d& m, std::array<Vector3d, 2>& planes) {
  // Minus the adjugate is p p^T, p the direction of the line in which the planes meet.
  Matrix3d b;
  b.col(0) = -m.col(1).cross(m.col(2));
  b.col(1) = -m.col(2).cross(m.col(0));
  b.col(2) = -m.col(0).cross(m.col(1));
  Eigen::Index most = 0;
  if (!(b.diagonal().maxCoeff(&most) > 0.0)) return false;
  const Vector3d p = b.col(most) / std::sqrt(b(most, most));
  Matrix3d rank1 = m;
  rank1(0, 1) -= p[2];
  rank1(0, 2) += p[1];
  rank1(1, 0) += p[2];
  rank1(1, 2) -= p[0];
  rank1(2, 0) -= p[1];
  rank1(2, 1) += p[0];
  Eigen::Index row = 0;
  Eigen::Index column = 0;
  rank1.cwiseAbs().maxCoeff(&row, &column);
  planes = {rank1.col(column), rank1.row(row).transpose()};
  return true;
}

}  // namespace

P3pPoses poses_from_points(const std::array<Vector3d, 3>& world, const std::array<Vector3d, 3>& rays) {
  P3pPoses result;
  const Vector3d d12 = world[0] - world[1];
  const Vector3d d13 = world[0] - world[2];
  const Triangle t{d12.squaredNorm(),    d13.squaredNorm(),    (world[1] - world[2]).squaredNorm(),
                   rays[0].dot(rays[1]), rays[0].dot(rays[2]), rays[1].dot(rays[2])};
  // M_ij: l^T M_ij l = a_ij. Both quadrics of the pencil vanish at the distances.
  Matrix3d m12;
  Matrix3d m13;
  Matrix3d m23;
  m12 << 1.0, -t.c12, 0.0, -t.c12, 1.0, 0.0, 0.0, 0.0, 0.0;
  m13 << 1.0, 0.0, -t.c13, 0.0, 0.0, 0.0, -t.c13, 0.0, 1.0;
  m23 << 0.0, 0.0, 0.0, 0.0, 1.0, -t.c23, 0.0, -t.c23, 1.0;
  const Matrix3d one = t.a23 * m12 - t.a12 * m23;
  const Matrix3d two = t.a23 * m13 - t.a13 * m23;
  // det(one + g two) = 0.
  const auto mixed = [](const Matrix3d& x, const Matrix3d& y) {  // coefficient of g in det(x + g y)
    return y.col(0).dot(x.col(1).cross(x.col(2))) + x.col(0).dot(y.col(1).cross(x.col(2))) +
           x.col(0).dot(x.col(1).cross(y.col(2)));
  };
  const double cube = two.col(0).dot(two.col(1).cross(two.col(2)));
  const double g = cubic_root(mixed(two, one) / cube, mixed(one, two) / cube,
                              one.col(0).dot(one.col(1).cross(one.col(2))) / cube);
  std::array<Vector3d, 2> planes;
  if (!std::isfinite(g) || !split(one + g * two, planes)) return result;
  std::array<Vector3d, 4> distances;
  std::size_t count = 0;
  for (const Vector3d& plane : planes) add_distances(plane, t, distances, count);
  Matrix3d corner;
  corner << d12, d13, d12.cross(d13);
  const Matrix3d inverse = corner.inverse();
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3d first = distances[i][0] * rays[0];
    const Vector3d e12 = first - distances[i][1] * rays[1];
    const Vector3d e13 = first - distances[i][2] * rays[2];
    Matrix3d seen;
    seen << e12, e13, e12.cross(e13);
    Rigid3& pose = result.camera_from_world[result.count];
    pose.rotation = seen * inverse;
    pose.translation = first - pose.rotation * world[0];
    if (pose.rotation.allFinite() && pose.translation.allFinite()) ++result.count;
  }
  return result;
}

}  // namespace plumbline::mapping
