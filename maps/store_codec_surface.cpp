// SPDX-License-Identifier: BSD-3-Clause
// Coarse surfaces as bytes: rounded well below what a depth camera knows, differences column by column, each
// column in byte planes.
#include <algorithm>
#include <array>
#include <cmath>

#include "store_codec.hpp"

namespace plumbline::maps {
namespace {

constexpr double kPoint_m = 2e-4;
constexpr double kNormal = 1.0 / 250.0;
constexpr double kSigma_m = 5e-6;
constexpr double kMost_m = 1000.0;

std::uint32_t zigzag(std::int32_t v) {
  return static_cast<std::uint32_t>(v) << 1U ^ static_cast<std::uint32_t>(v >> 31);
}
std::int32_t unzigzag(std::uint32_t v) {
  return static_cast<std::int32_t>(v >> 1U) ^ -static_cast<std::int32_t>(v & 1U);
}

std::int32_t steps(float value, double step, double most) {
  if (!std::isfinite(value)) throw std::invalid_argument("store: a surface has places that are no numbers");
  return static_cast<std::int32_t>(std::lround(std::clamp(static_cast<double>(value), -most, most) / step));
}

template <typename Get>
void write_column(const std::vector<SurfaceSample>& samples, double step, double most, const Get& get,
                  ByteWriter& to) {
  std::vector<std::uint32_t> column;
  column.reserve(samples.size());
  std::int32_t before = 0;
  for (const SurfaceSample& sample : samples) {
    const std::int32_t now = steps(get(sample), step, most);
    column.push_back(zigzag(now - before));
    before = now;
  }
  to.planes(column);
}

template <typename Set>
void read_column(std::vector<SurfaceSample>& samples, double step, const Set& set, ByteReader& from) {
  const std::vector<std::uint32_t> column = from.planes<std::uint32_t>(samples.size());
  std::uint32_t now = 0;
  for (std::size_t i = 0; i < column.size(); ++i) {
    now += static_cast<std::uint32_t>(unzigzag(column[i]));
    set(samples[i]) = static_cast<float>(static_cast<double>(static_cast<std::int32_t>(now)) * step);
  }
}

}  // namespace

void encode(const StoredSurface& surface, ByteWriter& to) {
  to.put(surface.voxel_m);
  to.count(surface.samples.size());
  for (int k = 0; k < 3; ++k) {
    write_column(
        surface.samples, kPoint_m, kMost_m, [k](const auto& s) { return s.point(k); }, to);
  }
  for (int k = 0; k < 3; ++k) {
    write_column(
        surface.samples, kNormal, 1.0, [k](const auto& s) { return s.normal(k); }, to);
  }
  write_column(
      surface.samples, kSigma_m, 1.0, [](const auto& s) { return s.sigma; }, to);
}

StoredSurface decode_surface(const Bytes& bytes) {
  constexpr std::size_t kSampleBytes = 7 * sizeof(std::uint32_t);
  ByteReader from(bytes);
  StoredSurface surface;
  from.get(surface.voxel_m);
  surface.samples.resize(from.count(kSampleBytes));
  for (int k = 0; k < 3; ++k) {
    read_column(
        surface.samples, kPoint_m, [k](auto& s) -> float& { return s.point(k); }, from);
  }
  for (int k = 0; k < 3; ++k) {
    read_column(
        surface.samples, kNormal, [k](auto& s) -> float& { return s.normal(k); }, from);
  }
  read_column(
      surface.samples, kSigma_m, [](auto& s) -> float& { return s.sigma; }, from);
  from.expect_end();
  for (SurfaceSample& sample : surface.samples) sample.normal.normalize();
  return surface;
}

}  // namespace plumbline::maps
