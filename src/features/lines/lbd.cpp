// SPDX-License-Identifier: BSD-3-Clause
// Line band descriptor (Zhang & Koch, JVCIR 24, 2013; docs/method/features.md).
#include "plumbline/features/lbd.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/imgproc.hpp>

namespace plumbline::features {
namespace {

constexpr int kBands = 9;      // m
constexpr int kBandWidth = 7;  // w, rows
constexpr int kRows = kBands * kBandWidth;
constexpr int kMaxColumns = 32;       // samples along a line; longer lines are sampled more sparsely
constexpr float kRowSpacing = 0.75F;  // px of the half image: the support is 94 px wide in the full one
constexpr double kBlurSigma = 1.4;    // px of the half image; noise costs most recall
constexpr float kClip = 0.4F;         // no single entry may dominate
constexpr double kDirectionUnit = 4096.0;
constexpr double kFixed = 65536.0;  // unit of sample places
constexpr int kFixedBits = 16;

// Row sums of the four gradients: along +, along -, across +, across -.
using RowSums = std::array<std::array<float, 4>, kRows>;

// f_g(row) f_l(row, band): weight of each row in each band it touches (its own and both neighbours).
struct Weights {
  // [row][0..2]: weight in the band before, the own band, the band after.
  std::array<std::array<float, 3>, kRows> value{};
  Weights() {
    const double sigma_g = 0.5 * (kRows - 1);
    const double sigma_l = kBandWidth;
    for (int row = 0; row < kRows; ++row) {
      const double d = row - 0.5 * (kRows - 1);
      const double global = std::exp(-0.5 * d * d / (sigma_g * sigma_g));
      for (int k = 0; k < 3; ++k) {
        const int band = row / kBandWidth + k - 1;
        const double centre = band * kBandWidth + 0.5 * (kBandWidth - 1);
        const double local = std::exp(-0.5 * (row - centre) * (row - centre) / (sigma_l * sigma_l));
        value[static_cast<std::size_t>(row)][static_cast<std::size_t>(k)] =
            static_cast<float>(global * local);
      }
    }
  }
};

// Gradient of the blurred image at half resolution, (gx, gy) interleaved so that one 32-bit load fetches
// both.
cv::Mat gradients(const cv::Mat& gray) {
  const cv::Size half(gray.cols / 2, gray.rows / 2);
  cv::Mat image;
  cv::resize(gray(cv::Rect(0, 0, half.width * 2, half.height * 2)), image, half, 0.0, 0.0, cv::INTER_AREA);
  cv::GaussianBlur(image, image, cv::Size(7, 7), kBlurSigma, kBlurSigma, cv::BORDER_REPLICATE);
  cv::Mat parts[2];
  cv::Sobel(image, parts[0], CV_16S, 1, 0, 3);
  cv::Sobel(image, parts[1], CV_16S, 0, 1, 3);
  cv::Mat both;
  cv::merge(parts, 2, both);
  return both;
}

// Support region of one line: positions of its samples in the gradient image.
struct Support {
  Eigen::Vector2f direction;
  Eigen::Vector2f normal;  // to the right
  Eigen::Vector2f middle;
  float step = 1.0F;  // px between columns
  int columns = 4;    // multiple of 4
};

Support support_of(const LineSegment& segment) {
  Support s;
  s.direction = segment.direction();
  s.normal = {-s.direction.y(), s.direction.x()};

  // The gradient image has half the resolution
  s.middle = 0.5F * (segment.middle() - Eigen::Vector2f(0.5F, 0.5F));
  const float length = 0.5F * segment.length();
  s.columns = std::clamp(static_cast<int>(length / 4.0F) * 4, 4, kMaxColumns);
  s.step = std::max(length / static_cast<float>(s.columns), 0.25F);
  return s;
}

// True if the whole support region is within the image.
bool inside(const Support& s, const cv::Mat& gradient) {
  const float along = 0.5F * static_cast<float>(s.columns) * s.step;
  const float across = 0.5F * static_cast<float>(kRows) * kRowSpacing;
  const float reach_x = along * std::abs(s.direction.x()) + across * std::abs(s.direction.y()) + 1.0F;
  const float reach_y = along * std::abs(s.direction.y()) + across * std::abs(s.direction.x()) + 1.0F;
  return s.middle.x() > reach_x && s.middle.y() > reach_y &&
         s.middle.x() < static_cast<float>(gradient.cols) - reach_x &&
         s.middle.y() < static_cast<float>(gradient.rows) - reach_y;
}

using Row = std::array<std::int32_t, kMaxColumns>;  // packed (gx, gy)

std::int32_t fixed(float value) {
  const double scaled = static_cast<double>(value) * kFixed;
  return static_cast<std::int32_t>(scaled < 0.0 ? scaled - 0.5 : scaled + 0.5);
}

// Walks the support row by row and fetches the nearest gradients.
class Sampler {
 public:
  Sampler(const cv::Mat& gradient, const Support& s)
      : data_(reinterpret_cast<const std::int32_t*>(gradient.data)),
        columns_(s.columns),
        stride_(gradient.cols),
        last_x_(gradient.cols - 1),
        last_y_(gradient.rows - 1),
        inside_(inside(s, gradient)),
        step_x_(fixed(s.step * s.direction.x())),
        step_y_(fixed(s.step * s.direction.y())) {
    const float along = -0.5F * static_cast<float>(s.columns - 1) * s.step;
    corner_ = s.middle + along * s.direction - 0.5F * static_cast<float>(kRows - 1) * kRowSpacing * s.normal;
    row_step_ = kRowSpacing * s.normal;
  }

  void fetch(int row, Row& out) const {
    const Eigen::Vector2f start = corner_ + static_cast<float>(row) * row_step_;
    std::int32_t x = fixed(start.x() + 0.5F);
    std::int32_t y = fixed(start.y() + 0.5F);
    if (inside_) {
      for (std::size_t k = 0; k < static_cast<std::size_t>(columns_); ++k, x += step_x_, y += step_y_) {
        out[k] = data_[(y >> kFixedBits) * stride_ + (x >> kFixedBits)];
      }
      return;
    }
    // Where the support leaves the image, the border's gradient is repeated.
    for (std::size_t k = 0; k < static_cast<std::size_t>(columns_); ++k, x += step_x_, y += step_y_) {
      out[k] =
          data_[std::clamp(y >> kFixedBits, 0, last_y_) * stride_ + std::clamp(x >> kFixedBits, 0, last_x_)];
    }
  }

 private:
  const std::int32_t* data_;
  int columns_;
  int stride_;
  int last_x_;
  int last_y_;
  bool inside_;
  std::int32_t step_x_;
  std::int32_t step_y_;
  Eigen::Vector2f corner_;
  Eigen::Vector2f row_step_;
};

// Gradients turned into the line's frame and summed by sign, in whole numbers: no rounding, any order.
class RowSummer {
 public:
  explicit RowSummer(const Support& s) {
    const auto pair = [](const Eigen::Vector2f& v) {
      const auto x = static_cast<short>(std::lround(kDirectionUnit * static_cast<double>(v.x())));
      const auto y = static_cast<short>(std::lround(kDirectionUnit * static_cast<double>(v.y())));
      return cv::v_int16x8(x, y, x, y, x, y, x, y);
    };
    along_ = pair(s.direction);
    across_ = pair(s.normal);
  }

  [[nodiscard]] std::array<float, 4> operator()(const Row& row, int columns) const {
    cv::v_int32x4 along = cv::v_setzero_s32();
    cv::v_int32x4 along_abs = cv::v_setzero_s32();
    cv::v_int32x4 across = cv::v_setzero_s32();
    cv::v_int32x4 across_abs = cv::v_setzero_s32();

    // Four columns at a time
    for (int k = 0; k < columns; k += 4) {
      const cv::v_int16x8 g = cv::v_reinterpret_as_s16(cv::v_load(row.data() + k));
      const cv::v_int32x4 a = cv::v_dotprod(g, along_);
      const cv::v_int32x4 c = cv::v_dotprod(g, across_);
      along = along + a;
      along_abs = along_abs + cv::v_reinterpret_as_s32(cv::v_abs(a));
      across = across + c;
      across_abs = across_abs + cv::v_reinterpret_as_s32(cv::v_abs(c));
    }

    // Sums of the positive and of the negative parts
    const auto a = static_cast<float>(cv::v_reduce_sum(along));
    const auto a_abs = static_cast<float>(cv::v_reduce_sum(along_abs));
    const auto c = static_cast<float>(cv::v_reduce_sum(across));
    const auto c_abs = static_cast<float>(cv::v_reduce_sum(across_abs));
    return {0.5F * (a_abs + a), 0.5F * (a_abs - a), 0.5F * (c_abs + c), 0.5F * (c_abs - c)};
  }

 private:
  cv::v_int16x8 along_;
  cv::v_int16x8 across_;
};

// Sums of the gradients in each row of the support region.
RowSums row_sums(const cv::Mat& gradient, const LineSegment& segment) {
  const Support support = support_of(segment);
  const Sampler sampler(gradient, support);
  const RowSummer summer(support);
  RowSums sums;
  Row row{};
  for (int i = 0; i < kRows; ++i) {
    sampler.fetch(i, row);
    sums[static_cast<std::size_t>(i)] = summer(row, support.columns);
  }
  return sums;
}

void normalise(float* values, std::size_t count) {
  float sum = 0.0F;
  for (std::size_t i = 0; i < count; ++i) sum += values[i] * values[i];
  if (!(sum > 0.0F)) return;
  const float factor = 1.0F / std::sqrt(sum);
  for (std::size_t i = 0; i < count; ++i) values[i] *= factor;
}

// Statistics of band j over its own rows and those of its neighbours; layout: mean[4], deviation[4] per band.
BandStatistics band_statistics(const RowSums& sums, const Weights& weights) {
  std::array<std::array<float, 4>, kBands + 2> mean{};  // one more band at each side for samples outside
  std::array<std::array<float, 4>, kBands + 2> square{};

  // A row counts for its band and both neighbours
  for (std::size_t row = 0; row < kRows; ++row) {
    for (std::size_t k = 0; k < 3; ++k) {
      const float weight = weights.value[row][k];
      const std::size_t band = row / kBandWidth + k;
      for (std::size_t c = 0; c < 4; ++c) {
        const float v = weight * sums[row][c];
        mean[band][c] += v;
        square[band][c] += v * v;
      }
    }
  }

  // Mean and deviation; the outer bands have fewer rows
  std::array<float, 4 * kBands> means{};
  std::array<float, 4 * kBands> deviations{};
  for (std::size_t j = 0; j < kBands; ++j) {
    const float share = 1.0F / static_cast<float>(kBandWidth * (j == 0 || j + 1 == kBands ? 2 : 3));
    for (std::size_t c = 0; c < 4; ++c) {
      const float m = mean[j + 1][c] * share;
      means[4 * j + c] = m;
      deviations[4 * j + c] = std::sqrt(std::max(0.0F, square[j + 1][c] * share - m * m));
    }
  }

  // Normalised, clipped and normalised again, against contrast
  normalise(means.data(), means.size());
  normalise(deviations.data(), deviations.size());

  BandStatistics result;
  for (std::size_t j = 0; j < kBands; ++j) {
    for (std::size_t c = 0; c < 4; ++c) {
      result[8 * j + c] = std::min(means[4 * j + c], kClip);
      result[8 * j + 4 + c] = std::min(deviations[4 * j + c], kClip);
    }
  }

  normalise(result.data(), result.size());
  return result;
}

// All 36 pairs of bands but the four of bands farthest apart. Dropping others (the least discriminating ones,
// outer neighbours, those with the middle band) was tried: recall fell each time.
constexpr std::array<std::array<unsigned char, 2>, 32> kPairs = {
    {{0, 1}, {0, 2}, {0, 3}, {0, 4}, {0, 5}, {0, 6}, {1, 2}, {1, 3}, {1, 4}, {1, 5}, {1, 6},
     {2, 3}, {2, 4}, {2, 5}, {2, 6}, {2, 7}, {2, 8}, {3, 4}, {3, 5}, {3, 6}, {3, 7}, {3, 8},
     {4, 5}, {4, 6}, {4, 7}, {4, 8}, {5, 6}, {5, 7}, {5, 8}, {6, 7}, {6, 8}, {7, 8}}};

}  // namespace

std::vector<BandStatistics> band_statistics(const cv::Mat& gray, const std::vector<LineSegment>& segments) {
  std::vector<BandStatistics> result;
  if (segments.empty()) return result;
  CV_Assert(gray.type() == CV_8UC1 && gray.cols >= 2 && gray.rows >= 2);
  static const Weights weights;

  // One gradient image for all segments
  const cv::Mat gradient = gradients(gray);
  result.reserve(segments.size());
  for (const LineSegment& s : segments) result.push_back(band_statistics(row_sums(gradient, s), weights));
  return result;
}

LineDescriptor binarise(const BandStatistics& statistics) {
  LineDescriptor bits{};

  // Each bit: the statistic is larger in the first band
  for (std::size_t p = 0; p < kPairs.size(); ++p) {
    const float* a = statistics.data() + 8 * static_cast<std::size_t>(kPairs[p][0]);
    const float* b = statistics.data() + 8 * static_cast<std::size_t>(kPairs[p][1]);
    std::uint64_t byte = 0;
    for (unsigned c = 0; c < 8; ++c) byte |= static_cast<std::uint64_t>(a[c] > b[c]) << c;
    bits[p / 8] |= byte << (8 * (p % 8));
  }
  return bits;
}

std::vector<LineDescriptor> describe_lines(const cv::Mat& gray, const std::vector<LineSegment>& segments) {
  std::vector<LineDescriptor> result;
  result.reserve(segments.size());
  for (const BandStatistics& s : band_statistics(gray, segments)) result.push_back(binarise(s));
  return result;
}

}  // namespace plumbline::features
