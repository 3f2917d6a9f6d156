// SPDX-License-Identifier: BSD-3-Clause
// Compact clouds read again: as the columns of their measured points, or as clouds.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <zstd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>

#include "compact_format.hpp"
#include "plumbline/cloud/compact_cloud.hpp"
#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/cloud/view_points.hpp"
#include "plumbline/core/clones.hpp"

namespace plumbline::cloud {
namespace {

constexpr std::uint32_t kMostPoints = 1U << 26;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

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
  [[nodiscard]] bool complete() const { return !failed_ && left_ == 0; }
  [[nodiscard]] std::size_t left() const { return failed_ ? 0 : left_; }

 private:
  const std::uint8_t* at_;
  std::size_t left_;
  bool failed_ = false;
};

/// Differences of either sign out of three planes of bytes, lowest first, or four.
PLUMBLINE_CLONES void join_planes(const std::uint8_t* bytes, std::size_t count, bool four,
                                  std::int32_t* values) {
  const std::uint8_t* low = bytes;
  const std::uint8_t* middle = bytes + count;
  const std::uint8_t* high = bytes + 2 * count;
  const std::uint8_t* highest = four ? bytes + 3 * count : low;
  const std::uint32_t mask = four ? 255U : 0U;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t code =
        static_cast<std::uint32_t>(low[i]) | static_cast<std::uint32_t>(middle[i]) << 8U |
        static_cast<std::uint32_t>(high[i]) << 16U | (static_cast<std::uint32_t>(highest[i]) & mask) << 24U;
    values[i] = static_cast<std::int32_t>(code >> 1U) ^ -static_cast<std::int32_t>(code & 1U);
  }
}

/// Whole numbers out of their differences.
bool read_numbers(Reader& reader, std::size_t count, bool four, std::vector<std::int32_t>& values) {
  const std::uint8_t* bytes = reader.take(count * (four ? 4 : 3));
  if (bytes == nullptr) return false;
  values.resize(count);
  join_planes(bytes, count, four, values.data());
  std::uint32_t sum = 0;
  for (std::int32_t& value : values) {
    sum += static_cast<std::uint32_t>(value);
    value = static_cast<std::int32_t>(sum);
  }
  return true;
}

/// Bytes out of their differences modulo 256.
bool read_bytes(Reader& reader, std::size_t count, std::uint8_t* values) {
  const std::uint8_t* bytes = reader.take(count);
  if (bytes == nullptr) return false;
  std::uint8_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum = static_cast<std::uint8_t>(sum + bytes[i]);
    values[i] = sum;
  }
  return true;
}

PLUMBLINE_CLONES void scale(const std::int32_t* values, std::size_t count, double step_m, float* to) {
  for (std::size_t i = 0; i < count; ++i) to[i] = static_cast<float>(values[i] * step_m);
}

PLUMBLINE_CLONES void multiply(const float* by, std::size_t count, float* values) {
  for (std::size_t i = 0; i < count; ++i) values[i] *= by[i];
}

/// unpack_direction() of many.
PLUMBLINE_CLONES void unpack_directions(const std::uint8_t* first, const std::uint8_t* second,
                                        std::size_t count, float* x, float* y, float* z) {
  for (std::size_t i = 0; i < count; ++i) {
    const float a = (static_cast<float>(first[i]) - 127.0F) / 127.0F;
    const float b = (static_cast<float>(second[i]) - 127.0F) / 127.0F;
    const float c = 1.0F - std::abs(a) - std::abs(b);
    const float under = -c > 0.0F ? -c : 0.0F;
    const float u = a + (a >= 0.0F ? -under : under);
    const float v = b + (b >= 0.0F ? -under : under);
    const float length = std::sqrt(u * u + (v * v + c * c));
    const bool known = (first[i] & second[i]) != 255;
    x[i] = known ? u / length : kNan;
    y[i] = known ? v / length : kNan;
    z[i] = known ? c / length : kNan;
  }
}

PLUMBLINE_CLONES void add_to_bytes(const std::uint8_t* added, std::size_t count, std::uint8_t* values) {
  for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<std::uint8_t>(values[i] + added[i]);
}

tl::unexpected<core::Error> damaged(const char* how) {
  return core::input_error(std::string("stored cloud: ") + how + "; it cannot be used");
}

core::Result<void> unpack(const std::uint8_t* bytes, std::size_t size, std::vector<std::uint8_t>& content) {
  if (size < kCompactMagic.size() || !std::equal(kCompactMagic.begin(), kCompactMagic.end() - 1, bytes)) {
    return damaged("these bytes are none");
  }
  if (bytes[kCompactMagic.size() - 1] != kCompactMagic.back())
    return damaged("it was written by another version");
  bytes += kCompactMagic.size();
  size -= kCompactMagic.size();
  const unsigned long long length = ZSTD_getFrameContentSize(bytes, size);
  constexpr unsigned long long kBytesPerPoint = 17;
  // zstd packs at most about 2^17 times: what promises more is damaged, and takes no memory.
  const unsigned long long most = std::min<unsigned long long>(kBytesPerPoint * kMostPoints,
                                                               static_cast<unsigned long long>(size) << 17U);
  if (length == ZSTD_CONTENTSIZE_UNKNOWN || length == ZSTD_CONTENTSIZE_ERROR || length > most) {
    return damaged("its head is damaged");
  }
  content.resize(static_cast<std::size_t>(length));
  const std::size_t got = ZSTD_decompress(content.data(), content.size(), bytes, size);
  if (ZSTD_isError(got) != 0U || got != content.size()) return damaged("its bytes are truncated or damaged");
  return {};
}

/// Colour and normal of the points.
bool read_looks(Reader& reader, ViewPoints& points) {
  const std::size_t count = points.size();
  if (!read_bytes(reader, count, points.g.data()) || !read_bytes(reader, count, points.r.data()) ||
      !read_bytes(reader, count, points.b.data())) {
    return false;
  }
  add_to_bytes(points.g.data(), count, points.r.data());
  add_to_bytes(points.g.data(), count, points.b.data());
  points.directions.resize(2 * count);
  std::uint8_t* first = points.directions.data();
  if (!read_bytes(reader, count, first) || !read_bytes(reader, count, first + count)) return false;
  unpack_directions(first, first + count, count, points.normal_x.data(), points.normal_y.data(),
                    points.normal_z.data());
  return true;
}

bool is_set(const std::uint8_t* mask, std::size_t i) { return (mask[i / 8] >> (i % 8) & 1U) != 0; }

/// Where the points are in the grid, a bit each; null: it ends too early.
const std::uint8_t* read_grid(Reader& reader, const CompactHead& head, ViewPoints& points) {
  const auto* x = reader.take(head.width * sizeof(float));
  const auto* y = reader.take(head.height * sizeof(float));
  const std::size_t cells = static_cast<std::size_t>(head.width) * head.height;
  const auto* mask = reader.take((cells + 7) / 8);
  if (mask == nullptr) return nullptr;
  points.x.resize(cells + 1);
  points.y.resize(cells + 1);
  std::size_t count = 0;
  for (std::size_t row = 0, i = 0; row < head.height; ++row) {
    float ray_y = 0.0F;
    std::memcpy(&ray_y, y + row * sizeof(float), sizeof(float));
    for (std::size_t column = 0; column < head.width; ++column, ++i) {
      std::memcpy(&points.x[count], x + column * sizeof(float), sizeof(float));
      points.y[count] = ray_y;
      count += is_set(mask, i) ? 1 : 0;
    }
  }
  points.resize(count);
  if (!read_numbers(reader, count, false, points.differences)) return nullptr;
  scale(points.differences.data(), count, head.step_m, points.z.data());
  multiply(points.z.data(), count, points.x.data());
  multiply(points.z.data(), count, points.y.data());
  return read_looks(reader, points) ? mask : nullptr;
}

void read_list(Reader& reader, const CompactHead& head, ViewPoints& points) {
  for (std::vector<float>* axis : {&points.x, &points.y, &points.z}) {
    if (!read_numbers(reader, head.width, true, points.differences)) return;
    axis->resize(head.width);
    scale(points.differences.data(), head.width, head.step_m, axis->data());
  }
  points.resize(head.width);
  read_looks(reader, points);
}

/// Of the sensor, behind everything else; a pose that is none takes no bytes.
constexpr std::size_t kPoseBytes = 7 * sizeof(float);

struct SensorPose {
  Eigen::Vector4f origin{0, 0, 0, 0};
  Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();
};

SensorPose read_sensor_pose(Reader& reader) {
  SensorPose pose;
  if (reader.left() != kPoseBytes) return pose;
  const std::uint8_t* bytes = reader.take(kPoseBytes);
  std::memcpy(pose.origin.data(), bytes, 3 * sizeof(float));
  std::memcpy(pose.orientation.coeffs().data(), bytes + 3 * sizeof(float), 4 * sizeof(float));
  return pose;
}

struct Decoded {
  CompactHead head;
  const std::uint8_t* mask = nullptr;  ///< of a grid, see read_grid()
  SensorPose pose;
};

core::Result<Decoded> decode(const std::uint8_t* bytes, std::size_t size, ViewPoints& points) {
  if (auto unpacked = unpack(bytes, size, points.content); !unpacked)
    return tl::unexpected<core::Error>(unpacked.error());
  Reader reader(points.content.data(), points.content.size());
  Decoded decoded;
  CompactHead& head = decoded.head;
  const std::uint8_t* first = reader.take(sizeof(head));
  if (first == nullptr) return damaged("its head is damaged");
  std::memcpy(&head, first, sizeof(head));
  const std::uint64_t cells = std::uint64_t{head.width} * std::max(head.height, 1U);
  // A cell takes a bit at least.
  if (cells > kMostPoints || cells / 8 > points.content.size() || !(head.step_m > 0.0) ||
      !std::isfinite(head.step_m)) {
    return damaged("its head is damaged");
  }
  if (head.height > 0) {
    decoded.mask = read_grid(reader, head, points);
  } else {
    read_list(reader, head, points);
  }
  decoded.pose = read_sensor_pose(reader);
  if (!reader.complete()) return damaged("its parts do not fit together");
  return decoded;
}

void set_point(const ViewPoints& points, std::size_t k, Point& p) {
  p.x = points.x[k];
  p.y = points.y[k];
  p.z = points.z[k];
  p.normal_x = points.normal_x[k];
  p.normal_y = points.normal_y[k];
  p.normal_z = points.normal_z[k];
  p.r = points.r[k];
  p.g = points.g[k];
  p.b = points.b[k];
  p.a = 255;
}

}  // namespace

core::Result<void> decode_points(const std::uint8_t* bytes, std::size_t size, ViewPoints& points) {
  const auto decoded = decode(bytes, size, points);
  if (!decoded) return tl::unexpected<core::Error>(decoded.error());
  points.width = decoded->head.width;
  points.height = std::max(1U, decoded->head.height);
  Cloud none;
  none.sensor_origin_ = decoded->pose.origin;
  none.sensor_orientation_ = decoded->pose.orientation;
  points.camera_from_depth = sensor_pose(none);
  return {};
}

core::Result<CloudPtr> decode_cloud(const std::uint8_t* bytes, std::size_t size) {
  ViewPoints points;
  const auto decoded = decode(bytes, size, points);
  if (!decoded) return tl::unexpected<core::Error>(decoded.error());
  const CompactHead& head = decoded->head;
  auto cloud = std::make_shared<Cloud>();
  cloud->sensor_origin_ = decoded->pose.origin;
  cloud->sensor_orientation_ = decoded->pose.orientation;
  cloud->width = head.width;
  cloud->height = std::max(1U, head.height);
  Point none;
  if (head.height > 0) {
    none.x = none.y = none.z = none.normal_x = none.normal_y = none.normal_z = kNan;
  }
  const std::size_t cells = static_cast<std::size_t>(cloud->width) * cloud->height;
  cloud->points.reserve(cells);
  std::size_t k = 0;
  for (std::size_t i = 0; i < cells; ++i) {
    cloud->points.push_back(none);
    if (head.height == 0 || is_set(decoded->mask, i)) set_point(points, k++, cloud->points.back());
  }
  cloud->is_dense = k == cells;
  return cloud;
}

}  // namespace plumbline::cloud
