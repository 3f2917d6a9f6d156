// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Surfaces that clouds are measured against, in memory and from PLY files.
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::evaluate {

/// A surface as points, metres. `normals` and `visible` are empty or as long as `points`.
struct SurfaceSamples {
  std::vector<Eigen::Vector3f> points;
  std::vector<Eigen::Vector3f> normals;  ///< unit; zero = unknown
  std::vector<std::uint8_t> visible;     ///< not 0: some camera could have seen it
};

struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint8_t> visible;  ///< per vertex; empty or as long as `vertices`
};

/// Truth: a mesh when it has triangles, else samples.
struct Reference {
  std::string name;  ///< for messages
  SurfaceSamples samples;
  TriangleMesh mesh;
};

/// Points of a PLY file and what was dropped.
struct LoadedCloud {
  SurfaceSamples samples;
  std::size_t not_finite = 0;  ///< points dropped since a coordinate is NaN or infinite
};

/// Reads a PLY (ascii or binary, either byte order; x y z, optional nx ny nz, `visible`, and faces, polygons
/// being split into fans). Errors name the file and the place: not a PLY, no points, the number of points
/// whose coordinates are not finite, a file that ends before what its header promises, a face with a vertex
/// out of range.
core::Result<Reference> load_reference(const std::filesystem::path& ply);

/// The same for a cloud under test: faces are ignored, points that are not finite are dropped and counted.
core::Result<LoadedCloud> load_cloud(const std::filesystem::path& ply);

/// Points spread evenly over the mesh, about one per spacing_m^2, with the normals of their triangles.
/// Deterministic.
SurfaceSamples sample_mesh(const TriangleMesh& mesh, double spacing_m);

}  // namespace plumbline::evaluate
