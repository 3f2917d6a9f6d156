// SPDX-License-Identifier: BSD-3-Clause
// "PLCC", version, then one zstd frame with checksum: head, rays of a grid, and columns of bytes. Each column
// holds differences to the point before, low bytes and high bytes apart, which is what zstd packs best.
#include "plumbline/cloud/compact_cloud.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>

#include "compact/compact_format.hpp"
#include "compact/octahedral.hpp"
#include "finite.hpp"

namespace plumbline::cloud {
namespace {

constexpr double kMostSteps = 1 << 30;

/// Small numbers of either sign as small numbers.
std::uint32_t zigzag(std::int32_t v) {
  return static_cast<std::uint32_t>(v) << 1U ^ static_cast<std::uint32_t>(v >> 31);
}

/// Tangents x/z of columns and y/z of rows.
struct Rays {
  std::vector<float> x, y;
};

/// The rays of an organised cloud; none when some point lies off them by more than an eighth of a step.
std::optional<Rays> rays_of(const Cloud& cloud, double step_m) {
  if (cloud.height < 2 || cloud.width < 2) return std::nullopt;
  Rays rays{std::vector<float>(cloud.width, kNan), std::vector<float>(cloud.height, kNan)};
  const auto most = static_cast<float>(0.125 * step_m);
  std::size_t i = 0;
  for (std::uint32_t row = 0; row < cloud.height; ++row) {
    for (std::uint32_t column = 0; column < cloud.width; ++column, ++i) {
      const Point& p = cloud[i];
      if (!finite(p)) continue;
      if (!(p.z > 0.0F) || static_cast<double>(p.z) > 65534.0 * step_m) return std::nullopt;
      if (std::isnan(rays.x[column])) rays.x[column] = p.x / p.z;
      if (std::isnan(rays.y[row])) rays.y[row] = p.y / p.z;
      if (std::abs(rays.x[column] * p.z - p.x) > most || std::abs(rays.y[row] * p.z - p.y) > most) {
        return std::nullopt;
      }
    }
  }
  for (float& v : rays.x) v = std::isnan(v) ? 0.0F : v;
  for (float& v : rays.y) v = std::isnan(v) ? 0.0F : v;
  return rays;
}

class Writer {
 public:
  explicit Writer(std::size_t expected) { bytes_.reserve(expected); }
  void raw(const void* data, std::size_t size) {
    const auto* from = static_cast<const std::uint8_t*>(data);
    bytes_.insert(bytes_.end(), from, from + size);
  }
  /// Differences of `values` as `planes` planes of bytes, lowest first.
  void differences(const std::vector<std::int32_t>& values, int planes) {
    const std::size_t at = bytes_.size();
    const std::size_t count = values.size();
    bytes_.resize(at + count * static_cast<std::size_t>(planes));
    std::int32_t before = 0;
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t code = zigzag(values[i] - before);
      before = values[i];
      for (int k = 0; k < planes; ++k, code >>= 8U) {
        bytes_[at + static_cast<std::size_t>(k) * count + i] = static_cast<std::uint8_t>(code);
      }
    }
  }
  /// Differences modulo 256.
  void differences(const std::vector<std::uint8_t>& values) {
    std::uint8_t before = 0;
    for (const std::uint8_t v : values) {
      bytes_.push_back(static_cast<std::uint8_t>(v - before));
      before = v;
    }
  }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Colour (green, and red and blue relative to it) and normal of the finite points.
void write_columns(const Cloud& cloud, std::size_t points, Writer& writer) {
  std::array<std::vector<std::uint8_t>, 5> columns;
  for (auto& column : columns) column.reserve(points);
  for (const Point& p : cloud.points) {
    if (!finite(p)) continue;
    columns[0].push_back(p.g);
    columns[1].push_back(static_cast<std::uint8_t>(p.r - p.g));
    columns[2].push_back(static_cast<std::uint8_t>(p.b - p.g));
    const auto normal = pack_direction({p.normal_x, p.normal_y, p.normal_z});
    columns[3].push_back(normal[0]);
    columns[4].push_back(normal[1]);
  }
  for (const auto& column : columns) writer.differences(column);
}

void write_grid(const Cloud& cloud, const Rays& rays, double step_m, Writer& writer) {
  writer.raw(rays.x.data(), rays.x.size() * sizeof(float));
  writer.raw(rays.y.data(), rays.y.size() * sizeof(float));
  std::vector<std::uint8_t> mask((cloud.size() + 7) / 8, 0);
  std::vector<std::int32_t> depth;
  depth.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!finite(cloud[i])) continue;
    mask[i / 8] = static_cast<std::uint8_t>(mask[i / 8] | 1U << (i % 8));
    depth.push_back(static_cast<std::int32_t>(std::lround(static_cast<double>(cloud[i].z) / step_m)));
  }
  writer.raw(mask.data(), mask.size());
  writer.differences(depth, 3);
  write_columns(cloud, depth.size(), writer);
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

void write_list(const Cloud& cloud, double step_m, Writer& writer) {
  std::vector<std::int32_t> values(cloud.points.size());
  for (const auto axis : {&Point::x, &Point::y, &Point::z}) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<std::int32_t>(std::lround(static_cast<double>(cloud.points[i].*axis) / step_m));
    }
    writer.differences(values, 4);
  }
  write_columns(cloud, values.size(), writer);
}

/// Of the sensor, behind everything else; a pose that is none takes no bytes.
void write_sensor_pose(const Cloud& cloud, Writer& writer) {
  const Eigen::Quaternionf& turn = cloud.sensor_orientation_;
  if (cloud.sensor_origin_.head<3>().isZero(0.0F) && turn.coeffs() == Eigen::Quaternionf::Identity().coeffs())
    return;
  writer.raw(cloud.sensor_origin_.data(), 3 * sizeof(float));
  writer.raw(turn.coeffs().data(), 4 * sizeof(float));
}

}  // namespace

std::vector<std::uint8_t> encode_cloud(const Cloud& cloud, const CompactCloudOptions& options) {
  const double step_m = options.step_m;
  if (!(step_m > 0.0)) throw std::invalid_argument("encode_cloud: step_m must be positive");
  Writer writer(cloud.size() * 9 + 64);
  if (const auto rays = rays_of(cloud, step_m)) {
    const CompactHead head{cloud.width, cloud.height, step_m};
    writer.raw(&head, sizeof(head));
    write_grid(cloud, *rays, step_m, writer);
  } else {
    const Cloud list = codable_list(cloud, step_m);
    const CompactHead head{static_cast<std::uint32_t>(list.points.size()), 0, step_m};
    writer.raw(&head, sizeof(head));
    write_list(list, step_m, writer);
  }
  write_sensor_pose(cloud, writer);
  const std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, options.level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  std::vector<std::uint8_t> bytes(kCompactMagic.size() + ZSTD_compressBound(writer.bytes().size()));
  std::copy(kCompactMagic.begin(), kCompactMagic.end(), bytes.begin());
  const std::size_t size =
      ZSTD_compress2(context.get(), bytes.data() + kCompactMagic.size(), bytes.size() - kCompactMagic.size(),
                     writer.bytes().data(), writer.bytes().size());
  if (ZSTD_isError(size) != 0U) throw std::bad_alloc();  // the only way it can fail with room enough
  bytes.resize(kCompactMagic.size() + size);
  return bytes;
}

}  // namespace plumbline::cloud
