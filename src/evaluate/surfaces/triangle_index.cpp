// SPDX-License-Identifier: BSD-3-Clause
#include "surfaces/triangle_index.hpp"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <limits>

#include "plumbline/core/shortage.hpp"

namespace plumbline::evaluate {
namespace {

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

/// Vertices and triangles are copied to the buffers of Embree.
TriangleIndex::TriangleIndex(const TriangleMesh& mesh)
    : mesh_(mesh), device_(core::made(rtcNewDevice("set_affinity=0"))), scene_(rtcNewScene(device_)) {
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = core::made(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                      sizeof(mesh.vertices[0]), mesh.vertices.size()));
  void* triangles = core::made(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                       sizeof(mesh.triangles[0]), mesh.triangles.size()));
  std::memcpy(vertices, mesh.vertices.data(), sizeof(mesh.vertices[0]) * mesh.vertices.size());
  std::memcpy(triangles, mesh.triangles.data(), sizeof(mesh.triangles[0]) * mesh.triangles.size());
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
}

TriangleIndex::~TriangleIndex() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

MeshPoint TriangleIndex::on(std::uint32_t triangle, const Eigen::Vector3d& q) const {
  const auto& [a, b, c] = mesh_.triangles[triangle];
  const Eigen::Vector3d p =
      nearest_on_triangle(q, mesh_.vertices[a].cast<double>(), mesh_.vertices[b].cast<double>(),
                          mesh_.vertices[c].cast<double>());
  return {triangle, p, (p - q).squaredNorm()};
}

/// Embree finds the boxes in reach, in float; distances are taken in double.
MeshPoint TriangleIndex::nearest(const Eigen::Vector3d& q) const {
  // The best triangle so far
  struct Search {
    const TriangleIndex& index;
    const Eigen::Vector3d& q;
    double slack;  ///< rounding error of the query's position as float
    MeshPoint best;
  } search{*this, q, 1e-6 * (1.0 + q.cwiseAbs().maxCoeff()), {}};
  search.best.squared_distance = std::numeric_limits<double>::infinity();

  // Each hit shrinks the radius of the search
  const auto visit = [](RTCPointQueryFunctionArguments* found) {
    auto& s = *static_cast<Search*>(found->userPtr);
    const MeshPoint p = s.index.on(found->primID, s.q);
    const bool tie = p.squared_distance == s.best.squared_distance;  // on an edge: the first triangle's
    if (!(p.squared_distance < s.best.squared_distance || (tie && p.triangle < s.best.triangle)))
      return false;

    // From here on only nearer boxes matter
    s.best = p;
    found->query->radius = static_cast<float>(std::sqrt(p.squared_distance) + s.slack);
    return true;
  };

  // The first radius is unlimited
  RTCPointQuery query{static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()), 0.0F,
                      std::numeric_limits<float>::infinity()};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_, &query, &context, visit, &search);
  return search.best;
}

/// Unit normal, or zero for a triangle without area.
Eigen::Vector3d TriangleIndex::normal(std::uint32_t triangle) const {
  const auto& [a, b, c] = mesh_.triangles[triangle];
  const Eigen::Vector3d p = mesh_.vertices[a].cast<double>();
  const Eigen::Vector3d n =
      (mesh_.vertices[b].cast<double>() - p).cross(mesh_.vertices[c].cast<double>() - p);
  const double length = n.norm();
  return length > 0.0 ? Eigen::Vector3d(n / length) : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

}  // namespace plumbline::evaluate
