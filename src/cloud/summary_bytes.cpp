// SPDX-License-Identifier: BSD-3-Clause
// "PLVS", version, then one zstd frame with checksum: head, raster, spots. Columns of numbers lie in planes
// of bytes, lowest first. The version grows whenever summarise_view() makes something else of the same view.
#include "plumbline/cloud/summary_bytes.hpp"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>

namespace plumbline::cloud {
namespace {

constexpr std::array<std::uint8_t, 5> kMagic{'P', 'L', 'V', 'S', 1};
constexpr std::size_t kSpotNumbers = 7;

/// Without gaps.
struct Head {
  std::array<double, 12> camera_from_depth;  ///< rotation by rows, translation
  std::uint32_t width, height;               ///< of the raster
  std::uint32_t spots;
  std::uint32_t look;  ///< 0 or 1
  float furthest_m;
  std::uint32_t reserved;
};
static_assert(sizeof(Head) == 12 * sizeof(double) + 6 * sizeof(std::uint32_t));

float& number(ColorSpot& spot, std::size_t k) {
  if (k < 3) return spot.point[static_cast<Eigen::Index>(k)];
  if (k < 6) return spot.color[static_cast<Eigen::Index>(k - 3)];
  return spot.points;
}

Head head_of(const KeptSummary& kept) {
  Head head{};
  const geometry::Rigid3& pose = kept.camera_from_depth;
  for (Eigen::Index r = 0; r < 3; ++r) {
    for (Eigen::Index c = 0; c < 3; ++c)
      head.camera_from_depth[static_cast<std::size_t>(3 * r + c)] = pose.rotation(r, c);
    head.camera_from_depth[static_cast<std::size_t>(9 + r)] = pose.translation[r];
  }
  const DepthRaster& raster = kept.summary.raster;
  head.width = static_cast<std::uint32_t>(raster.width);
  head.height = static_cast<std::uint32_t>(raster.height);
  head.spots = static_cast<std::uint32_t>(kept.summary.spots.size());
  head.look = kept.summary.look ? 1 : 0;
  head.furthest_m = raster.furthest_m;
  return head;
}

/// Differences to the cell before, small ones of either sign as small numbers.
void write_raster(const std::vector<std::uint16_t>& cells, std::uint8_t* low) {
  std::uint8_t* high = low + cells.size();
  std::uint16_t before = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto step = static_cast<std::int16_t>(static_cast<std::uint16_t>(cells[i] - before));
    const auto code = static_cast<std::uint16_t>(step * 2 ^ (step < 0 ? -1 : 0));
    before = cells[i];
    low[i] = static_cast<std::uint8_t>(code);
    high[i] = static_cast<std::uint8_t>(code >> 8);
  }
}
void read_raster(const std::uint8_t* low, std::vector<std::uint16_t>& cells) {
  const std::uint8_t* high = low + cells.size();
  std::uint16_t now = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto code = static_cast<std::uint16_t>(low[i] | high[i] << 8);
    now = static_cast<std::uint16_t>(now + ((code >> 1) ^ ((code & 1) != 0 ? 0xffff : 0)));
    cells[i] = now;
  }
}

/// Number after number, each of all spots in planes of bytes.
void write_spots(std::vector<ColorSpot> spots, std::uint8_t* plane) {
  for (std::size_t k = 0; k < kSpotNumbers; ++k) {
    for (std::size_t i = 0; i < spots.size(); ++i) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, &number(spots[i], k), sizeof(bits));
      for (std::size_t b = 0; b < sizeof(float); ++b, bits >>= 8U)
        plane[b * spots.size() + i] = static_cast<std::uint8_t>(bits);
    }
    plane += sizeof(float) * spots.size();
  }
}
void read_spots(const std::uint8_t* plane, std::vector<ColorSpot>& spots) {
  const std::size_t count = spots.size();
  for (std::size_t k = 0; k < kSpotNumbers; ++k, plane += sizeof(float) * count) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t bits = static_cast<std::uint32_t>(plane[i]) |
                                 static_cast<std::uint32_t>(plane[count + i]) << 8U |
                                 static_cast<std::uint32_t>(plane[2 * count + i]) << 16U |
                                 static_cast<std::uint32_t>(plane[3 * count + i]) << 24U;
      std::memcpy(&number(spots[i], k), &bits, sizeof(bits));
    }
  }
}

tl::unexpected<core::Error> damaged(const char* how) {
  return core::input_error(std::string("stored view: ") + how + "; it cannot be used");
}

core::Result<void> unpack(const std::uint8_t* bytes, std::size_t size, std::vector<std::uint8_t>& content) {
  if (size < kMagic.size() || !std::equal(kMagic.begin(), kMagic.end(), bytes))
    return damaged("these bytes are none, or were written by another version");
  bytes += kMagic.size();
  size -= kMagic.size();
  const unsigned long long length = ZSTD_getFrameContentSize(bytes, size);
  // zstd packs at most about 2^17 times: what promises more is damaged, and takes no memory.
  const unsigned long long most =
      std::min<unsigned long long>(1ULL << 30U, static_cast<unsigned long long>(size) << 17U);
  if (length == ZSTD_CONTENTSIZE_UNKNOWN || length == ZSTD_CONTENTSIZE_ERROR || length > most ||
      length < sizeof(Head)) {
    return damaged("its head is damaged");
  }
  content.resize(static_cast<std::size_t>(length));
  const std::size_t got = ZSTD_decompress(content.data(), content.size(), bytes, size);
  if (ZSTD_isError(got) != 0U || got != content.size()) return damaged("its bytes are truncated or damaged");
  return {};
}

}  // namespace

std::vector<std::uint8_t> encode_summary(const KeptSummary& kept) {
  const Head head = head_of(kept);
  const std::vector<std::uint16_t>& cells = kept.summary.raster.nearest;
  const std::vector<ColorSpot>& spots = kept.summary.spots;
  std::vector<std::uint8_t> content(sizeof(head) + 2 * cells.size() +
                                    kSpotNumbers * sizeof(float) * spots.size());
  std::memcpy(content.data(), &head, sizeof(head));
  write_raster(cells, content.data() + sizeof(head));
  write_spots(spots, content.data() + sizeof(head) + 2 * cells.size());
  const std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  if (context == nullptr) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, 1);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  std::vector<std::uint8_t> bytes(kMagic.size() + ZSTD_compressBound(content.size()));
  std::copy(kMagic.begin(), kMagic.end(), bytes.begin());
  const std::size_t size = ZSTD_compress2(context.get(), bytes.data() + kMagic.size(),
                                          bytes.size() - kMagic.size(), content.data(), content.size());
  if (ZSTD_isError(size) != 0U) throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  bytes.resize(kMagic.size() + size);
  return bytes;
}

core::Result<KeptSummary> decode_summary(const std::uint8_t* bytes, std::size_t size,
                                         const sensor::Pinhole& camera) {
  std::vector<std::uint8_t> content;
  if (auto unpacked = unpack(bytes, size, content); !unpacked)
    return tl::unexpected<core::Error>(unpacked.error());
  Head head;
  std::memcpy(&head, content.data(), sizeof(head));
  constexpr int kCell = DepthRaster::kCell_px;
  const std::size_t cells = std::size_t{head.width} * head.height;
  if (static_cast<int>(head.width) != (camera.width + kCell - 1) / kCell ||
      static_cast<int>(head.height) != (camera.height + kCell - 1) / kCell) {
    return damaged("its picture is not its camera's");
  }
  const std::size_t spots = head.spots;
  if (content.size() != sizeof(head) + 2 * cells + kSpotNumbers * sizeof(float) * spots)
    return damaged("its parts do not fit together");
  KeptSummary kept;
  for (Eigen::Index r = 0; r < 3; ++r) {
    for (Eigen::Index c = 0; c < 3; ++c)
      kept.camera_from_depth.rotation(r, c) = head.camera_from_depth[static_cast<std::size_t>(3 * r + c)];
    kept.camera_from_depth.translation[r] = head.camera_from_depth[static_cast<std::size_t>(9 + r)];
  }
  kept.summary.look = head.look != 0;
  DepthRaster& raster = kept.summary.raster;
  raster.camera = camera;
  raster.width = static_cast<int>(head.width);
  raster.height = static_cast<int>(head.height);
  raster.furthest_m = head.furthest_m;
  raster.nearest.resize(cells);
  read_raster(content.data() + sizeof(head), raster.nearest);
  kept.summary.spots.resize(spots);
  read_spots(content.data() + sizeof(head) + 2 * cells, kept.summary.spots);
  return kept;
}

}  // namespace plumbline::cloud
