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
#include <limits>
#include <memory>
#include <optional>

#include "octahedral.hpp"

namespace plumbline::cloud {
namespace {

constexpr std::array<std::uint8_t, 5> kMagic{'P', 'L', 'C', 'C', 1};
constexpr std::uint32_t kMostPoints = 1U << 26;
constexpr double kMostSteps = 1 << 30;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct Head {
  std::uint32_t width = 0;   ///< of a grid; of a list the number of points
  std::uint32_t height = 0;  ///< of a grid; 0: a list
  double step_m = 0.0;
};
static_assert(sizeof(Head) == 16);

bool finite(const Point& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

/// Small numbers of either sign as small numbers.
std::uint32_t zigzag(std::int32_t v) {
  return static_cast<std::uint32_t>(v) << 1U ^ static_cast<std::uint32_t>(v >> 31);
}
std::int32_t unzigzag(std::uint32_t v) {
  return static_cast<std::int32_t>(v >> 1U) ^ -static_cast<std::int32_t>(v & 1U);
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

/// Hands out parts of the bytes; null (and failed from then on) past their end.
class Reader {
 public:
  Reader(const std::uint8_t* bytes, std::size_t size) : at_(bytes), left_(size) {}
  const std::uint8_t* take(std::size_t size) {
    if (failed_ || size > left_) {
      failed_ = true;
      return nullptr;
    }
    const std::uint8_t* bytes = at_;
    at_ += size;
    left_ -= size;
    return bytes;
  }
  std::vector<std::int32_t> differences(std::size_t count, int planes) {
    const std::uint8_t* bytes = take(count * static_cast<std::size_t>(planes));
    if (bytes == nullptr) return {};
    std::vector<std::int32_t> values(count);
    std::uint32_t before = 0;
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t code = 0;
      for (int k = planes - 1; k >= 0; --k)
        code = code << 8U | bytes[static_cast<std::size_t>(k) * count + i];
      before += static_cast<std::uint32_t>(unzigzag(code));
      values[i] = static_cast<std::int32_t>(before);
    }
    return values;
  }
  std::vector<std::uint8_t> differences(std::size_t count) {
    const std::uint8_t* bytes = take(count);
    if (bytes == nullptr) return {};
    std::vector<std::uint8_t> values(count);
    std::uint8_t before = 0;
    for (std::size_t i = 0; i < count; ++i) {
      before = static_cast<std::uint8_t>(before + bytes[i]);
      values[i] = before;
    }
    return values;
  }
  [[nodiscard]] bool complete() const { return !failed_ && left_ == 0; }
  [[nodiscard]] std::size_t left() const { return failed_ ? 0 : left_; }

 private:
  const std::uint8_t* at_;
  std::size_t left_;
  bool failed_ = false;
};

/// Colour (green, and red and blue relative to it) and normal of the finite points.
void write_looks(const Cloud& cloud, std::size_t points, Writer& writer) {
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
  write_looks(cloud, depth.size(), writer);
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
  write_looks(cloud, values.size(), writer);
}

/// Of the sensor, behind everything else; a pose that is none takes no bytes.
constexpr std::size_t kPoseBytes = 7 * sizeof(float);

void write_sensor_pose(const Cloud& cloud, Writer& writer) {
  const Eigen::Quaternionf& turn = cloud.sensor_orientation_;
  if (cloud.sensor_origin_.head<3>().isZero(0.0F) && turn.coeffs() == Eigen::Quaternionf::Identity().coeffs())
    return;
  writer.raw(cloud.sensor_origin_.data(), 3 * sizeof(float));
  writer.raw(turn.coeffs().data(), 4 * sizeof(float));
}

void read_sensor_pose(Reader& reader, Cloud& cloud) {
  if (reader.left() != kPoseBytes) return;
  const std::uint8_t* bytes = reader.take(kPoseBytes);
  std::memcpy(cloud.sensor_origin_.data(), bytes, 3 * sizeof(float));
  std::memcpy(cloud.sensor_orientation_.coeffs().data(), bytes + 3 * sizeof(float), 4 * sizeof(float));
}

tl::unexpected<core::Error> damaged(const char* how) {
  return core::input_error(std::string("stored cloud: ") + how + "; it cannot be used");
}

core::Result<std::vector<std::uint8_t>> unpack(const std::uint8_t* bytes, std::size_t size) {
  if (size < kMagic.size() || !std::equal(kMagic.begin(), kMagic.end() - 1, bytes)) {
    return damaged("these bytes are none");
  }
  if (bytes[kMagic.size() - 1] != kMagic.back()) return damaged("it was written by another version");
  bytes += kMagic.size();
  size -= kMagic.size();
  const unsigned long long length = ZSTD_getFrameContentSize(bytes, size);
  constexpr unsigned long long kBytesPerPoint = 17;
  // zstd packs at most about 2^17 times: what promises more is damaged, and takes no memory.
  const unsigned long long most = std::min<unsigned long long>(kBytesPerPoint * kMostPoints,
                                                               static_cast<unsigned long long>(size) << 17U);
  if (length == ZSTD_CONTENTSIZE_UNKNOWN || length == ZSTD_CONTENTSIZE_ERROR || length > most) {
    return damaged("its head is damaged");
  }
  std::vector<std::uint8_t> content(static_cast<std::size_t>(length));
  const std::size_t got = ZSTD_decompress(content.data(), content.size(), bytes, size);
  if (ZSTD_isError(got) != 0U || got != content.size()) return damaged("its bytes are truncated or damaged");
  return content;
}

/// Colour and normal of the points that `cloud` has by now.
void read_looks(Reader& reader, const std::vector<std::size_t>& where, Cloud& cloud) {
  std::array<std::vector<std::uint8_t>, 5> columns;
  for (auto& column : columns) column = reader.differences(where.size());
  if (columns.back().size() != where.size()) return;
  for (std::size_t k = 0; k < where.size(); ++k) {
    Point& p = cloud[where[k]];
    p.g = columns[0][k];
    p.r = static_cast<std::uint8_t>(columns[1][k] + p.g);
    p.b = static_cast<std::uint8_t>(columns[2][k] + p.g);
    p.a = 255;
    p.getNormalVector3fMap() = unpack_direction({columns[3][k], columns[4][k]});
  }
}

void read_grid(Reader& reader, const Head& head, Cloud& cloud) {
  const auto* x = reader.take(head.width * sizeof(float));
  const auto* y = reader.take(head.height * sizeof(float));
  const std::size_t cells = static_cast<std::size_t>(head.width) * head.height;
  const auto* mask = reader.take((cells + 7) / 8);
  if (mask == nullptr) return;
  std::vector<std::size_t> where;
  for (std::size_t i = 0; i < cells; ++i) {
    if ((mask[i / 8] >> (i % 8) & 1U) != 0) where.push_back(i);
  }
  const auto depth = reader.differences(where.size(), 3);
  if (depth.size() != where.size()) return;
  Point none;
  none.x = none.y = none.z = none.normal_x = none.normal_y = none.normal_z = kNan;
  cloud.points.assign(cells, none);
  for (std::size_t k = 0; k < where.size(); ++k) {
    float ray_x = 0.0F;
    float ray_y = 0.0F;
    std::memcpy(&ray_x, x + where[k] % head.width * sizeof(float), sizeof(float));
    std::memcpy(&ray_y, y + where[k] / head.width * sizeof(float), sizeof(float));
    Point& p = cloud.points[where[k]];
    p.z = static_cast<float>(depth[k] * head.step_m);
    p.x = ray_x * p.z;
    p.y = ray_y * p.z;
  }
  cloud.width = head.width;
  cloud.height = head.height;
  cloud.is_dense = where.size() == cells;
  read_looks(reader, where, cloud);
}

void read_list(Reader& reader, const Head& head, Cloud& cloud) {
  std::array<std::vector<std::int32_t>, 3> xyz;
  for (auto& axis : xyz) axis = reader.differences(head.width, 4);
  if (xyz.back().size() != head.width) return;
  std::vector<std::size_t> where(head.width);
  cloud.points.resize(head.width);
  for (std::size_t i = 0; i < where.size(); ++i) {
    where[i] = i;
    Point& p = cloud.points[i];
    p.x = static_cast<float>(xyz[0][i] * head.step_m);
    p.y = static_cast<float>(xyz[1][i] * head.step_m);
    p.z = static_cast<float>(xyz[2][i] * head.step_m);
  }
  cloud.width = head.width;
  cloud.height = 1;
  cloud.is_dense = true;
  read_looks(reader, where, cloud);
}

}  // namespace

std::vector<std::uint8_t> encode_cloud(const Cloud& cloud, const CompactCloudOptions& options) {
  const double step_m = options.step_m;
  if (!(step_m > 0.0)) throw std::invalid_argument("encode_cloud: step_m must be positive");
  Writer writer(cloud.size() * 9 + 64);
  if (const auto rays = rays_of(cloud, step_m)) {
    const Head head{cloud.width, cloud.height, step_m};
    writer.raw(&head, sizeof(head));
    write_grid(cloud, *rays, step_m, writer);
  } else {
    const Cloud list = codable_list(cloud, step_m);
    const Head head{static_cast<std::uint32_t>(list.points.size()), 0, step_m};
    writer.raw(&head, sizeof(head));
    write_list(list, step_m, writer);
  }
  write_sensor_pose(cloud, writer);
  const std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, options.level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  std::vector<std::uint8_t> bytes(kMagic.size() + ZSTD_compressBound(writer.bytes().size()));
  std::copy(kMagic.begin(), kMagic.end(), bytes.begin());
  const std::size_t size =
      ZSTD_compress2(context.get(), bytes.data() + kMagic.size(), bytes.size() - kMagic.size(),
                     writer.bytes().data(), writer.bytes().size());
  if (ZSTD_isError(size) != 0U) throw std::bad_alloc();  // the only way it can fail with room enough
  bytes.resize(kMagic.size() + size);
  return bytes;
}

core::Result<CloudPtr> decode_cloud(const std::uint8_t* bytes, std::size_t size) {
  const auto content = unpack(bytes, size);
  if (!content) return tl::unexpected<core::Error>(content.error());
  Reader reader(content->data(), content->size());
  Head head;
  const std::uint8_t* first = reader.take(sizeof(head));
  if (first == nullptr) return damaged("its head is damaged");
  std::memcpy(&head, first, sizeof(head));
  const std::uint64_t cells = std::uint64_t{head.width} * std::max(head.height, 1U);
  // A cell takes a bit at least.
  if (cells > kMostPoints || cells / 8 > content->size() || !(head.step_m > 0.0) ||
      !std::isfinite(head.step_m)) {
    return damaged("its head is damaged");
  }
  auto cloud = std::make_shared<Cloud>();
  if (head.height > 0) {
    read_grid(reader, head, *cloud);
  } else {
    read_list(reader, head, *cloud);
  }
  read_sensor_pose(reader, *cloud);
  if (!reader.complete()) return damaged("its parts do not fit together");
  return cloud;
}

}  // namespace plumbline::cloud
