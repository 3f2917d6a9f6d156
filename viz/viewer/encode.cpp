// SPDX-License-Identifier: BSD-3-Clause
#include "encode.hpp"

#include <libdeflate.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "plumbline/core/shortage.hpp"

namespace plumbline::viewer {
namespace {

constexpr std::size_t kChunk = 32768;        // points
constexpr std::size_t kFirstLevel = 120000;  // points, at most: what is seen at once
constexpr double kStep_m = 0.002;            // of the grid
constexpr double kMostSteps = 65535.0;
constexpr int kBits = 16;         // of a coordinate
constexpr int kCompression = 12;  // libdeflate's level, 1 to 12

using Steps = std::array<std::uint16_t, 3>;

/// Puts the bits of `value` into every third bit of the result.
std::uint64_t spread(std::uint64_t value) {
  value = (value | value << 32U) & 0x1f00000000ffffULL;
  value = (value | value << 16U) & 0x1f0000ff0000ffULL;
  value = (value | value << 8U) & 0x100f00f00f00f00fULL;
  value = (value | value << 4U) & 0x10c30c30c30c30c3ULL;
  return (value | value << 2U) & 0x1249249249249249ULL;
}

std::uint64_t morton(const Steps& p) { return spread(p[0]) | spread(p[1]) << 1U | spread(p[2]) << 2U; }

/// Mixes bits, so that the point chosen for a cell is not always near the same corner.
std::uint64_t mixed(std::uint64_t value) {
  value = (value ^ value >> 31U) * 0x9e3779b97f4a7c15ULL;
  return value ^ value >> 29U;
}

/// Raw deflate stream of the bytes.
std::string packed(const std::vector<std::uint8_t>& bytes) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      core::made(libdeflate_alloc_compressor(kCompression)), &libdeflate_free_compressor);
  std::string out(libdeflate_deflate_compress_bound(compressor.get(), bytes.size()), '\0');
  out.resize(
      libdeflate_deflate_compress(compressor.get(), bytes.data(), bytes.size(), out.data(), out.size()));
  return out;
}

/// Encodes small steps of either sign as small numbers.
std::uint16_t zigzag(std::uint16_t value, std::uint16_t before) {
  const auto step = static_cast<std::int16_t>(static_cast<std::uint16_t>(value - before));
  return static_cast<std::uint16_t>(static_cast<std::uint16_t>(step) << 1U ^ (step < 0 ? 0xFFFFU : 0U));
}

/// Differences from value to value, one plane of bytes.
class Plane {
 public:
  Plane(std::vector<std::uint8_t>& bytes, std::size_t from) : bytes_(&bytes), at_(from) {}
  void put(int value) {
    (*bytes_)[at_++] = static_cast<std::uint8_t>(value - before_);
    before_ = value;
  }

 private:
  std::vector<std::uint8_t>* bytes_;
  std::size_t at_;
  int before_ = 0;
};

/// Points on the grid, in Morton order.
struct Grid {
  std::vector<Steps> steps;
  std::vector<std::uint64_t> codes;
  std::vector<std::size_t> order;  ///< numbers of the points in their cloud
};

Eigen::Vector3d place_of(const Points& points, std::size_t i, bool z_up) {
  const auto& p = points.positions[i];
  return shown({points.shift[0] + p[0], points.shift[1] + p[1], points.shift[2] + p[2]}, z_up);
}

Grid on_grid(const Points& points, bool z_up, EncodedCloud& out) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::max());
  Eigen::Vector3d high = -low;
  const std::size_t count = points.positions.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d p = place_of(points, i, z_up);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  if (count == 0) low = high = Eigen::Vector3d::Zero();

  // On whole steps, so that two clouds share one grid.
  out.step_m = std::max(kStep_m, (high - low).maxCoeff() / (kMostSteps - 1.0));
  for (int k = 0; k < 3; ++k)
    out.origin[static_cast<std::size_t>(k)] = std::floor(low[k] / out.step_m) * out.step_m;

  // Codes sort points along the Morton curve.
  std::vector<Steps> steps(count);
  std::vector<std::pair<std::uint64_t, std::size_t>> sorted(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d p = place_of(points, i, z_up);
    for (std::size_t k = 0; k < 3; ++k) {
      const double at = (p[static_cast<int>(k)] - out.origin[k]) / out.step_m;
      steps[i][k] = static_cast<std::uint16_t>(std::lround(std::clamp(at, 0.0, kMostSteps)));
    }

    sorted[i] = {morton(steps[i]), i};
  }
  std::sort(sorted.begin(), sorted.end());

  // Steps and numbers in that order.
  Grid grid;
  grid.steps.reserve(count);
  for (const auto& [code, i] : sorted) {
    grid.steps.push_back(steps[i]);
    grid.codes.push_back(code);
    grid.order.push_back(i);
  }
  return grid;
}

/// Number of cells of 2^bits steps that have a point, for each number of bits.
std::array<std::size_t, kBits + 1> occupied(const std::vector<std::uint64_t>& codes) {
  std::array<std::size_t, kBits + 1> cells{};
  for (std::size_t i = 0; i < codes.size(); ++i) {
    for (unsigned bits = 0; bits <= kBits; ++bits) {
      if (i > 0 && codes[i] >> 3U * bits == codes[i - 1] >> 3U * bits) break;
      ++cells[bits];
    }
  }
  return cells;
}

/// Edge of each level's cells, as bits, coarsest first; the last level takes all points: 0.
std::vector<unsigned> level_bits(const std::array<std::size_t, kBits + 1>& cells, std::size_t count) {
  std::vector<unsigned> levels;
  if (count > kFirstLevel) {
    unsigned bits = 0;
    while (cells[bits] > kFirstLevel) ++bits;
    for (; bits > 0 && cells[bits] < count / 2; --bits) levels.push_back(bits);
  }
  levels.push_back(0);
  return levels;
}

/// The level of each point. A level has one point of each of its cells that has no point of a coarser level.
std::vector<std::uint8_t> levels_of(const Grid& grid, const std::vector<unsigned>& bits) {
  const std::size_t count = grid.codes.size();
  const auto last = static_cast<std::uint8_t>(bits.size() - 1);
  std::vector<std::uint8_t> level(count, last);

  for (std::uint8_t l = 0; l < last; ++l) {
    for (std::size_t from = 0, to = 0; from < count; from = to) {
      std::size_t best = from;
      bool taken = false;
      const std::uint64_t cell = grid.codes[from] >> 3U * bits[l];
      for (to = from; to < count && grid.codes[to] >> 3U * bits[l] == cell; ++to) {
        taken = taken || level[to] < l;
        if (mixed(grid.codes[to]) < mixed(grid.codes[best])) best = to;
      }
      if (!taken) level[best] = l;
    }
  }
  return level;
}

/// Place and colour of a chunk's points: six planes of steps, three of colour (YCoCg).
std::string packed_points(const Points& points, const Grid& grid, const std::vector<std::size_t>& chosen) {
  const std::size_t n = chosen.size();
  std::vector<std::uint8_t> bytes((points.colored ? 9 : 6) * n);

  // Differences of successive points compress well.
  Steps before{};
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint16_t step = zigzag(grid.steps[chosen[i]][k], before[k]);
      bytes[2 * k * n + i] = static_cast<std::uint8_t>(step & 0xFFU);
      bytes[(2 * k + 1) * n + i] = static_cast<std::uint8_t>(step >> 8U);
    }
    before = grid.steps[chosen[i]];
  }

  // Without colours that is all.
  if (!points.colored) return packed(bytes);

  // Colours, with reduced chrominance.
  std::array<Plane, 3> planes{Plane(bytes, 6 * n), Plane(bytes, 7 * n), Plane(bytes, 8 * n)};
  for (const std::size_t i : chosen) {
    const auto& [r, g, b] = points.colors[grid.order[i]];
    planes[0].put((r + 2 * g + b + 2) / 4);
    planes[1].put((r - b) >> 2);  // eyes need hues less exactly
    planes[2].put((2 * g - r - b) >> 3);
  }
  return packed(bytes);
}

/// Encodes a unit vector folded onto an octahedron (Cigolle et al. 2014), in steps fine enough for shading.
std::array<int, 2> folded(const Eigen::Vector3d& normal) {
  constexpr double kHalf = 15.0;  // 31 steps
  const Eigen::Vector3d n = normal / normal.lpNorm<1>();
  double u = n.x();
  double v = n.y();
  if (n.z() < 0.0) {
    u = std::copysign(1.0 - std::abs(n.y()), n.x());
    v = std::copysign(1.0 - std::abs(n.x()), n.y());
  }
  return {1 + static_cast<int>(std::lround((u + 1.0) * kHalf)),
          1 + static_cast<int>(std::lround((v + 1.0) * kHalf))};
}

std::string packed_normals(const Points& points, const Grid& grid, const std::vector<std::size_t>& chosen,
                           bool z_up) {
  const std::size_t n = chosen.size();
  std::vector<std::uint8_t> bytes(2 * n);
  Plane first(bytes, 0);
  Plane second(bytes, n);
  for (const std::size_t i : chosen) {
    const auto& [x, y, z] = points.normals[grid.order[i]];
    const Eigen::Vector3d normal = shown({x, y, z}, z_up);

    // Zero stands for unknown normals.
    const bool known = normal.allFinite() && normal.squaredNorm() > 0.25;
    const std::array<int, 2> at = known ? folded(normal) : std::array<int, 2>{};
    first.put(at[0]);
    second.put(at[1]);
  }
  return packed(bytes);
}

/// Code of a value: 0: not known; else 1 to steps + 1 over the layer's range, or 1 + the category.
int step_of(const Layer& layer, float value) {
  if (!std::isfinite(value)) return 0;
  if (layer.scale == Scale::kCategory || layer.scale == Scale::kView) return 1 + static_cast<int>(value);
  const double v = std::clamp(static_cast<double>(value), layer.low, layer.high);
  const double share = layer.scale == Scale::kLogarithmic
                           ? std::log(v / layer.low) / std::log(layer.high / layer.low)
                           : (v - layer.low) / (layer.high - layer.low);
  return 1 + static_cast<int>(std::lround(share * layer.steps));
}

std::string packed_layer(const Layer& layer, const Grid& grid, const std::vector<std::size_t>& chosen) {
  const std::size_t n = chosen.size();
  const bool wide = layer.scale == Scale::kView;
  std::vector<std::uint8_t> bytes((wide ? 2 : 1) * n);
  Plane low(bytes, 0);
  std::size_t at = 0;
  for (const std::size_t i : chosen) {
    const int step = step_of(layer, layer.values[grid.order[i]]);
    if (wide) {
      // All low bytes, then all high bytes.
      bytes[at] = static_cast<std::uint8_t>(step & 0xFF);
      bytes[n + at++] = static_cast<std::uint8_t>(step >> 8);
    } else {
      low.put(step);
    }
  }
  return packed(bytes);
}

}  // namespace

Eigen::Vector3d shown(const Eigen::Vector3d& place, bool z_up) {
  return z_up ? place : Eigen::Vector3d(place.x(), place.z(), -place.y());
}

EncodedCloud encode(const Points& points, bool z_up) {
  EncodedCloud out;
  const Grid grid = on_grid(points, z_up, out);
  const std::size_t count = grid.codes.size();
  const auto cells = occupied(grid.codes);
  const std::vector<unsigned> bits = level_bits(cells, count);
  const std::vector<std::uint8_t> level = levels_of(grid, bits);

  // The spacing of the finest level follows from the points per cell of a coarser one: with four of them it
  // is half the cell's edge.
  for (const unsigned b : bits) out.spacing_m.push_back(out.step_m * static_cast<double>(1U << b));

  unsigned edge = 1;
  while (edge < kBits && cells[edge] * 2 > count) ++edge;
  const double share = static_cast<double>(std::max<std::size_t>(count, 1)) /
                       static_cast<double>(std::max<std::size_t>(cells[edge], 1));
  out.spacing_m.back() = out.step_m * static_cast<double>(1U << edge) / std::sqrt(share);

  // Chunks of one level.
  for (std::size_t l = 0; l < bits.size(); ++l) {
    std::vector<std::size_t> chosen;
    const auto flush = [&] {
      if (chosen.empty()) return;

      // Extent of the chunk.
      Chunk chunk;
      chunk.level = static_cast<int>(l);
      chunk.count = chosen.size();
      chunk.low = chunk.high = grid.steps[chosen.front()];
      for (const std::size_t i : chosen) {
        for (std::size_t k = 0; k < 3; ++k) {
          chunk.low[k] = std::min(chunk.low[k], grid.steps[i][k]);
          chunk.high[k] = std::max(chunk.high[k], grid.steps[i][k]);
        }
      }

      // Packed data of the chunk.
      chunk.points = packed_points(points, grid, chosen);
      if (!points.normals.empty()) chunk.normals = packed_normals(points, grid, chosen, z_up);
      for (const Layer& layer : points.layers) chunk.layers.push_back(packed_layer(layer, grid, chosen));
      out.chunks.push_back(std::move(chunk));
      chosen.clear();
    };

    // Points in order, until a chunk is full.
    for (std::size_t i = 0; i < count; ++i) {
      if (level[i] != l) continue;
      chosen.push_back(i);
      if (chosen.size() == kChunk) flush();
    }
    flush();
  }
  return out;
}

}  // namespace plumbline::viewer
