// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Surfaces that clouds are measured against, in memory and from PLY files.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/cloud/io/frame.hpp"
#include "plumbline/cloud/types.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::evaluate {

/// A surface as points, metres. `normals` and `visible` are empty or as long as `points`.
struct SurfaceSamples {
  std::vector<Eigen::Vector3f> points;
  std::vector<Eigen::Vector3f> normals;             ///< unit; zero = unknown
  std::vector<std::uint8_t> visible;                ///< not 0: some camera could have seen it
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< a point is at `shift` + its coordinates
  cloud::CloudFrame frame = {};                     ///< as the file's header says
};

struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint8_t> visible;  ///< per vertex; empty or as long as `vertices`
};

/// Truth: a mesh if it has triangles, else samples.
struct Reference {
  std::string name;  ///< for messages
  SurfaceSamples samples;
  TriangleMesh mesh;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< as SurfaceSamples::shift, of both
  cloud::CloudFrame frame = {};                     ///< as SurfaceSamples::frame, of both
};

/// Reads a PLY (x y z, optional nx ny nz, `visible`, and faces, polygons being split into fans) or, without
/// faces and `visible`, whatever cloud::read_cloud reads. Errors (kInput) name the file and the place: not
/// such a file, no points, the number of points whose coordinates are not finite, a file that ends before
/// what its header promises, a face with a vertex out of range. Coordinates with more digits than a float
/// has, such as UTM's, are read less a shift, here and in load_cloud.
core::Result<Reference> load_reference(const std::filesystem::path& file);

/// The cloud under test, in the order of the file; points that are not finite stay, evaluate_cloud counts
/// them.
core::Result<SurfaceSamples> load_cloud(const std::filesystem::path& file);

/// Points and normals of a cloud in memory, in its order; unknown normals are zero, and all are left out if
/// none is known.
SurfaceSamples samples_of(const cloud::Cloud& cloud);

/// Moves points and normals.
void move(const geometry::Rigid3& target_from_source, SurfaceSamples& samples);

/// Points spread evenly over the mesh, about one per spacing_m^2, with the normals of their triangles.
/// Deterministic.
SurfaceSamples sample_mesh(const TriangleMesh& mesh, double spacing_m);

}  // namespace plumbline::evaluate
