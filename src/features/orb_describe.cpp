// SPDX-License-Identifier: BSD-3-Clause
#include "orb_describe.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "plumbline/core/clones.hpp"

namespace plumbline::features {
namespace {

constexpr int kHalfPatch = 15;
constexpr std::size_t kPatchRows = 2 * kHalfPatch + 1;
constexpr std::size_t kPatchColumns = 32;  // the last one weighs nothing
constexpr std::size_t kTests = 256;
constexpr int kSmoothingReach = 3;  // of the smoothing, px

// ---- orientation

/// Weights of the patch's pixels in its first moments. u^2 + v^2 <= r (r + 1) is the same seen along x and
/// along y; rounding the width of each row, as usual, is not, and bends orientations by several degrees.
struct Moments {
  std::array<std::int16_t, kPatchRows * kPatchColumns> x{};
  std::array<std::int16_t, kPatchRows * kPatchColumns> y{};
  Moments() {
    for (int v = -kHalfPatch; v <= kHalfPatch; ++v) {
      for (int u = -kHalfPatch; u <= kHalfPatch; ++u) {
        if (u * u + v * v > kHalfPatch * (kHalfPatch + 1)) continue;
        const auto i = static_cast<std::size_t>(v + kHalfPatch) * kPatchColumns +
                       static_cast<std::size_t>(u + kHalfPatch);
        x[i] = static_cast<std::int16_t>(u);
        y[i] = static_cast<std::int16_t>(v);
      }
    }
  }
};

PLUMBLINE_CLONES void weigh(const std::uint8_t* patch, const Moments& moments, int& m10, int& m01) {
  int sum_x = 0;
  int sum_y = 0;
  for (std::size_t i = 0; i < kPatchRows * kPatchColumns; ++i) {
    const auto value = static_cast<std::int16_t>(patch[i]);
    sum_x += moments.x[i] * value;
    sum_y += moments.y[i] * value;
  }
  m10 = sum_x;
  m01 = sum_y;
}

// ---- descriptor

/// Where the tests look: test i asks whether the pixel at place i is darker than that at place kTests + i.
struct TestPlaces {
  std::array<float, 2 * kTests> x{};
  std::array<float, 2 * kTests> y{};
};

/// Lowest and highest place of both pixels of each test along some direction, and which of them is the first.
struct Span {
  int first = 0;
  int second = 0;
};
using Spans = std::array<std::optional<Span>, kTests>;

/// Asks OpenCV's ORB about pictures that are black before and white behind a border at `dx u + dy v = c`, and
/// about their negatives. Behind the smoothing the answer is "darker" as long as the border is less than
/// `blur` from either of both pixels or between them. All places of the border side by side in one picture.
Spans ask(int dx, int dy, int blur) {
  constexpr int kTile = 64;
  constexpr int kTilesAcross = 10;  // tiles
  const int farthest = (dx + dy) * 18 + blur;
  Spans spans;
  const auto orb =
      cv::ORB::create(kTilesAcross * kTilesAcross, 1.2F, 1, kTile / 4, 0, 2, cv::ORB::HARRIS_SCORE, 31, 20);
  for (const bool negative : {false, true}) {
    cv::Mat picture(kTilesAcross * kTile, kTilesAcross * kTile, CV_8UC1, cv::Scalar(0));
    std::vector<cv::KeyPoint> centres;
    for (int c = -farthest; c <= farthest; ++c) {
      const int tile = c + farthest;
      const cv::Rect area(tile % kTilesAcross * kTile, tile / kTilesAcross * kTile, kTile, kTile);
      for (int v = 0; v < kTile; ++v) {
        for (int u = 0; u < kTile; ++u) {
          const bool behind = dx * (u - kTile / 2) + dy * (v - kTile / 2) >= c;
          picture.at<std::uint8_t>(area.y + v, area.x + u) = behind != negative ? 255 : 0;
        }
      }
      centres.emplace_back(static_cast<float>(area.x + kTile / 2), static_cast<float>(area.y + kTile / 2),
                           31.0F, 0.0F, 1.0F, 0, c);
    }
    cv::Mat answers;
    orb->compute(picture, centres, answers);
    for (std::size_t i = 0; i < kTests; ++i) {
      std::optional<int> lowest;
      int highest = 0;
      for (std::size_t k = 0; k < centres.size(); ++k) {
        const std::uint8_t byte = answers.at<std::uint8_t>(static_cast<int>(k), static_cast<int>(i / 8));
        if ((byte >> (i % 8) & 1) == 0) continue;
        if (!lowest) lowest = centres[k].class_id;
        highest = centres[k].class_id;
      }
      if (!lowest) continue;
      const Span span{*lowest + blur - 1, highest - blur};
      spans[i] = negative ? Span{span.second, span.first} : span;
    }
  }
  return spans;
}

/// The tests were learned by ORB's authors. OpenCV keeps them to itself, so they are read off its answers:
/// its descriptors and ours stay the same bits, whatever its version.
TestPlaces read_test_places() {
  const Spans x = ask(1, 0, kSmoothingReach);
  const Spans y = ask(0, 1, kSmoothingReach);
  const Spans sum = ask(1, 1, 2 * kSmoothingReach);
  TestPlaces places;
  for (std::size_t i = 0; i < kTests; ++i) {
    // Where both pixels are alike in one coordinate, it comes from the other and the sum.
    const Span s = sum[i].value_or(Span{});
    const Span other_y = y[i].value_or(Span{});
    const Span px = x[i].value_or(Span{s.first - other_y.first, s.second - other_y.second});
    const Span py = y[i].value_or(Span{s.first - px.first, s.second - px.second});
    places.x[i] = static_cast<float>(px.first);
    places.y[i] = static_cast<float>(py.first);
    places.x[kTests + i] = static_cast<float>(px.second);
    places.y[kTests + i] = static_cast<float>(py.second);
  }
  return places;
}

/// Offsets in the picture of the places turned by (cosine, sine), rounded to whole pixels, half to even.
PLUMBLINE_CLONES void turn(const TestPlaces& places, float cosine, float sine, std::int32_t step,
                           std::int32_t* offsets) {
  constexpr float kRound = 12582912.0F;  // 1.5 * 2^23: nothing behind the point is left
  for (std::size_t i = 0; i < 2 * kTests; ++i) {
    const float x = places.x[i] * cosine - places.y[i] * sine;
    const float y = places.x[i] * sine + places.y[i] * cosine;
    offsets[i] = static_cast<std::int32_t>((y + kRound) - kRound) * step +
                 static_cast<std::int32_t>((x + kRound) - kRound);
  }
}

}  // namespace

float orb_orientation(const cv::Mat& image, int x, int y) {
  static const Moments moments;
  std::array<std::uint8_t, kPatchRows * kPatchColumns> patch;
  for (std::size_t v = 0; v < kPatchRows; ++v) {
    std::memcpy(patch.data() + v * kPatchColumns,
                image.ptr<std::uint8_t>(y - kHalfPatch + static_cast<int>(v)) + x - kHalfPatch,
                kPatchColumns);
  }
  int m10 = 0;
  int m01 = 0;
  weigh(patch.data(), moments, m10, m01);
  return cv::fastAtan2(static_cast<float>(m01), static_cast<float>(m10));
}

cv::Mat orb_smooth(const cv::Mat& image) {
  CV_Assert(image.type() == CV_8UC1 && image.cols > kSmoothingReach && image.rows > kSmoothingReach);
  cv::Mat wide;
  cv::copyMakeBorder(image, wide, kSmoothingReach, kSmoothingReach, kSmoothingReach, kSmoothingReach,
                     cv::BORDER_REFLECT_101);
  cv::Mat result;
  // Of a part of a picture, which OpenCV smooths in floating point, as cv::ORB does.
  cv::GaussianBlur(wide(cv::Rect(kSmoothingReach, kSmoothingReach, image.cols, image.rows)), result, {7, 7},
                   2.0, 2.0, cv::BORDER_REFLECT_101);
  return result;
}

Descriptor256 orb_descriptor(const cv::Mat& smooth, int x, int y, float angle_degrees) {
  static const TestPlaces places = read_test_places();
  const float angle = angle_degrees * static_cast<float>(CV_PI / 180.0);
  std::array<std::int32_t, 2 * kTests> offsets;
  turn(places, static_cast<float>(std::cos(static_cast<double>(angle))),
       static_cast<float>(std::sin(static_cast<double>(angle))), static_cast<std::int32_t>(smooth.step1()),
       offsets.data());
  const std::uint8_t* centre = smooth.ptr<std::uint8_t>(y) + x;
  Descriptor256 bits{};
  for (std::size_t word = 0; word < 4; ++word) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 64; ++i) {
      const std::size_t k = 64 * word + i;
      value |= static_cast<std::uint64_t>(centre[offsets[k]] < centre[offsets[kTests + k]]) << i;
    }
    bits[word] = value;
  }
  return bits;
}

}  // namespace plumbline::features
