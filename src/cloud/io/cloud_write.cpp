// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "finite.hpp"
#include "plumbline/cloud/cloud_io.hpp"
#include "plumbline/core/output_file.hpp"

namespace plumbline::cloud {
namespace {

void check_columns(const Cloud& cloud, const CloudColumns& columns) {
  const auto fits = [&cloud](std::size_t n) { return n == 0 || n == cloud.size(); };
  if (!fits(columns.confidence.size()) || !fits(columns.observations.size()) || !fits(columns.robot.size()) ||
      !std::all_of(columns.others.begin(), columns.others.end(),
                   [&](const auto& other) { return other.values.size() == cloud.size(); })) {
    throw std::invalid_argument("cloud columns have another length than the cloud");
  }
}

/// Records of points on their way into a file, many at a time.
class Records {
 public:
  Records(core::OutputFile& out, const CloudColumns& columns)
      : out_(out),
        columns_(columns),
        most_(kPoint + 9 + sizeof(float) * columns.others.size()),
        buffer_(kBuffer + most_) {}
  /// Of the next point.
  void begin() {
    if (at_ >= kBuffer) finish();
  }
  template <typename T>
  void put(const T& value) {
    std::memcpy(buffer_.data() + at_, &value, sizeof(value));
    at_ += sizeof(value);
  }
  /// What is known of point `i` besides.
  void put_columns(std::size_t i) {
    if (!columns_.confidence.empty()) put(columns_.confidence[i]);
    if (!columns_.observations.empty()) put(columns_.observations[i]);
    if (!columns_.robot.empty()) put(columns_.robot[i]);
    for (const auto& other : columns_.others) put(other.values[i]);
  }
  void finish() {
    out_.write(buffer_.data(), at_);
    at_ = 0;
  }

 private:
  static constexpr std::size_t kPoint = 32;  // bytes of a point alone, at most
  static constexpr std::size_t kBuffer = std::size_t{1} << 16U;

  core::OutputFile& out_;
  const CloudColumns& columns_;
  std::size_t most_;  ///< bytes of a record
  std::vector<char> buffer_;
  std::size_t at_ = 0;
};

}  // namespace

core::Result<void> write_ply(const std::filesystem::path& file, const Cloud& cloud,
                             const CloudColumns& columns) {
  check_columns(cloud, columns);
  core::OutputFile out(file);
  out.write(
      fmt::format("ply\nformat binary_little_endian 1.0\ncomment plumbline, metres\nelement vertex {}\n",
                  count_finite(cloud)));
  out.write(
      "property float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n");
  if (!columns.confidence.empty()) out.write("property float confidence\n");
  if (!columns.observations.empty()) out.write("property int observations\n");
  if (!columns.robot.empty()) out.write("property uchar robot\n");
  for (const auto& other : columns.others) out.write("property float " + other.name + "\n");
  out.write("end_header\n");
  Records records(out, columns);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Point& p = cloud[i];
    if (!finite(p)) continue;
    const bool normal = std::isfinite(p.normal_x + p.normal_y + p.normal_z);
    records.begin();
    records.put(std::array<float, 3>{p.x, p.y, p.z});
    records.put(normal ? std::array<float, 3>{p.normal_x, p.normal_y, p.normal_z} : std::array<float, 3>{});
    records.put(std::array<std::uint8_t, 3>{p.r, p.g, p.b});
    records.put_columns(i);
  }
  records.finish();
  return out.commit();
}

core::Result<void> write_pcd(const std::filesystem::path& file, const Cloud& cloud,
                             const CloudColumns& columns) {
  check_columns(cloud, columns);
  const bool organised = cloud.height > 1;
  const std::size_t points = organised ? cloud.size() : count_finite(cloud);
  std::string fields = "x y z rgb normal_x normal_y normal_z curvature";
  std::string sizes = "4 4 4 4 4 4 4 4";
  std::string types = "F F F F F F F F";
  std::string counts = "1 1 1 1 1 1 1 1";
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

  core::OutputFile out(file);
  const auto& t = cloud.sensor_origin_;
  const auto& q = cloud.sensor_orientation_;
  out.write(
      fmt::format("# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\n"
                  "COUNT {}\nWIDTH {}\nHEIGHT {}\nVIEWPOINT {} {} {} {} {} {} {}\nPOINTS {}\nDATA binary\n",
                  fields, sizes, types, counts, organised ? cloud.width : points,
                  organised ? cloud.height : 1, t[0], t[1], t[2], q.w(), q.x(), q.y(), q.z(), points));
  Records records(out, columns);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Point& p = cloud[i];
    if (!organised && !finite(p)) continue;
    records.begin();
    records.put(std::array<float, 3>{p.x, p.y, p.z});
    records.put(static_cast<std::uint32_t>(p.r) << 16 | static_cast<std::uint32_t>(p.g) << 8 |
                static_cast<std::uint32_t>(p.b));
    records.put(std::array<float, 4>{p.normal_x, p.normal_y, p.normal_z, p.curvature});
    records.put_columns(i);
  }
  records.finish();
  return out.commit();
}

core::Result<void> write_cloud(const std::filesystem::path& file, const Cloud& cloud,
                               const CloudColumns& columns) {
  const std::string ending = file.extension().string();
  if (ending == ".ply") return write_ply(file, cloud, columns);
  if (ending == ".pcd") return write_pcd(file, cloud, columns);
  return core::usage_error(fmt::format(
      "{}: ending '{}' is not one that clouds are written as; use .ply or .pcd", file.string(), ending));
}

}  // namespace plumbline::cloud
