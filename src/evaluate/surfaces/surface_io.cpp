// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <string>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/cloud/io/ply.hpp"
#include "plumbline/core/text.hpp"
#include "plumbline/evaluate/surface.hpp"

namespace plumbline::evaluate {
namespace {

using Points = std::vector<Eigen::Vector3f>;

/// Three columns as vectors; empty when one is missing.
Points vectors(const cloud::PlyData& ply, const char* x, const char* y, const char* z) {
  const std::vector<float>* columns[] = {ply.floats(x), ply.floats(y), ply.floats(z)};
  for (const std::vector<float>* column : columns) {
    if (column == nullptr) return {};
  }
  Points out(ply.vertex_count);
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = {(*columns[0])[i], (*columns[1])[i], (*columns[2])[i]};
  return out;
}

/// The property visible, stored as a byte or as a float.
std::vector<std::uint8_t> visibility(const cloud::PlyData& ply) {
  if (const auto* bytes = ply.bytes("visible")) return *bytes;
  std::vector<std::uint8_t> out;
  if (const auto* floats = ply.floats("visible")) {
    for (const float value : *floats) out.push_back(value > 0.5F ? 1 : 0);
  }
  return out;
}

/// Unit normals, zero where unknown; left out when none is known.
void tidy_normals(Points& normals) {
  bool any = false;
  for (Eigen::Vector3f& n : normals) {
    const float length = n.norm();
    const bool known = n.allFinite() && length > 1e-6F;
    n = known ? Eigen::Vector3f(n / length) : Eigen::Vector3f(Eigen::Vector3f::Zero());
    any = any || known;
  }
  if (!any) normals.clear();
}

/// A reference must have finite points.
core::Result<void> check_reference(const std::filesystem::path& file, const Points& points) {
  if (points.empty()) return core::input_error(fmt::format("{}: the reference has no points", file.string()));
  const auto bad = std::count_if(points.begin(), points.end(), [](const auto& p) { return !p.allFinite(); });
  if (bad > 0) {
    return core::input_error(
        fmt::format("{}: {} of {} points have a coordinate that is not finite (NaN or infinite); remove them "
                    "from the reference",
                    file.string(), bad, points.size()));
  }
  return {};
}

}  // namespace

core::Result<Reference> load_reference(const std::filesystem::path& file) {
  // The name serves messages
  Reference reference;
  reference.name = file.string();

  // Other formats hold points only
  if (core::ending_of(file) != ".ply") {
    auto samples = load_cloud(file);
    if (!samples) return tl::unexpected(samples.error());
    if (const auto ok = check_reference(file, samples->points); !ok) return tl::unexpected(ok.error());
    reference.shift = samples->shift;
    reference.frame = samples->frame;
    reference.samples = std::move(*samples);
    return reference;
  }

  // A PLY file may hold a mesh
  const auto ply = cloud::read_ply(file, true);
  if (!ply) return tl::unexpected(ply.error());
  if (ply->vertex_count == 0)
    return core::input_error(fmt::format("{}: the reference has no points", file.string()));

  // Every reference needs positions
  Points points = vectors(*ply, "x", "y", "z");
  if (points.empty())
    return core::input_error(fmt::format("{}: has no properties x, y and z", file.string()));
  if (const auto ok = check_reference(file, points); !ok) return tl::unexpected(ok.error());

  // Faces make it a mesh
  reference.shift = Eigen::Map<const Eigen::Vector3d>(ply->shift.data());
  reference.frame = cloud::frame_in(ply->comments);
  if (!ply->triangles.empty()) {
    reference.mesh = {std::move(points), ply->triangles, visibility(*ply)};
    return reference;
  }

  // Without faces it is a cloud
  reference.samples = {std::move(points), vectors(*ply, "nx", "ny", "nz"), visibility(*ply), reference.shift,
                       reference.frame};
  tidy_normals(reference.samples.normals);
  return reference;
}

/// A cloud with its shift and frame; normals that are not finite become zero.
core::Result<SurfaceSamples> load_cloud(const std::filesystem::path& file) {
  const auto read = cloud::read_cloud(file, cloud::LargeCoordinates::kShifted);
  if (!read) return tl::unexpected(read.error());
  if (read->cloud->empty())
    return core::input_error(fmt::format("{}: the cloud has no points", file.string()));
  SurfaceSamples samples = samples_of(*read->cloud);
  samples.shift = read->shift;
  samples.frame = read->frame;
  return samples;
}

/// Points and normals of a cloud.
SurfaceSamples samples_of(const cloud::Cloud& cloud) {
  SurfaceSamples samples;
  samples.points.reserve(cloud.size());
  samples.normals.reserve(cloud.size());
  for (const cloud::Point& p : cloud) {
    samples.points.emplace_back(p.x, p.y, p.z);
    samples.normals.emplace_back(p.normal_x, p.normal_y, p.normal_z);
  }
  tidy_normals(samples.normals);
  return samples;
}

}  // namespace plumbline::evaluate
