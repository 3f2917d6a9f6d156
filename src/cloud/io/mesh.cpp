// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/io/mesh.hpp"

#include <fmt/format.h>
#include <pcl/common/io.h>
#include <pcl/conversions.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "filters/pcl_functions.hpp"
#include "io/shift.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::cloud {
namespace {

constexpr int kDeepest = 12;

/// The points that have a normal.
std::shared_ptr<Cloud> oriented(const Cloud& cloud) {
  auto kept = std::make_shared<Cloud>();
  for (const Point& p : cloud.points) {
    const float all = p.x + p.y + p.z + p.normal_x + p.normal_y + p.normal_z;
    if (std::isfinite(all) && p.getNormalVector3fMap().squaredNorm() > 0.25F) kept->points.push_back(p);
  }
  kept->width = static_cast<std::uint32_t>(kept->size());
  kept->height = 1;
  return kept;
}

/// Octree depth whose leaves are `resolution_m` long; Poisson's cube is 1.1 times the extent.
core::Result<int> depth_for(const Cloud& cloud, double resolution_m) {
  Eigen::AlignedBox3f box;
  for (const Point& p : cloud.points) box.extend(Eigen::Vector3f(p.getVector3fMap()));
  const double side = 1.1 * static_cast<double>(box.sizes().maxCoeff());
  const int depth = std::max(4, static_cast<int>(std::ceil(std::log2(std::max(1.0, side / resolution_m)))));
  if (depth <= kDeepest) return depth;
  return core::usage_error(fmt::format("mesh: {:g} m is too fine for {:.1f} m; use {:.3f} m or more",
                                       resolution_m, side, side / (1 << kDeepest)));
}

/// x, y and z of a PCL mesh.
std::vector<Eigen::Vector3f> vertices_of(const pcl::PolygonMesh& mesh) {
  pcl::PointCloud<pcl::PointXYZ> points;
  pcl::fromPCLPointCloud2(mesh.cloud, points);
  std::vector<Eigen::Vector3f> vertices;
  vertices.reserve(points.size());
  for (const auto& p : points) vertices.emplace_back(p.x, p.y, p.z);
  return vertices;
}

constexpr std::uint32_t kGone = 0xFFFFFFFFU;

/// Triangles of which all vertices are kept, by the vertices' new numbers.
std::vector<std::array<std::uint32_t, 3>> triangles_of(const pcl::PolygonMesh& mesh,
                                                       const std::vector<std::uint32_t>& number) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const pcl::Vertices& polygon : mesh.polygons) {
    std::array<std::uint32_t, 3> corners{};
    if (polygon.vertices.size() != corners.size()) continue;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = number[static_cast<std::size_t>(polygon.vertices[k])];
    if (std::find(corners.begin(), corners.end(), kGone) == corners.end()) triangles.push_back(corners);
  }
  return triangles;
}

/// Vertices near points get these points' colour and normal; the others go, and the triangles that need them.
PlyData dressed(const std::vector<Eigen::Vector3f>& vertices, const pcl::PolygonMesh& mesh,
                const std::shared_ptr<Cloud>& cloud, double reach_m) {
  constexpr int kNeighbours = 4;
  pcl::KdTreeFLANN<Point> tree;
  tree.setInputCloud(cloud);
  std::vector<std::uint32_t> number(vertices.size(), kGone);
  std::array<std::vector<float>, 6> xyz_normal;
  std::array<std::vector<std::uint8_t>, 3> rgb;
  pcl::Indices near;
  std::vector<float> squared;

  // Poisson's surface far from points was never seen
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    Point at;
    at.getVector3fMap() = vertices[v];
    const int found = tree.nearestKSearch(at, kNeighbours, near, squared);
    if (found == 0 || !(squared[0] <= static_cast<float>(reach_m * reach_m))) continue;

    // Mean normal and colour of the nearest points
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    Eigen::Vector3f color = Eigen::Vector3f::Zero();
    for (const int i : near) {
      const Point& p = (*cloud)[static_cast<std::size_t>(i)];
      normal += p.getNormalVector3fMap();
      color += Eigen::Vector3f(p.r, p.g, p.b) / static_cast<float>(found);
    }

    normal.normalize();
    number[v] = static_cast<std::uint32_t>(rgb[0].size());
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      xyz_normal[k].push_back(vertices[v][axis]);
      xyz_normal[3 + k].push_back(normal[axis]);
      rgb[k].push_back(static_cast<std::uint8_t>(std::lround(std::clamp(color[axis], 0.0F, 255.0F))));
    }
  }

  // Columns, and triangles of the remaining vertices
  PlyData result;
  const std::array<const char*, 6> names{"x", "y", "z", "nx", "ny", "nz"};
  for (std::size_t k = 0; k < 6; ++k) result.add(names[k], std::move(xyz_normal[k]));
  const std::array<const char*, 3> channels{"red", "green", "blue"};
  for (std::size_t k = 0; k < 3; ++k) result.add(channels[k], std::move(rgb[k]));
  result.triangles = triangles_of(mesh, number);
  return result;
}

core::Result<void> write_obj(const std::filesystem::path& file, const PlyData& mesh) {
  std::array<const std::vector<float>*, 6> columns{};
  const std::array<const char*, 6> names{"x", "y", "z", "nx", "ny", "nz"};
  for (std::size_t k = 0; k < 6; ++k) columns[k] = mesh.floats(names[k]);
  const auto *red = mesh.bytes("red"), *green = mesh.bytes("green"), *blue = mesh.bytes("blue");
  core::OutputFile out(file);
  out.write("# metres; x y z red green blue\n");

  // A vertex with its colour, then its normal
  for (std::size_t v = 0; v < mesh.vertex_count; ++v) {
    const auto at = [&](std::size_t k) {
      const float value = (*columns[k])[v];
      const double shift = k < mesh.shift.size() ? mesh.shift[k] : 0.0;
      return shift == 0.0 ? static_cast<double>(value) : with_shift(value, shift);
    };
    const auto channel = [v](const std::vector<std::uint8_t>& c) { return c[v] / 255.0; };

    out.write(fmt::format("v {:.5f} {:.5f} {:.5f} {:.4f} {:.4f} {:.4f}\nvn {:.4f} {:.4f} {:.4f}\n", at(0),
                          at(1), at(2), channel(*red), channel(*green), channel(*blue), at(3), at(4), at(5)));
  }

  // OBJ counts vertices from 1
  for (const auto& [a, b, c] : mesh.triangles) {
    out.write(fmt::format("f {0}//{0} {1}//{1} {2}//{2}\n", a + 1, b + 1, c + 1));
  }

  return out.commit();
}

}  // namespace

void MeshOptions::declare(core::OptionTable& table) {
  table.number("resolution", resolution_m, {0.001, 10.0}, "m", "Approximate length of the mesh's edges");
  table.number("reach", reach_m, {0.001, 10.0}, "m",
               "Largest distance of the surface from the nearest point");
}

core::Result<PlyData> make_mesh(const Cloud& cloud, const MeshOptions& options) {
  constexpr std::size_t kFewest = 100;

  // Poisson's method needs oriented normals
  const std::shared_ptr<Cloud> points = oriented(cloud);
  if (points->size() < kFewest) {
    return core::usage_error(fmt::format("mesh: {} points with normals are too few; {} are needed at least",
                                         points->size(), kFewest));
  }
  const auto depth = depth_for(*points, options.resolution_m);
  if (!depth) return tl::unexpected<core::Error>(depth.error());
  const auto& pcl = pcl_functions();
  if (!pcl) return tl::unexpected<core::Error>(pcl.error());
  const auto surface = std::make_shared<pcl::PointCloud<pcl::PointNormal>>();
  pcl::copyPointCloud(*points, *surface);
  const pcl::PolygonMesh mesh = (*pcl)->poisson(surface, *depth);
  return dressed(vertices_of(mesh), mesh, points, options.reach_m);
}

core::Result<void> write_mesh(const std::filesystem::path& file, const PlyData& mesh) {
  const std::string ending = core::ending_of(file);
  if (ending == ".ply") return write_ply(file, mesh);
  if (ending == ".obj") return write_obj(file, mesh);
  return core::usage_error(fmt::format("{}: meshes are written as .ply or .obj", file.string()));
}

}  // namespace plumbline::cloud
