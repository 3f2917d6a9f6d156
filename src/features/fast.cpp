// SPDX-License-Identifier: BSD-3-Clause
#include "fast.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <opencv2/core.hpp>

namespace plumbline::features {
namespace {

constexpr int kRadius = 3;
constexpr int kCircle = 16;
constexpr std::array<std::array<int, 2>, kCircle> kOffsets = {{{0, 3},
                                                               {1, 3},
                                                               {2, 2},
                                                               {3, 1},
                                                               {3, 0},
                                                               {3, -1},
                                                               {2, -2},
                                                               {1, -3},
                                                               {0, -3},
                                                               {-1, -3},
                                                               {-2, -2},
                                                               {-3, -1},
                                                               {-3, 0},
                                                               {-3, 1},
                                                               {-2, 2},
                                                               {-1, 3}}};

using Bytes16 = std::uint8_t __attribute__((vector_size(16)));
using Bytes32 = std::uint8_t __attribute__((vector_size(32)));

#define PLUMBLINE_INLINE inline __attribute__((always_inline))  // into functions for other processors as well

template <typename V>
PLUMBLINE_INLINE void load(V& v, const std::uint8_t* p) {
  std::memcpy(&v, p, sizeof v);
}

template <typename V>
PLUMBLINE_INLINE bool any(const V& v) {
  std::array<std::uint64_t, sizeof(V) / 8> words;
  std::memcpy(words.data(), &v, sizeof v);
  std::uint64_t all = 0;
  for (const std::uint64_t w : words) all |= w;
  return all != 0;
}

template <typename V>
PLUMBLINE_INLINE void lower(V& value, const V& bound) {
  value = value < bound ? value : bound;
}

template <typename V>
PLUMBLINE_INLINE void raise(V& value, const V& bound) {
  value = value > bound ? value : bound;
}

/// Raises `best` to the largest over all arcs of 9 of the smallest difference on the arc. Two arcs that share
/// 8 pixels are taken together: max(min(s, a), min(s, b)) = min(s, max(a, b)).
template <typename V>
PLUMBLINE_INLINE void best_arc(const V (&d)[kCircle], V& best) {
  V two[kCircle / 2];
  V four[kCircle / 2];
  for (int i = 0; i < 8; ++i) {
    two[i] = d[2 * i + 1];
    lower(two[i], d[(2 * i + 2) % kCircle]);
  }
  for (int i = 0; i < 8; ++i) {
    four[i] = two[i];
    lower(four[i], two[(i + 1) % 8]);
  }
  for (int i = 0; i < 8; ++i) {
    V arcs = d[2 * i];
    raise(arcs, d[(2 * i + 9) % kCircle]);
    lower(arcs, four[i]);
    lower(arcs, four[(i + 2) % 8]);
    raise(best, arcs);
  }
}

/// Scores of `count` pixels from `row` on; 0 where there is no corner. count >= sizeof(V).
template <typename V>
PLUMBLINE_INLINE void score_row(const std::uint8_t* row, std::ptrdiff_t step, int count,
                                std::uint8_t threshold, std::uint8_t* scores) {
  constexpr int kLanes = static_cast<int>(sizeof(V));
  std::ptrdiff_t at[kCircle];
  for (std::size_t k = 0; k < kCircle; ++k) at[k] = kOffsets[k][1] * step + kOffsets[k][0];
  const V zero{};
  const V limit = zero + threshold;
  for (int x = 0; x < count; x += kLanes) {
    x = std::min(x, count - kLanes);  // the last block may overlap the one before
    const std::uint8_t* p = row + x;
    V centre;
    V ring[kCircle];
    load(centre, p);
    for (int k = 0; k < kCircle; k += 2) load(ring[k], p + at[k]);
    // Any arc of 9 covers one of each pair of opposite pixels, so it lies between these.
    V high = ring[0];
    V low = ring[0];
    raise(high, ring[8]);
    lower(low, ring[8]);
    for (int k = 2; k < 8; k += 2) {
      V high_too = ring[k];
      V low_too = ring[k];
      raise(high_too, ring[k + 8]);
      lower(low_too, ring[k + 8]);
      lower(high, high_too);
      raise(low, low_too);
    }
    raise(high, centre);
    lower(low, centre);
    high = high - centre;
    raise(high, V(centre - low));
    raise(high, limit);
    V score = zero;
    if (any(V(high - limit))) {
      for (int k = 1; k < kCircle; k += 2) load(ring[k], p + at[k]);
      V best = zero;
      V difference[kCircle];
      for (int k = 0; k < kCircle; ++k) {
        difference[k] = ring[k];
        raise(difference[k], centre);
        difference[k] = difference[k] - centre;
      }
      best_arc(difference, best);
      for (int k = 0; k < kCircle; ++k) {
        difference[k] = ring[k];
        lower(difference[k], centre);
        difference[k] = centre - difference[k];
      }
      best_arc(difference, best);
      score = best > limit ? V(best - 1) : zero;
    }
    std::memcpy(scores + x, &score, sizeof score);
  }
}

/// Keeps of `row` what is above all eight neighbours.
template <typename V>
PLUMBLINE_INLINE void suppress(const std::uint8_t* before, const std::uint8_t* row, const std::uint8_t* after,
                               int count, int y, std::vector<Corner>& corners) {
  constexpr int kLanes = static_cast<int>(sizeof(V));
  for (int x = 0; x < count; x += kLanes) {  // rows are padded with zeros
    V own;
    load(own, row + x);
    if (!any(own)) continue;
    V others{};
    for (const std::uint8_t* r : {before, row, after}) {
      V left;
      V middle;
      V right;
      load(left, r + x - 1);
      load(middle, r + x);
      load(right, r + x + 1);
      raise(others, left);
      raise(others, right);
      if (r != row) raise(others, middle);
    }
    const V zero{};
    const V kept = own > others ? own : zero;
    std::array<std::uint64_t, sizeof(V) / 8> words;
    std::memcpy(words.data(), &kept, sizeof kept);
    for (std::size_t k = 0; k < words.size(); ++k) {
      for (std::uint64_t w = words[k]; w != 0;) {  // lowest byte first
        const int byte = __builtin_ctzll(w) / 8;
        const auto score = static_cast<std::int32_t>((w >> (8 * byte)) & 0xFFU);
        corners.push_back({x + 8 * static_cast<int>(k) + byte + kRadius, y, score});
        w &= ~(std::uint64_t{0xFF} << (8 * byte));
      }
    }
  }
}

/// `image` has at least sizeof(V) columns more than the circle; those from `columns` on are not looked at.
template <typename V>
PLUMBLINE_INLINE void corners_of(const cv::Mat& image, int columns, std::uint8_t threshold,
                                 std::vector<Corner>& corners) {
  constexpr int kPad = 32;
  const int scored = image.cols - 2 * kRadius;
  const int count = columns - 2 * kRadius;
  const auto stride = static_cast<std::size_t>(scored + 3 * kPad);
  std::vector<std::uint8_t> buffer(3 * stride, 0);
  std::uint8_t* rows[3];  // before, current, after
  for (std::size_t i = 0; i < 3; ++i) rows[i] = buffer.data() + i * stride + kPad;
  for (int y = kRadius; y <= image.rows - kRadius; ++y) {
    if (y < image.rows - kRadius) {
      score_row<V>(image.ptr<std::uint8_t>(y) + kRadius, static_cast<std::ptrdiff_t>(image.step1()), scored,
                   threshold, rows[2]);
      std::fill(rows[2] + count, rows[2] + scored, std::uint8_t{0});
    } else {
      std::memset(rows[2], 0, static_cast<std::size_t>(count));
    }
    if (y > kRadius) suppress<V>(rows[0], rows[1], rows[2], count, y - 1, corners);
    std::rotate(rows, rows + 1, rows + 3);
  }
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) void corners_avx2(const cv::Mat& image, int columns, std::uint8_t threshold,
                                                  std::vector<Corner>& corners) {
  corners_of<Bytes32>(image, columns, threshold, corners);
}
#endif

void corners_plain(const cv::Mat& image, int columns, std::uint8_t threshold, std::vector<Corner>& corners) {
  corners_of<Bytes16>(image, columns, threshold, corners);
}

}  // namespace

std::vector<Corner> fast_corners(const cv::Mat& image, int threshold) {
  CV_Assert(image.type() == CV_8UC1 && threshold >= 1);
  std::vector<Corner> corners;
  if (image.cols <= 2 * kRadius || image.rows <= 2 * kRadius || threshold > 254) return corners;
  constexpr int kNarrowest = 2 * kRadius + static_cast<int>(sizeof(Bytes32));
  cv::Mat wide = image;
  if (image.cols < kNarrowest) {
    cv::copyMakeBorder(image, wide, 0, 0, 0, kNarrowest - image.cols, cv::BORDER_CONSTANT, 0);
  }
  corners.reserve(4096);
  const auto limit = static_cast<std::uint8_t>(threshold);
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) {
    corners_avx2(wide, image.cols, limit, corners);
  } else {
    corners_plain(wide, image.cols, limit, corners);
  }
#else
  corners_plain(wide, image.cols, limit, corners);
#endif
  return corners;
}

}  // namespace plumbline::features
