// SPDX-License-Identifier: BSD-3-Clause
#include "triangle_index.hpp"

#include <Eigen/Geometry>

namespace plumbline::evaluate {
namespace {

constexpr std::size_t kTrianglesALeaf = 4;

Box box_of(const TriangleMesh& mesh, std::size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Eigen::Vector3f& p = mesh.vertices[a];
  const Eigen::Vector3f& q = mesh.vertices[b];
  const Eigen::Vector3f& r = mesh.vertices[c];
  return {p.cwiseMin(q).cwiseMin(r), p.cwiseMax(q).cwiseMax(r)};
}

Eigen::Vector3d nearest_on_segment(const Eigen::Vector3d& q, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double length_sq = ab.squaredNorm();
  if (!(length_sq > 0.0)) return a;
  return a + std::clamp(ab.dot(q - a) / length_sq, 0.0, 1.0) * ab;
}

}  // namespace

Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& q, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double area_sq = normal.squaredNorm();
  if (area_sq > 0.0) {
    // Barycentric coordinates of the foot of the perpendicular; inside, it is the nearest point.
    const double u = normal.dot((c - b).cross(q - b)) / area_sq;
    const double v = normal.dot((a - c).cross(q - c)) / area_sq;
    const double w = normal.dot((b - a).cross(q - a)) / area_sq;
    if (u >= 0.0 && v >= 0.0 && w >= 0.0) return q - normal * (normal.dot(q - a) / area_sq);
  }
  Eigen::Vector3d best = nearest_on_segment(q, a, b);
  for (const Eigen::Vector3d& p : {nearest_on_segment(q, b, c), nearest_on_segment(q, c, a)}) {
    if ((p - q).squaredNorm() < (best - q).squaredNorm()) best = p;
  }
  return best;
}

TriangleIndex::TriangleIndex(const TriangleMesh& mesh)
    : mesh_(mesh),
      tree_(mesh.triangles.size(), kTrianglesALeaf, [&mesh](std::size_t i) { return box_of(mesh, i); }) {}

MeshPoint TriangleIndex::on(std::uint32_t triangle, const Eigen::Vector3d& q) const {
  const auto& [a, b, c] = mesh_.triangles[triangle];
  const Eigen::Vector3d p =
      nearest_on_triangle(q, mesh_.vertices[a].cast<double>(), mesh_.vertices[b].cast<double>(),
                          mesh_.vertices[c].cast<double>());
  return {triangle, p, (p - q).squaredNorm()};
}

MeshPoint TriangleIndex::nearest(const Eigen::Vector3d& q, std::uint32_t guess) const {
  MeshPoint best = on(guess, q);
  tree_.search(q, best.squared_distance, [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t i = first; i < last; ++i) {
      const MeshPoint p = on(tree_.order()[i], q);
      if (p.squared_distance < best.squared_distance) best = p;
    }
  });
  return best;
}

Eigen::Vector3d TriangleIndex::normal(std::uint32_t triangle) const {
  const auto& [a, b, c] = mesh_.triangles[triangle];
  const Eigen::Vector3d p = mesh_.vertices[a].cast<double>();
  const Eigen::Vector3d n =
      (mesh_.vertices[b].cast<double>() - p).cross(mesh_.vertices[c].cast<double>() - p);
  const double length = n.norm();
  return length > 0.0 ? Eigen::Vector3d(n / length) : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

}  // namespace plumbline::evaluate
