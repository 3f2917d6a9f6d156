// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "finite.hpp"
#include "io/shift.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::cloud {
namespace {

// Throws if a column has another length than the cloud.
void check_columns(const Cloud& cloud, const CloudColumns& columns) {
  const auto fits = [&cloud](std::size_t n) { return n == 0 || n == cloud.size(); };
  if (!fits(columns.confidence.size()) || !fits(columns.observations.size()) || !fits(columns.robot.size()) ||
      !std::all_of(columns.others.begin(), columns.others.end(),
                   [&](const auto& other) { return other.values.size() == cloud.size(); })) {
    throw std::invalid_argument("cloud columns have another length than the cloud");
  }
}

/// Writes the position as floats, or as doubles with the shift added.
void put_position(const Point& p, const Eigen::Vector3d& shift, core::OutputFile& out) {
  if (shift.isZero(0.0)) {
    out.put(std::array<float, 3>{p.x, p.y, p.z});
  } else {
    out.put(std::array<double, 3>{with_shift(p.x, shift.x()), with_shift(p.y, shift.y()),
                                  with_shift(p.z, shift.z())});
  }
}

/// Writes the additional columns of point `i`.
void put_columns(const CloudColumns& columns, std::size_t i, core::OutputFile& out) {
  if (!columns.confidence.empty()) out.put(columns.confidence[i]);
  if (!columns.observations.empty()) out.put(columns.observations[i]);
  if (!columns.robot.empty()) out.put(columns.robot[i]);
  for (const auto& other : columns.others) out.put(other.values[i]);
}

}  // namespace

core::Result<void> write_ply(const std::filesystem::path& file, const Cloud& cloud,
                             const CloudColumns& columns, const Eigen::Vector3d& shift,
                             const std::vector<std::string>& comments) {
  check_columns(cloud, columns);
  core::OutputFile out(file);
  out.write("ply\nformat binary_little_endian 1.0\ncomment plumbline, metres\n");
  for (const std::string& comment : comments) out.write("comment " + comment + "\n");

  // Points that are not finite are left out
  out.write(fmt::format("element vertex {}\n", count_finite(cloud)));

  // Shifted positions need doubles
  const char* type = shift.isZero(0.0) ? "float" : "double";
  out.write(fmt::format("property {0} x\nproperty {0} y\nproperty {0} z\n", type));
  out.write(
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n");

  // Only columns that the cloud has
  if (!columns.confidence.empty()) out.write("property float confidence\n");
  if (!columns.observations.empty()) out.write("property int observations\n");
  if (!columns.robot.empty()) out.write("property uchar robot\n");
  for (const auto& other : columns.others) out.write("property float " + other.name + "\n");
  out.write("end_header\n");

  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Point& p = cloud[i];
    if (!finite(p)) continue;

    // An unknown normal is written as zero
    const bool normal = std::isfinite(p.normal_x + p.normal_y + p.normal_z);
    put_position(p, shift, out);
    out.put(normal ? std::array<float, 3>{p.normal_x, p.normal_y, p.normal_z} : std::array<float, 3>{});
    out.put(std::array<std::uint8_t, 3>{p.r, p.g, p.b});
    put_columns(columns, i, out);
  }

  return out.commit();
}

core::Result<void> write_pcd(const std::filesystem::path& file, const Cloud& cloud,
                             const CloudColumns& columns, const Eigen::Vector3d& shift,
                             const std::vector<std::string>& comments) {
  check_columns(cloud, columns);
  const bool organised = cloud.height > 1;
  const std::size_t points = organised ? cloud.size() : count_finite(cloud);
  std::string fields = "x y z rgb normal_x normal_y normal_z curvature";
  std::string sizes = shift.isZero(0.0) ? "4 4 4 4 4 4 4 4" : "8 8 8 4 4 4 4 4";
  std::string types = "F F F F F F F F";
  std::string counts = "1 1 1 1 1 1 1 1";

  // Columns follow the fields of a point
  const auto field = [&](bool present, const std::string& name, const char* size, const char* type) {
    if (!present) return;
    fields += " " + name;
    sizes += std::string(" ") + size;
    types += std::string(" ") + type;
    counts += " 1";
  };

  field(!columns.confidence.empty(), "confidence", "4", "F");
  field(!columns.observations.empty(), "observations", "4", "U");
  field(!columns.robot.empty(), "robot", "1", "U");
  for (const auto& other : columns.others) field(true, other.name, "4", "F");

  // The viewpoint, with its shift
  core::OutputFile out(file);
  const auto& t = cloud.sensor_origin_;
  const auto& q = cloud.sensor_orientation_;
  const auto origin = [&](int k) {  // a float is printed with fewer digits
    return shift[k] == 0.0 ? fmt::format("{}", t[k]) : fmt::format("{}", with_shift(t[k], shift[k]));
  };

  out.write("# .PCD v0.7 - Point Cloud Data file format\n");
  for (const std::string& comment : comments) out.write("# " + comment + "\n");
  out.write(fmt::format(
      "VERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\n"
      "COUNT {}\nWIDTH {}\nHEIGHT {}\nVIEWPOINT {} {} {} {} {} {} {}\nPOINTS {}\nDATA binary\n",
      fields, sizes, types, counts, organised ? cloud.width : points, organised ? cloud.height : 1, origin(0),
      origin(1), origin(2), q.w(), q.x(), q.y(), q.z(), points));

  // Organised clouds keep points without position
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Point& p = cloud[i];
    if (!organised && !finite(p)) continue;
    put_position(p, shift, out);
    out.put(static_cast<std::uint32_t>(p.r) << 16 | static_cast<std::uint32_t>(p.g) << 8 |
            static_cast<std::uint32_t>(p.b));
    out.put(std::array<float, 4>{p.normal_x, p.normal_y, p.normal_z, p.curvature});
    put_columns(columns, i, out);
  }

  return out.commit();
}

core::Result<void> write_cloud(const std::filesystem::path& file, const Cloud& cloud,
                               const CloudColumns& columns, const Eigen::Vector3d& shift,
                               const std::vector<std::string>& comments) {
  // The ending decides the format
  const std::string ending = core::ending_of(file);
  if (ending == ".ply") return write_ply(file, cloud, columns, shift, comments);
  if (ending == ".pcd") return write_pcd(file, cloud, columns, shift, comments);
  return core::usage_error(fmt::format(
      "{}: ending '{}' is not one that clouds are written as; use .ply or .pcd", file.string(), ending));
}

}  // namespace plumbline::cloud
