// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closing/place_matches.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include "plumbline/core/clones.hpp"
#include "plumbline/features/descriptor.hpp"

namespace plumbline::mapping {
namespace {

using features::FrameFeatures;

constexpr std::uint32_t kMaxHamming = 72;
constexpr double kRatio = 0.95;
// Distance and index in one number: the least is the nearest, the first of them.
constexpr unsigned kIndexBits = 20;

/// Finds the nearest of a row, and updates the nearest so far of each column.
PLUMBLINE_CLONES std::uint32_t take_nearest(const int* distances, std::uint32_t count, std::uint32_t row,
                                            std::uint32_t* nearest) {
  std::uint32_t least = std::numeric_limits<std::uint32_t>::max();
  for (std::uint32_t j = 0; j < count; ++j) {
    const std::uint32_t shifted = static_cast<std::uint32_t>(distances[j]) << kIndexBits;
    least = std::min(least, shifted | j);
    nearest[j] = std::min(nearest[j], shifted | row);
  }
  return least;
}

std::size_t index_of(std::uint32_t key) { return key & ((1U << kIndexBits) - 1U); }

/// True if no feature elsewhere in the image is nearly as near to the descriptor as `best`.
bool clearly_nearest(const FrameFeatures& image, const int* distances, std::size_t step, std::size_t best) {
  const double limit = distances[best * step] / kRatio;
  for (std::size_t j = 0; j < image.descriptors.size(); ++j) {
    if (distances[j * step] < limit && (image.points[j].pixel - image.points[best].pixel).norm() > 5.0F) {
      return false;
    }
  }
  return true;
}

std::vector<float> sizes_of(const FrameFeatures& image, double focal_px, double scale_factor) {
  std::vector<float> sizes;
  sizes.reserve(image.points.size());
  for (const features::PointFeature& f : image.points) {
    const double size = std::log(static_cast<double>(f.depth) / focal_px) / std::log(scale_factor) + f.octave;
    sizes.push_back(f.depth > 0.0F ? static_cast<float>(size) : std::nanf(""));
  }
  return sizes;
}

/// Pairs of other sizes are as unlike as can be.
void close(const SizeGate& gate, std::size_t row, int* distances) {
  constexpr int kUnlike = 256;
  const float size = gate.size_in_a[row];
  for (std::size_t j = 0; j < gate.size_in_b.size(); ++j) {
    if (std::abs(gate.size_in_b[j] - size) > gate.tolerance) distances[j] = kUnlike;
  }
}

}  // namespace

SizeGate size_gate(const FrameFeatures& a, double focal_a_px, const FrameFeatures& b, double focal_b_px,
                   double scale_factor) {
  return {sizes_of(a, focal_a_px, scale_factor), sizes_of(b, focal_b_px, scale_factor)};
}

std::vector<std::pair<std::size_t, std::size_t>> alike_both_ways(const FrameFeatures& a,
                                                                 const FrameFeatures& b,
                                                                 const SizeGate* gate) {
  const std::size_t rows = a.descriptors.size();
  const std::size_t columns = b.descriptors.size();
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  if (rows == 0 || columns == 0) return pairs;
  if (std::max(rows, columns) >> kIndexBits != 0) throw std::length_error("alike_both_ways: too many points");

  // All distances are computed once and serve both directions of the search.
  std::vector<int> table(rows * columns);
  std::vector<std::uint32_t> nearest_in_b(rows);
  std::vector<std::uint32_t> nearest_in_a(columns, std::numeric_limits<std::uint32_t>::max());

  for (std::size_t i = 0; i < rows; ++i) {
    int* row = table.data() + i * columns;
    features::hamming_distances(a.descriptors[i], b.descriptors.data(), columns, row);
    if (gate != nullptr) close(*gate, i, row);
    nearest_in_b[i] = take_nearest(row, static_cast<std::uint32_t>(columns), static_cast<std::uint32_t>(i),
                                   nearest_in_a.data());
  }

  // Repeated texture is ambiguous: each feature must be the other's nearest,
  // clearly nearer than any elsewhere.
  for (std::size_t i = 0; i < rows; ++i) {
    const std::size_t j = index_of(nearest_in_b[i]);
    if (index_of(nearest_in_a[j]) != i || nearest_in_b[i] >> kIndexBits > kMaxHamming) continue;
    if (clearly_nearest(b, table.data() + i * columns, 1, j) &&
        clearly_nearest(a, table.data() + j, columns, i)) {
      pairs.emplace_back(i, j);
    }
  }

  return pairs;
}

}  // namespace plumbline::mapping
