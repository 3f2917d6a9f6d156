// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Small surfaces with known truth for the tests of evaluate.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "plumbline/evaluate/surface.hpp"

namespace plumbline::evaluate::worlds {

/// Numbers in [0, 1), the same on every machine.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double operator()() { return static_cast<double>(engine_()) / 4294967296.0; }
  double gauss() {  // Box-Muller
    const double radius = std::sqrt(-2.0 * std::log(1.0 - (*this)()));
    return radius * std::cos(6.283185307179586 * (*this)());
  }

 private:
  std::mt19937 engine_;
};

inline Eigen::Isometry3d tilt() {
  return Eigen::Translation3d(0.3, -5.0, 2.0) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(3, 1, 2).normalized());
}

/// Rectangle from `origin` along the edges u and v, points every `spacing`, in the middle of their cells.
inline void add_rectangle(SurfaceSamples& out, const Eigen::Vector3d& origin, const Eigen::Vector3d& u,
                          const Eigen::Vector3d& v, double spacing) {
  const auto nu = static_cast<int>(std::lround(u.norm() / spacing));
  const auto nv = static_cast<int>(std::lround(v.norm() / spacing));
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) {
      out.points.emplace_back((origin + (i + 0.5) / nu * u + (j + 0.5) / nv * v).cast<float>());
      out.normals.emplace_back(u.cross(v).normalized().cast<float>());
    }
  }
}

inline SurfaceSamples plane(double width, double height_z, double spacing) {
  SurfaceSamples out;
  add_rectangle(out, {0, 0, height_z}, {width, 0, 0}, {0, width, 0}, spacing);
  return out;
}

inline SurfaceSamples random_plane(double width, double height_z, std::size_t count, unsigned seed) {
  SurfaceSamples out;
  Random random(seed);
  for (std::size_t i = 0; i < count; ++i) {
    const double x = width * random();
    out.points.emplace_back(Eigen::Vector3d(x, width * random(), height_z).cast<float>());
  }
  return out;
}

/// Six faces of a box with one corner at the origin, normals inwards.
inline SurfaceSamples box(const Eigen::Vector3d& size, double spacing) {
  const Eigen::Vector3d x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z());
  SurfaceSamples out;
  add_rectangle(out, {0, 0, 0}, x, y, spacing);
  add_rectangle(out, z, y, x, spacing);
  add_rectangle(out, {0, 0, 0}, y, z, spacing);
  add_rectangle(out, x, z, y, spacing);
  add_rectangle(out, {0, 0, 0}, z, x, spacing);
  add_rectangle(out, y, x, z, spacing);
  return out;
}

inline TriangleMesh box_mesh(const Eigen::Vector3f& size) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.emplace_back((i & 1) ? size.x() : 0.0F, (i & 2) ? size.y() : 0.0F,
                               (i & 4) ? size.z() : 0.0F);
  }
  const auto quad = [&mesh](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  quad(0, 1, 3, 2);
  quad(4, 6, 7, 5);
  quad(0, 4, 5, 1);
  quad(2, 3, 7, 6);
  quad(0, 2, 6, 4);
  quad(1, 5, 7, 3);
  return mesh;
}

/// One square of two triangles at height 0.
inline TriangleMesh square_mesh(float width) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {width, 0, 0}, {width, width, 0}, {0, width, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

inline void append(SurfaceSamples& out, const SurfaceSamples& more) {
  out.points.insert(out.points.end(), more.points.begin(), more.points.end());
  out.normals.insert(out.normals.end(), more.normals.begin(), more.normals.end());
}

inline SurfaceSamples moved(SurfaceSamples samples, const Eigen::Isometry3d& by) {
  for (auto& p : samples.points) p = (by * p.cast<double>()).cast<float>();
  for (auto& n : samples.normals) n = (by.linear() * n.cast<double>()).cast<float>();
  return samples;
}

inline Reference reference_of(SurfaceSamples samples) {
  Reference reference;
  reference.name = "reference";
  reference.samples = std::move(samples);
  return reference;
}

inline Reference reference_of(TriangleMesh mesh) {
  Reference reference;
  reference.name = "reference";
  reference.mesh = std::move(mesh);
  return reference;
}

}  // namespace plumbline::evaluate::worlds
