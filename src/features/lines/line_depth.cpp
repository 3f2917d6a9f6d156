// SPDX-License-Identifier: BSD-3-Clause
// Along the image of a 3D line the inverse depth is affine in the pixel position, so the fit lives in two
// numbers: 1/z(s) = (1 - s) / z_start + s / z_end, s in [0, 1]. RANSAC, weighting and covariance all work on
// these; the endpoints then lie on their pixels' rays by construction.
#include "plumbline/features/line_depth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "plumbline/core/clones.hpp"
#include "plumbline/features/line_segment.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::features {
namespace {

constexpr double kMinDepth = 0.1;      // m
constexpr int kCoverageBins = 10;      // stretches of a segment that should each hold support
constexpr int kMaxSide = 10;           // px
constexpr double kSameSurface = 0.02;  // of depth: spread across a few pixels of one (slanted) surface
constexpr std::uint32_t kSeed = 0x9E3779B9U;
constexpr int kRefinements = 3;
constexpr int kMostRounds = 1000;  // of RANSAC

struct Sample {
  double s;        // place along the segment, [0, 1]
  double inverse;  // 1 / z
};

struct InverseDepth {
  double start = 0.0;
  double end = 0.0;
  [[nodiscard]] double at(double s) const { return (1.0 - s) * start + s * end; }
};

double inverse_sigma(double inverse) { return sensor::depth_sigma(1.0 / inverse) * inverse * inverse; }

float depth_at(const cv::Mat& depth, double x, double y) {
  if (!(x > -0.5 && y > -0.5)) return 0.0F;
  const int u = static_cast<int>(x + 0.5);
  const int v = static_cast<int>(y + 0.5);
  if (u >= depth.cols || v >= depth.rows) return 0.0F;
  return depth.at<float>(v, u);
}

// Largest depth that may belong to the same surface as `z` a few pixels away.
double same_surface_limit(double z) { return z * (1.0 + kSameSurface) + 4.0 * sensor::depth_sigma(z); }

// Depth of the foreground surface at one position of the line: at a depth jump between the two sides, only
// samples of the nearer surface; of those the one nearest to the line. 0 if there is none.
double foreground_depth(const cv::Mat& depth, const Eigen::Vector2d& p, const Eigen::Vector2d& normal,
                        const LineDepthOptions& options) {
  std::array<double, 2 * kMaxSide + 1> across{};  // 0 = not usable
  std::array<double, 2 * kMaxSide + 1> sorted{};
  const int side = std::min(options.side_px, kMaxSide);

  // Depths across the line, in order and sorted
  std::size_t count = 0;
  for (int o = -side; o <= side; ++o) {
    const auto z = static_cast<double>(depth_at(depth, p.x() + o * normal.x(), p.y() + o * normal.y()));
    if (!(z >= kMinDepth && z <= options.max_depth_m)) continue;  // NaN too
    across[static_cast<std::size_t>(o + kMaxSide)] = z;
    std::size_t at = count++;
    for (; at > 0 && sorted[at - 1] > z; --at) sorted[at] = sorted[at - 1];
    sorted[at] = z;
  }

  // Sensors scatter single wild depths along a jump: a surface is what two samples agree on.
  std::size_t nearest = 0;
  while (nearest + 1 < count && sorted[nearest + 1] > same_surface_limit(sorted[nearest])) ++nearest;
  if (nearest + 1 >= count) return 0.0;

  const double low = sorted[nearest];
  const double high = same_surface_limit(low);
  const auto usable = [&](double z) { return z >= low && z <= high; };
  for (int o = 0; o <= side; ++o) {
    const double a = across[static_cast<std::size_t>(kMaxSide + o)];
    const double b = across[static_cast<std::size_t>(kMaxSide - o)];
    // Both sides: their mean is the depth on the line of a slanted surface.
    if (usable(a) && usable(b)) return 0.5 * (a + b);
    if (usable(a) || usable(b)) return usable(a) ? a : b;
  }

  return 0.0;
}

std::vector<Sample> collect(const LineSegment& segment, const cv::Mat& depth, int places,
                            const LineDepthOptions& options) {
  const Eigen::Vector2d start = segment.start.cast<double>();
  const Eigen::Vector2d along = (segment.end - segment.start).cast<double>();
  const Eigen::Vector2d normal = Eigen::Vector2d(-along.y(), along.x()).normalized();
  std::vector<Sample> samples;
  samples.reserve(static_cast<std::size_t>(places));

  // Foreground depth at places along the segment
  for (int i = 0; i < places; ++i) {
    const double s = (i + 0.5) / places;
    const double z = foreground_depth(depth, start + s * along, normal, options);
    if (z > 0.0) samples.push_back({s, 1.0 / z});
  }
  return samples;
}

bool plausible(const InverseDepth& line, const LineDepthOptions& options) {
  const double most = 1.0 / kMinDepth;
  const double least = 0.5 / options.max_depth_m;
  return line.start > least && line.end > least && line.start < most && line.end < most;
}

bool supports(const InverseDepth& line, const Sample& sample, double gate) {
  const double predicted = line.at(sample.s);
  return predicted > 0.0 && std::abs(sample.inverse - predicted) <= gate * inverse_sigma(predicted);
}

/// Samples in columns, for vector code; the last ones, up to a whole number of vectors, support nothing.
struct Columns {
  static constexpr std::size_t kAtATime = 8;
  std::vector<double> s;
  std::vector<double> inverse;
  explicit Columns(const std::vector<Sample>& samples) {
    // Padded with samples that no line explains
    const std::size_t size = (samples.size() + kAtATime - 1) / kAtATime * kAtATime;
    s.resize(size, 0.0);
    inverse.resize(size, std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      s[i] = samples[i].s;
      inverse[i] = samples[i].inverse;
    }
  }
};

// Number of samples that support a line, as `supports` decides; 0 as soon as it can no longer exceed
// `to_beat`.
PLUMBLINE_CLONES std::int64_t count_support(const double* s, const double* inverse, std::size_t count,
                                            const InverseDepth& line, double gate, std::int64_t to_beat) {
  const double start = line.start, end = line.end;
  std::int64_t support = 0;
  for (std::size_t first = 0; first < count; first += Columns::kAtATime) {
    if (support + static_cast<std::int64_t>(count - first) <= to_beat) return 0;
    for (std::size_t i = first; i < first + Columns::kAtATime; ++i) {
      const double predicted = (1.0 - s[i]) * start + s[i] * end;
      const double limit = gate * (sensor::depth_sigma(1.0 / predicted) * predicted * predicted);
      support += static_cast<std::int64_t>((predicted > 0.0) & (std::abs(inverse[i] - predicted) <= limit));
    }
  }
  return support;
}

// The same for every line: the result depends on its own samples only.
std::vector<std::uint32_t> draw_numbers(std::size_t count) {
  std::mt19937 random(kSeed);
  std::vector<std::uint32_t> numbers(count);
  for (std::uint32_t& n : numbers) n = static_cast<std::uint32_t>(random());
  return numbers;
}

std::optional<InverseDepth> ransac(const std::vector<Sample>& samples, const LineDepthOptions& options) {
  static const std::vector<std::uint32_t> numbers = draw_numbers(2 * kMostRounds);
  const Columns columns(samples);
  const auto count = static_cast<std::uint32_t>(samples.size());
  const auto rounds = static_cast<std::size_t>(std::clamp(options.ransac_rounds, 0, kMostRounds));
  std::optional<InverseDepth> best;

  std::int64_t most = 0;
  for (std::size_t round = 0; round < rounds && most < static_cast<std::int64_t>(count); ++round) {
    // A short base extrapolates badly: the two come from different thirds or farther apart.
    const Sample& a = samples[numbers[2 * round] % count];
    const Sample& b = samples[numbers[2 * round + 1] % count];
    if (std::abs(a.s - b.s) < 0.25) continue;

    const double slope = (b.inverse - a.inverse) / (b.s - a.s);
    const InverseDepth line{a.inverse - slope * a.s, a.inverse + slope * (1.0 - a.s)};
    if (!plausible(line, options)) continue;

    const std::int64_t support = count_support(columns.s.data(), columns.inverse.data(), samples.size(), line,
                                               options.inlier_sigmas, most);
    if (support > most) {
      most = support;
      best = line;
    }
  }

  return best;
}

struct Fit {
  InverseDepth line;
  Eigen::Matrix2d covariance;  // of (start, end)
  int inliers = 0;
  int bins = 0;  // of kCoverageBins with support
};

std::optional<Fit> least_squares(InverseDepth line, const std::vector<Sample>& samples, double gate) {
  Fit fit;
  for (int pass = 0; pass < kRefinements; ++pass) {
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    Eigen::Vector2d vector = Eigen::Vector2d::Zero();
    double chi2 = 0.0;
    unsigned bins = 0;
    fit.inliers = 0;

    // Normal equations in the inverse depth of both ends
    for (const Sample& q : samples) {
      if (!supports(line, q, gate)) continue;
      const double sigma = inverse_sigma(line.at(q.s));
      const Eigen::Vector2d basis = Eigen::Vector2d(1.0 - q.s, q.s) / sigma;
      information += basis * basis.transpose();
      vector += basis * (q.inverse / sigma);

      const double r = (q.inverse - line.at(q.s)) / sigma;
      chi2 += r * r;
      bins |= 1U << std::min(static_cast<int>(q.s * kCoverageBins), kCoverageBins - 1);
      ++fit.inliers;
    }

    // Both ends must be constrained
    if (fit.inliers < 3 || !(information.determinant() > 1e-9 * information.trace() * information.trace())) {
      return std::nullopt;
    }

    // The covariance grows with the residuals
    const Eigen::Vector2d solution = information.ldlt().solve(vector);
    line = {solution.x(), solution.y()};
    if (!(line.start > 0.0 && line.end > 0.0)) return std::nullopt;
    fit.covariance = information.inverse() * std::max(1.0, chi2 / (fit.inliers - 2));
    fit.bins = __builtin_popcount(bins);
  }

  fit.line = line;
  return fit;
}

Eigen::Vector3d ray_of(const Eigen::Vector2f& pixel, const sensor::Pinhole& camera) {
  return camera.unproject(static_cast<double>(pixel.x()), static_cast<double>(pixel.y()), 1.0);
}

EndpointNoise endpoint_noise(double inverse, double variance, const sensor::Pinhole& camera,
                             double pixel_sigma) {
  const double z = 1.0 / inverse;
  return {static_cast<float>(std::sqrt(variance) * z * z),
          static_cast<float>(z * pixel_sigma / std::sqrt(camera.fx * camera.fy))};
}

}  // namespace

Eigen::Matrix3d endpoint_covariance(const Eigen::Vector3d& end, const EndpointNoise& noise) {
  const Eigen::Vector3d along = static_cast<double>(noise.depth) * end / end.z();
  const double across = static_cast<double>(noise.across) * static_cast<double>(noise.across);
  return along * along.transpose() + Eigen::Vector3d(across, across, 0.0).asDiagonal().toDenseMatrix();
}

double endpoint_sigma(const Eigen::Vector3d& end, const EndpointNoise& noise) {
  return std::sqrt(endpoint_covariance(end, noise).trace());
}

void LineDepthOptions::declare(core::OptionTable& table) {
  table.integer("line.depth_samples", samples, {8, 400}, "", "Largest number of depth samples along a line");
  table.number("line.max_depth", max_depth_m, {0.5, 100.0}, "m", "Largest depth of 3D lines");
}

std::optional<Line3> fit_line_depth(const LineSegment& segment, const cv::Mat& depth_m,
                                    const sensor::Pinhole& camera, const LineDepthOptions& options) {
  const double length = static_cast<double>(segment.length());
  if (depth_m.empty() || !(length >= 2.0) || !std::isfinite(length)) return std::nullopt;
  CV_Assert(depth_m.type() == CV_32FC1);
  const int places = std::clamp(static_cast<int>(length), 2, options.samples);
  const std::vector<Sample> samples = collect(segment, depth_m, places, options);
  if (static_cast<int>(samples.size()) < options.min_inliers) return std::nullopt;

  // RANSAC, then least squares with its inliers
  const std::optional<InverseDepth> start = ransac(samples, options);
  if (!start) return std::nullopt;
  const std::optional<Fit> fit = least_squares(*start, samples, options.inlier_sigmas);
  if (!fit || !plausible(fit->line, options)) return std::nullopt;

  // Enough of the segment must have depth
  Line3 line;
  const double inlier_share = static_cast<double>(fit->inliers) / static_cast<double>(samples.size());
  const double coverage = static_cast<double>(fit->bins) / std::min(kCoverageBins, places);
  if (fit->inliers < options.min_inliers || inlier_share < options.min_inlier_share ||
      coverage < options.min_coverage) {
    return std::nullopt;
  }

  line.inlier_share = static_cast<float>(inlier_share);
  line.coverage = static_cast<float>(coverage);

  // Ends on the rays of their pixels
  const Eigen::Vector3d start_ray = ray_of(segment.start, camera);
  const Eigen::Vector3d end_ray = ray_of(segment.end, camera);
  line.start = start_ray / fit->line.start;
  line.end = end_ray / fit->line.end;
  line.start_noise = endpoint_noise(fit->line.start, fit->covariance(0, 0), camera, options.pixel_sigma);
  line.end_noise = endpoint_noise(fit->line.end, fit->covariance(1, 1), camera, options.pixel_sigma);
  return line;
}

}  // namespace plumbline::features
