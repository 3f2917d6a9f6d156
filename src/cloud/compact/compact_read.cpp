// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "compact/compact_format.hpp"
#include "compact/octahedral.hpp"
#include "plumbline/cloud/compact_cloud.hpp"

namespace plumbline::cloud {
namespace {

constexpr std::uint32_t kMostPoints = 1U << 26;

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

/// Whole numbers out of planes of bytes, lowest first, of their differences; empty: they end too early.
template <std::size_t kPlanes>
std::vector<std::int32_t> read_numbers(Reader& reader, std::size_t count) {
  const std::uint8_t* bytes = reader.take(count * kPlanes);
  if (bytes == nullptr) return {};
  std::vector<std::int32_t> values(count);
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t code = 0;
    for (std::size_t plane = kPlanes; plane-- > 0;) code = code << 8U | bytes[plane * count + i];
    sum += (code >> 1U) ^ (0U - (code & 1U));
    values[i] = static_cast<std::int32_t>(sum);
  }
  return values;
}

tl::unexpected<core::Error> damaged(const char* how) {
  return core::input_error(std::string("stored cloud: ") + how + "; it cannot be used");
}

core::Result<std::vector<std::uint8_t>> unpack(const std::uint8_t* bytes, std::size_t size) {
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
  std::vector<std::uint8_t> content(static_cast<std::size_t>(length));
  const std::size_t got = ZSTD_decompress(content.data(), content.size(), bytes, size);
  if (ZSTD_isError(got) != 0U || got != content.size()) return damaged("its bytes are truncated or damaged");
  return content;
}

/// Colour and normal of the points that are there, which `points` lists: five planes of bytes, each of
/// differences modulo 256.
void read_columns(Reader& reader, const std::vector<Point*>& points) {
  const std::size_t count = points.size();
  const std::uint8_t* bytes = reader.take(5 * count);
  if (bytes == nullptr) return;
  std::array<std::uint8_t, 5> sums{};  // g, r - g, b - g, direction
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t plane = 0; plane < sums.size(); ++plane)
      sums[plane] = static_cast<std::uint8_t>(sums[plane] + bytes[plane * count + i]);
    Point& p = *points[i];
    p.g = sums[0];
    p.r = static_cast<std::uint8_t>(sums[0] + sums[1]);
    p.b = static_cast<std::uint8_t>(sums[0] + sums[2]);
    p.a = 255;
    p.getNormalVector3fMap() = unpack_direction({sums[3], sums[4]});
  }
}

void read_grid(Reader& reader, const CompactHead& head, Cloud& cloud) {
  const std::uint8_t* x = reader.take(head.width * sizeof(float));
  const std::uint8_t* y = reader.take(head.height * sizeof(float));
  const std::uint8_t* mask = reader.take((cloud.size() + 7) / 8);
  if (mask == nullptr) return;
  std::vector<float> ray_x(head.width), ray_y(head.height);
  std::memcpy(ray_x.data(), x, head.width * sizeof(float));
  std::memcpy(ray_y.data(), y, head.height * sizeof(float));
  std::vector<Point*> points;
  points.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if ((mask[i / 8] >> (i % 8) & 1U) != 0) points.push_back(&cloud[i]);
  }
  const std::vector<std::int32_t> depths = read_numbers<3>(reader, points.size());
  if (depths.size() != points.size()) return;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto i = static_cast<std::size_t>(points[k] - cloud.points.data());
    const auto z = static_cast<float>(depths[k] * head.step_m);
    points[k]->getVector3fMap() = Eigen::Vector3f(ray_x[i % head.width] * z, ray_y[i / head.width] * z, z);
  }
  cloud.is_dense = points.size() == cloud.size();
  read_columns(reader, points);
}

void read_list(Reader& reader, const CompactHead& head, Cloud& cloud) {
  std::vector<Point*> points;
  points.reserve(cloud.size());
  for (Point& p : cloud.points) points.push_back(&p);
  for (const auto axis : {&Point::x, &Point::y, &Point::z}) {
    const std::vector<std::int32_t> values = read_numbers<4>(reader, cloud.size());
    if (values.size() != cloud.size()) return;
    for (std::size_t i = 0; i < values.size(); ++i)
      cloud[i].*axis = static_cast<float>(values[i] * head.step_m);
  }
  read_columns(reader, points);
}

/// Of the sensor, behind everything else; a pose that is none takes no bytes.
void read_sensor_pose(Reader& reader, Cloud& cloud) {
  constexpr std::size_t kBytes = 7 * sizeof(float);
  if (reader.left() != kBytes) return;
  const std::uint8_t* bytes = reader.take(kBytes);
  std::memcpy(cloud.sensor_origin_.data(), bytes, 3 * sizeof(float));
  std::memcpy(cloud.sensor_orientation_.coeffs().data(), bytes + 3 * sizeof(float), 4 * sizeof(float));
}

}  // namespace

core::Result<CloudPtr> decode_cloud(const std::uint8_t* bytes, std::size_t size) {
  const auto content = unpack(bytes, size);
  if (!content) return tl::unexpected<core::Error>(content.error());
  Reader reader(content->data(), content->size());
  CompactHead head;
  const std::uint8_t* first = reader.take(sizeof(head));
  if (first == nullptr) return damaged("its head is damaged");
  std::memcpy(&head, first, sizeof(head));
  const std::uint64_t cells = std::uint64_t{head.width} * std::max(head.height, 1U);
  // A cell takes a bit at least.
  if (cells > kMostPoints || cells / 8 > content->size() || !(head.step_m > 0.0) ||
      !std::isfinite(head.step_m)) {
    return damaged("its head is damaged");
  }
  Point none;
  none.x = none.y = none.z = none.normal_x = none.normal_y = none.normal_z =
      std::numeric_limits<float>::quiet_NaN();
  auto cloud = std::make_shared<Cloud>();
  cloud->points.assign(static_cast<std::size_t>(cells), none);
  cloud->width = head.width;
  cloud->height = std::max(1U, head.height);
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
