// SPDX-License-Identifier: BSD-3-Clause
// "PLCC", version, then one zstd frame with checksum: head, rays of a grid, and columns of bytes. Each column
// holds differences to the point before, low bytes and high bytes apart, which is what zstd packs best.
#include "plumbline/cloud/compact/compact_cloud.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "compact/octahedral.hpp"
#include "finite.hpp"
#include "plumbline/core/packing.hpp"

namespace plumbline::cloud {
namespace {

using core::ByteReader;
using core::Bytes;
using core::ByteWriter;

constexpr std::array<std::uint8_t, 5> kCompactMagic{'P', 'L', 'C', 'C', 1};
constexpr double kMostSteps = 1 << 30;
constexpr std::uint32_t kMostPoints = 1U << 26;

struct CompactHead {
  std::uint32_t width = 0;   ///< width of a grid, or number of points of a list
  std::uint32_t height = 0;  ///< height of a grid; 0: a list
  double step_m = 0.0;
};

/// Tangents x/z of columns and y/z of rows.
struct Rays {
  std::vector<float> x, y;
};

/// The rays of an organised cloud; none if some point is off its ray by more than an eighth of a step.
std::optional<Rays> rays_of(const Cloud& cloud, double step_m) {
  if (cloud.height < 2 || cloud.width < 2) return std::nullopt;
  Rays rays{std::vector<float>(cloud.width, kNan), std::vector<float>(cloud.height, kNan)};
  const auto most = static_cast<float>(0.125 * step_m);
  std::size_t i = 0;

  for (std::uint32_t row = 0; row < cloud.height; ++row) {
    for (std::uint32_t column = 0; column < cloud.width; ++column, ++i) {
      const Point& p = cloud[i];
      if (!finite(p)) continue;

      // The first point of a row or column gives its ray
      if (!(p.z > 0.0F) || static_cast<double>(p.z) > 65534.0 * step_m) return std::nullopt;
      if (std::isnan(rays.x[column])) rays.x[column] = p.x / p.z;
      if (std::isnan(rays.y[row])) rays.y[row] = p.y / p.z;
      if (std::abs(rays.x[column] * p.z - p.x) > most || std::abs(rays.y[row] * p.z - p.y) > most) {
        return std::nullopt;
      }
    }
  }

  // Rows and columns without points
  for (float& v : rays.x) v = std::isnan(v) ? 0.0F : v;
  for (float& v : rays.y) v = std::isnan(v) ? 0.0F : v;
  return rays;
}

std::int32_t steps_of(float value, double step_m) {
  return static_cast<std::int32_t>(std::lround(static_cast<double>(value) / step_m));
}

/// Whole numbers as `kPlanes` planes of bytes, lowest first, of their differences; small ones of either sign
/// as small numbers.
template <std::size_t kPlanes, typename Io>
void differences(Io& io, std::vector<std::int32_t>& values) {
  std::vector<std::uint32_t> codes(values.size());
  std::uint32_t before = 0;

  // Zigzag code: small differences of either sign are small
  if constexpr (!Io::kReads) {
    for (std::size_t i = 0; i < codes.size(); ++i) {
      const auto now = static_cast<std::uint32_t>(values[i]);
      const std::uint32_t difference = now - before;
      codes[i] = difference << 1U ^ (0U - (difference >> 31U));
      before = now;
    }
  }

  io.template planes<kPlanes>(codes.data(), codes.size());

  // Values are the sums of the differences
  if constexpr (Io::kReads) {
    for (std::size_t i = 0; i < codes.size(); ++i) {
      before += (codes[i] >> 1U) ^ (0U - (codes[i] & 1U));
      values[i] = static_cast<std::int32_t>(before);
    }
  }
}

/// Colour (green, and red and blue relative to it) and normal of points: five planes of bytes, each of
/// differences modulo 256.
template <typename Io>
void columns(Io& io, const std::vector<Point*>& points) {
  const std::size_t count = points.size();
  Bytes bytes(5 * count);
  std::array<std::uint8_t, 5> before{};

  // Bytes relative to those of the previous point
  if constexpr (!Io::kReads) {
    for (std::size_t i = 0; i < count; ++i) {
      const Point& p = *points[i];
      const auto normal = pack_direction({p.normal_x, p.normal_y, p.normal_z});
      const std::array<std::uint8_t, 5> now{p.g, static_cast<std::uint8_t>(p.r - p.g),
                                            static_cast<std::uint8_t>(p.b - p.g), normal[0], normal[1]};

      for (std::size_t k = 0; k < now.size(); ++k) {
        bytes[k * count + i] = static_cast<std::uint8_t>(now[k] - before[k]);
      }
      before = now;
    }
  }

  io.planes(bytes.data(), bytes.size());

  // Sums of the differences; red and blue are relative to green
  if constexpr (Io::kReads) {
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < before.size(); ++k) {
        before[k] = static_cast<std::uint8_t>(before[k] + bytes[k * count + i]);
      }

      Point& p = *points[i];
      p.g = before[0];
      p.r = static_cast<std::uint8_t>(before[0] + before[1]);
      p.b = static_cast<std::uint8_t>(before[0] + before[2]);
      p.a = 255;
      p.getNormalVector3fMap() = unpack_direction({before[3], before[4]});
    }
  }
}

template <typename Io>
void grid(Io& io, Rays& rays, double step_m, Cloud& cloud) {
  for (float& ray : rays.x) io(ray);
  for (float& ray : rays.y) io(ray);

  // One bit per pixel: it has a point
  std::vector<std::uint8_t> mask((cloud.size() + 7) / 8, 0);
  if constexpr (!Io::kReads) {
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (finite(cloud[i])) mask[i / 8] = static_cast<std::uint8_t>(mask[i / 8] | 1U << (i % 8));
    }
  }

  io.planes(mask.data(), mask.size());

  // Points with depth, row by row
  std::vector<Point*> points;
  points.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if ((mask[i / 8] >> (i % 8) & 1U) != 0) points.push_back(&cloud[i]);
  }

  // Only depth is stored: x and y follow from the ray
  std::vector<std::int32_t> depths(points.size());
  if constexpr (!Io::kReads) {
    for (std::size_t k = 0; k < points.size(); ++k) depths[k] = steps_of(points[k]->z, step_m);
  }

  differences<3>(io, depths);
  if constexpr (Io::kReads) {
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto i = static_cast<std::size_t>(points[k] - cloud.points.data());
      const auto z = static_cast<float>(depths[k] * step_m);
      points[k]->getVector3fMap() =
          Eigen::Vector3f(rays.x[i % cloud.width] * z, rays.y[i / cloud.width] * z, z);
    }
    cloud.is_dense = points.size() == cloud.size();
  }

  columns(io, points);
}

/// A copy without points that cannot be coded.
Cloud codable_list(const Cloud& cloud, double step_m) {
  Cloud list;
  const auto most = static_cast<float>(kMostSteps * step_m);
  for (const Point& p : cloud.points) {
    if (!finite(p) || std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > most) continue;
    list.points.push_back(p);
  }
  return list;
}

template <typename Io>
void list(Io& io, double step_m, Cloud& cloud) {
  std::vector<std::int32_t> values(cloud.points.size());

  // Each axis apart: consecutive points are close
  for (const auto axis : {&Point::x, &Point::y, &Point::z}) {
    if constexpr (!Io::kReads) {
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = steps_of(cloud.points[i].*axis, step_m);
    }
    differences<4>(io, values);
    if constexpr (Io::kReads) {
      for (std::size_t i = 0; i < values.size(); ++i)
        cloud.points[i].*axis = static_cast<float>(values[i] * step_m);
    }
  }

  // Colours and normals of all points
  std::vector<Point*> points;
  points.reserve(cloud.points.size());
  for (Point& p : cloud.points) points.push_back(&p);
  columns(io, points);
}

/// Fields of the sensor, behind all others; a missing pose takes no bytes.
template <typename Io>
void sensor_pose_fields(Io& io, Cloud& cloud) {
  for (int k = 0; k < 3; ++k) io(cloud.sensor_origin_[k]);
  for (int k = 0; k < 4; ++k) io(cloud.sensor_orientation_.coeffs()[k]);
}

bool has_sensor_pose(const Cloud& cloud) {
  return !cloud.sensor_origin_.head<3>().isZero(0.0F) ||
         cloud.sensor_orientation_.coeffs() != Eigen::Quaternionf::Identity().coeffs();
}

template <typename Io>
void head_fields(Io& io, CompactHead& head) {
  io(head.width, head.height, head.step_m);
}

CloudPtr decoded(const Bytes& content) {
  ByteReader from(content);
  CompactHead head;
  head_fields(from, head);
  const std::uint64_t cells = std::uint64_t{head.width} * std::max(head.height, 1U);

  // A cell takes a bit at least.
  from.check(
      cells <= kMostPoints && cells / 8 <= content.size() && head.step_m > 0.0 && std::isfinite(head.step_m),
      "its head is damaged");

  // Cells of an organised cloud may have no point
  Point none;
  none.x = none.y = none.z = none.normal_x = none.normal_y = none.normal_z = kNan;
  auto cloud = std::make_shared<Cloud>();
  cloud->points.assign(static_cast<std::size_t>(cells), none);
  cloud->width = head.width;
  cloud->height = std::max(1U, head.height);

  if (head.height > 0) {
    Rays rays{std::vector<float>(head.width), std::vector<float>(head.height)};
    grid(from, rays, head.step_m, *cloud);
  } else {
    list(from, head.step_m, *cloud);
  }

  if (!from.at_end()) sensor_pose_fields(from, *cloud);
  from.expect_end();
  return cloud;
}

}  // namespace

std::vector<std::uint8_t> encode_cloud(const Cloud& cloud) {
  constexpr double kStep_m = 0.00025;
  auto& whole = const_cast<Cloud&>(cloud);  // a writer changes nothing
  ByteWriter writer;

  // Organised clouds are stored as depths along rays
  if (auto rays = rays_of(cloud, kStep_m)) {
    CompactHead head{cloud.width, cloud.height, kStep_m};
    head_fields(writer, head);
    grid(writer, *rays, kStep_m, whole);
  } else {
    Cloud codable = codable_list(cloud, kStep_m);
    CompactHead head{static_cast<std::uint32_t>(codable.points.size()), 0, kStep_m};
    head_fields(writer, head);
    list(writer, kStep_m, codable);
  }

  // Most clouds have the default sensor pose
  if (has_sensor_pose(cloud)) sensor_pose_fields(writer, whole);
  Bytes bytes = core::pack(writer.bytes());
  bytes.insert(bytes.begin(), kCompactMagic.begin(), kCompactMagic.end());
  return bytes;
}

core::Result<CloudPtr> decode_cloud(const std::uint8_t* bytes, std::size_t size) {
  constexpr std::size_t kBytesPerPoint = 17;
  try {
    if (size < kCompactMagic.size() || !std::equal(kCompactMagic.begin(), kCompactMagic.end() - 1, bytes)) {
      throw core::BadBytes("its bytes are not a stored cloud");
    }

    // The last byte of the magic is the version
    if (bytes[kCompactMagic.size() - 1] != kCompactMagic.back()) {
      throw core::BadBytes("it was written by another version");
    }
    return decoded(core::unpack(bytes + kCompactMagic.size(), size - kCompactMagic.size(),
                                kBytesPerPoint * kMostPoints));
  } catch (const core::BadBytes& bad) {
    return core::input_error(std::string("stored cloud: ") + bad.what() + "; it cannot be used");
  }
}

}  // namespace plumbline::cloud
