// SPDX-License-Identifier: BSD-3-Clause
#include "clouds/mesh.hpp"

#include <fmt/format.h>

#include "formats.hpp"
#include "plumbline/cloud/io/mesh.hpp"

namespace plumbline::exports {
namespace {

/// Writes the mesh as PLY or OBJ.
core::Result<ExportSummary> write_mesh_file(MapSource& source, const std::filesystem::path& output) {
  auto mesh = mesh_of(source);
  if (!mesh) return tl::unexpected(mesh.error());
  mesh->comments = {"plumbline, metres"};
  for (std::string& comment : source.frame().comments()) mesh->comments.push_back(std::move(comment));
  if (auto written = cloud::write_mesh(output, *mesh); !written) return tl::unexpected(written.error());
  ExportSummary summary;
  summary.written = {output};
  if (const auto cloud = source.cloud()) note_colorless(**cloud, summary);
  summary.notes.push_back(fmt::format("{} triangles", mesh->triangles.size()));
  return summary;
}

}  // namespace

/// The mesh of the selected points by Poisson reconstruction, which needs normals.
core::Result<cloud::PlyData> mesh_of(MapSource& source) {
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());
  if (!(*cloud)->has_normals) {
    return core::input_error(fmt::format(
        "{}: a mesh needs normals, which this cloud has not; run a filter chain with normals over it first",
        source.request().input.string()));
  }

  // The user's resolution, or the default
  constexpr double kDefault_m = 0.02;
  const ExportOptions& options = source.options();
  cloud::MeshOptions mesh_options;
  mesh_options.resolution_m = options.resolution_m > 0.0 ? options.resolution_m : kDefault_m;
  mesh_options.reach_m = options.reach_m;

  // The library of the reconstruction prints to the terminal
  core::Result<cloud::PlyData> mesh;
  const auto work = [&] { mesh = cloud::make_mesh(*(*cloud)->cloud, mesh_options); };
  if (source.request().quietly) {
    source.request().quietly(work);
  } else {
    work();
  }

  // Vertices are less the cloud's shift
  if (mesh) mesh->shift = {(*cloud)->shift.x(), (*cloud)->shift.y(), (*cloud)->shift.z()};
  return mesh;
}

Format mesh_format() {
  return {"mesh",
          {".ply", ".obj"},
          {Content::kMesh},
          "",
          "Mesh with vertex colours",
          "Poisson reconstruction, cut off where nothing was seen. `.obj` has the colours after the "
          "coordinates, as MeshLab and Blender read them.",
          {"voxel", "resolution", "reach"},
          &write_mesh_file};
}

}  // namespace plumbline::exports
