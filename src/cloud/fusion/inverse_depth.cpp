// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/inverse_depth.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::cloud {
namespace {

constexpr float kSigmas = 3.0F;          // neighbours within this much noise are the same surface
constexpr float kSmoothTangent = 1.73F;  // up to 60 degrees from face on are smoothed over the whole window
constexpr float kLinkTangent = 3.73F;    // up to 75 degrees the surface is assumed to continue
constexpr float kCreaseSigmas = 4.0F;

/// Converts depth to 1/z; 0 where there is no measurement.
void invert(const float* depth, int count, float min_depth, float max_depth, float* inverse) {
  for (int i = 0; i < count; ++i) {
    const float z = depth[i];
    const bool valid = z >= min_depth && z <= max_depth;
    inverse[i] = valid ? 1.0F / z : 0.0F;
  }
}

/// Buffers of one smoothing pass along rows of `cells` cells.
struct Pass {
  explicit Pass(int cells)
      : gate(static_cast<std::size_t>(cells)), sum(gate.size()), weight(gate.size()), cells_(cells) {}

  void start(const float* reference) {
    for (int i = 0; i < cells_; ++i)
      gate[static_cast<std::size_t>(i)] = kSigmas * inverse_depth_sigma(reference[i]);
    std::copy(reference, reference + cells_, sum.begin());
    std::fill(weight.begin(), weight.end(), 1.0F);
  }
  /// Adds a pair of opposite neighbours to each cell where both lie on the surface of `reference`. Pairs keep
  /// the mean of a slanted plane unbiased where the window is cut by a border or a jump.
  void add(const float* before, const float* after, const float* reference, float reach) {
    const float* gates = gate.data();
    float* sums = sum.data();
    float* weights = weight.data();
    const int count = cells_;
    for (int i = 0; i < count; ++i) {
      const float limit = gates[i] + reach * reference[i];
      const float worst = std::max(std::abs(before[i] - reference[i]), std::abs(after[i] - reference[i]));
      const float same = worst < limit ? 1.0F : 0.0F;
      sums[i] += same * (before[i] + after[i]);
      weights[i] += same + same;
    }
  }
  /// A cell without measurement keeps the mean 0: its measured neighbours differ by more than any gate.
  void finish(float* mean) const {
    for (int i = 0; i < cells_; ++i) {
      mean[i] = sum[static_cast<std::size_t>(i)] / weight[static_cast<std::size_t>(i)];
    }
  }

  std::vector<float> gate, sum, weight;

 private:
  int cells_;
};

/// Smooths along image rows; result: all rows of the image, every stride-th column.
Grid smooth_along_rows(const cv::Mat& depth, int stride, int half, float min_depth, float max_depth,
                       float focal) {
  const int cells = (depth.cols + stride - 1) / stride;
  const int pad = half / stride + 1;
  Grid smoothed{cells, depth.rows,
                std::vector<float>(static_cast<std::size_t>(cells) * static_cast<std::size_t>(depth.rows))};
  std::vector<float> inverse(static_cast<std::size_t>(cells) * static_cast<std::size_t>(stride), 0.0F);

  // phases[k] holds pixels k, k + stride, ... so that neighbours of neighbouring cells lie side by side.
  const std::size_t padded = static_cast<std::size_t>(cells) + 2 * static_cast<std::size_t>(pad);
  std::vector<std::vector<float>> phases(static_cast<std::size_t>(stride), std::vector<float>(padded, 0.0F));

  Pass pass(cells);
  for (int v = 0; v < depth.rows; ++v) {
    invert(depth.ptr<float>(v), depth.cols, min_depth, max_depth, inverse.data());
    for (int k = 0; k < stride; ++k) {
      float* phase = phases[static_cast<std::size_t>(k)].data() + pad;
      auto at = static_cast<std::size_t>(k);
      for (int i = 0; i < cells; ++i, at += static_cast<std::size_t>(stride)) phase[i] = inverse[at];
    }

    const float* reference = phases[0].data() + pad;
    pass.start(reference);
    const auto neighbour = [&](int d) {
      const int shift = (d >= 0 ? d : d - stride + 1) / stride;
      return phases[static_cast<std::size_t>(d - shift * stride)].data() + pad + shift;
    };

    for (int d = 1; d <= half; ++d) {
      pass.add(neighbour(-d), neighbour(d), reference, static_cast<float>(d) * kSmoothTangent / focal);
    }

    pass.finish(smoothed.row(v));
  }

  return smoothed;
}

}  // namespace

Grid smooth_inverse_depth(const cv::Mat& depth, int stride, int window, float min_depth, float max_depth,
                          float focal) {
  const int half = window / 2;
  const Grid rows = smooth_along_rows(depth, stride, half, min_depth, max_depth, focal);
  Grid smoothed{rows.width, (depth.rows + stride - 1) / stride, {}};
  smoothed.values.resize(static_cast<std::size_t>(smoothed.width) *
                         static_cast<std::size_t>(smoothed.height));

  // Along columns, for the remaining rows only
  Pass pass(rows.width);
  for (int j = 0; j < smoothed.height; ++j) {
    const int v = j * stride;
    const float* reference = rows.row(v);
    pass.start(reference);

    for (int d = 1; d <= std::min({half, v, rows.height - 1 - v}); ++d) {
      pass.add(rows.row(v - d), rows.row(v + d), reference, static_cast<float>(d) * kSmoothTangent / focal);
    }
    pass.finish(smoothed.row(j));
  }

  return smoothed;
}

void widen_means(Grid& grid, int step, float noise, float wanted_m) {
  constexpr float kStraight = 2.5F * 2.45F;  // sigmas of before + after - 2 x middle
  const auto along = [&](std::ptrdiff_t stride, bool rows) {
    const std::vector<float> before_pass = grid.values;
    for (int j = 0; j < grid.height; ++j) {
      if (!rows && (j < step || j >= grid.height - step)) continue;

      const float* from = before_pass.data() + static_cast<std::ptrdiff_t>(j) * grid.width;
      float* to = grid.row(j);
      for (int i = rows ? step : 0; i < grid.width - (rows ? step : 0); ++i) {
        const float middle = from[i];
        const float sigma = noise * inverse_depth_sigma(middle);
        const float pair = from[i - stride] + from[i + stride];

        // Only where noisy, and straight within the noise
        const bool noisy = sigma > wanted_m * middle * middle;
        const bool straight = std::abs(pair - 2.0F * middle) < kStraight * sigma;
        to[i] = noisy && straight ? (pair + middle) * (1.0F / 3.0F) : middle;
      }
    }
  };

  // First along rows, then along columns
  along(step, true);
  along(static_cast<std::ptrdiff_t>(step) * grid.width, false);
}

Reach surface_reach(const Grid& grid, int stride, float focal, int longest) {
  const std::size_t count = grid.values.size();
  Reach reach{std::vector<std::uint8_t>(count), std::vector<std::uint8_t>(count),
              std::vector<std::uint8_t>(count), std::vector<std::uint8_t>(count)};
  const float tangent = static_cast<float>(stride) * kLinkTangent / focal;

  // Neighbours are linked if noise or slope explains their difference
  const auto linked = [tangent](float a, float b) {
    const float nearer = std::max(a, b);
    return std::min(a, b) > 0.0F && std::abs(a - b) < 2.0F * inverse_depth_sigma(nearer) + tangent * nearer;
  };
  const auto next = [longest](std::uint8_t n) { return static_cast<std::uint8_t>(std::min(longest, n + 1)); };
  const auto width = static_cast<std::size_t>(grid.width);
  const float* w = grid.values.data();

  // The reach grows by one with each link
  for (std::size_t row = 0; row < count; row += width) {
    for (std::size_t i = row + 1; i < row + width; ++i) {
      reach.left[i] = linked(w[i], w[i - 1]) ? next(reach.left[i - 1]) : std::uint8_t{0};
    }
    for (std::size_t i = row + width - 1; i > row; --i) {
      reach.right[i - 1] = linked(w[i], w[i - 1]) ? next(reach.right[i]) : std::uint8_t{0};
    }
  }

  for (std::size_t i = width; i < count; ++i) {
    reach.up[i] = linked(w[i], w[i - width]) ? next(reach.up[i - width]) : std::uint8_t{0};
  }
  for (std::size_t i = count; i-- > width;) {
    reach.down[i - width] = linked(w[i], w[i - width]) ? next(reach.down[i]) : std::uint8_t{0};
  }

  return reach;
}

Slope slope_along(const float* centre, std::ptrdiff_t step, int before, int after, int base, float sigma) {
  before = std::min(before, base);
  after = std::min(after, base);
  Slope slope;
  if (before + after < std::max(2, base / 2)) return slope;

  // Central difference over both sides
  slope.known = true;
  const float first = centre[-before * step];
  const float last = centre[after * step];
  slope.value = (last - first) / static_cast<float>(before + after);
  const int side = std::max(2, base / 3);
  if (before < side || after < side) return slope;

  // At a crease both sides differ by more than noise
  const float slope_before = (*centre - first) / static_cast<float>(before);
  const float slope_after = (last - *centre) / static_cast<float>(after);
  slope.bend = slope_after - slope_before;
  const float noise = sigma * (1.0F / static_cast<float>(before) + 1.0F / static_cast<float>(after));
  if (std::abs(slope.bend) < kCreaseSigmas * noise) return slope;

  // A crease within the base: the side without it is straight.
  const auto deviation = [&](float end, int reach, std::ptrdiff_t direction) {
    const int middle = reach / 2;
    const float expected = *centre + (end - *centre) * static_cast<float>(middle) / static_cast<float>(reach);
    return std::abs(centre[direction * middle] - expected);
  };

  slope.value = deviation(first, before, -step) <= deviation(last, after, step) ? slope_before : slope_after;
  return slope;
}

}  // namespace plumbline::cloud
