// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <cmath>

#include "plumbline/evaluate/surface.hpp"

namespace plumbline::evaluate {

SurfaceSamples sample_mesh(const TriangleMesh& mesh, double spacing_m) {
  // Weyl sequence with the plastic number (Roberts' R2): even in every triangle, without a random seed.
  constexpr double kStepU = 0.7548776662466927;
  constexpr double kStepV = 0.5698402909980532;
  SurfaceSamples samples;
  double due = 0.5;  // samples owed by the area passed so far, so that small triangles get their share
  double u = 0.5;
  double v = 0.5;

  // Each triangle adds its area to the samples due
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[triangle[0]].cast<double>();
    const Eigen::Vector3d ab = mesh.vertices[triangle[1]].cast<double>() - a;
    const Eigen::Vector3d ac = mesh.vertices[triangle[2]].cast<double>() - a;
    const Eigen::Vector3d cross = ab.cross(ac);
    due += 0.5 * cross.norm() / (spacing_m * spacing_m);

    // Samples due in this triangle
    for (; due >= 1.0; due -= 1.0) {
      u = u + kStepU - std::floor(u + kStepU);
      v = v + kStepV - std::floor(v + kStepV);
      const bool beyond = u + v > 1.0;  // the other half of the parallelogram is folded back
      const double s = beyond ? 1.0 - u : u;
      const double t = beyond ? 1.0 - v : v;
      samples.points.emplace_back((a + s * ab + t * ac).cast<float>());
      samples.normals.emplace_back(cross.normalized().cast<float>());
      if (mesh.visible.empty()) continue;

      // The nearest corner decides the visibility
      const std::size_t corner = 1.0 - s - t >= std::max(s, t) ? 0 : (s >= t ? 1 : 2);
      samples.visible.push_back(mesh.visible[triangle[corner]]);
    }
  }
  return samples;
}

}  // namespace plumbline::evaluate
