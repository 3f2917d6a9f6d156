// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closing/place_pose.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "plumbline/core/random.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;

constexpr std::size_t kFewPoints = 60;

// Limits within which a pair of points or lines fits a pose.
constexpr double kNearest_m = 0.1;  // nothing nearer to the camera fits
// Limit at octave 0: 3 standard deviations of 1.5 px, which includes the landmark's own error.
constexpr double kPoint_px = 4.5;
constexpr double kLine_px = 5.0;     // between the ends of one line and the other
constexpr double kLineCosine = 0.9;  // between their directions
double depth_gate_m(double measured_m) { return 0.03 + 4.0 * sensor::depth_sigma(measured_m); }

class Inliers {
 public:
  Inliers(const PosePairs& pairs, const sensor::Pinhole& camera) : pairs_(pairs), camera_(camera) {}

  /// True if more than `count` pairs fit. Most poses are wrong, which is clear after some of the pairs.
  [[nodiscard]] bool more_than(std::size_t count, const Rigid3& pose) const {
    std::size_t possible = pairs_.points.size() + pairs_.lines.size();
    for (std::size_t i = 0; i < pairs_.points.size() && possible > count; ++i)
      possible -= fits(pairs_.points[i], pose) ? 0 : 1;
    for (std::size_t i = 0; i < pairs_.lines.size() && possible > count; ++i)
      possible -= fits(pairs_.lines[i], pose) ? 0 : 1;
    return possible > count;
  }
  [[nodiscard]] RansacPose of(const Rigid3& pose) const {
    RansacPose result;
    result.query_from_match = pose;
    for (std::size_t i = 0; i < pairs_.points.size(); ++i) {
      if (fits(pairs_.points[i], pose)) result.points.push_back(static_cast<int>(i));
    }
    for (std::size_t i = 0; i < pairs_.lines.size(); ++i) {
      if (fits(pairs_.lines[i], pose)) result.lines.push_back(static_cast<int>(i));
    }
    return result;
  }

 private:
  [[nodiscard]] bool fits(const PointPair& pair, const Rigid3& pose) const {
    const Eigen::Vector3d p = pose * pair.match;
    if (p.z() < kNearest_m) return false;
    if ((camera_.project(p) - pair.query).norm() > kPoint_px * pair.sigma) return false;
    return !(pair.depth > 0.0) || std::abs(p.z() - pair.depth) < depth_gate_m(pair.depth);
  }
  [[nodiscard]] bool fits(const LinePair& pair, const Rigid3& pose) const {
    const Eigen::Vector3d a = pose * pair.match_start;
    const Eigen::Vector3d b = pose * pair.match_end;
    if (a.z() < kNearest_m || b.z() < kNearest_m) return false;
    const Eigen::Vector2d pa = camera_.project(a);
    const Eigen::Vector2d d = (camera_.project(b) - pa).normalized();
    if (!d.allFinite()) return false;
    const Eigen::Vector2d s = pair.query.start.cast<double>();
    const Eigen::Vector2d e = pair.query.end.cast<double>();
    if (d.dot((e - s).normalized()) < kLineCosine) return false;
    const auto across = [&](const Eigen::Vector2d& q) {
      return std::abs(d.x() * (q.y() - pa.y()) - d.y() * (q.x() - pa.x()));
    };
    if (across(s) > kLine_px || across(e) > kLine_px) return false;
    if (!pair.in_space) return true;
    const Eigen::Vector3d middle = 0.5 * (pair.query_start + pair.query_end);
    const Eigen::Vector3d direction = (b - a).normalized();
    return (middle - a).cross(direction).norm() < 0.05 + 4.0 * sensor::depth_sigma(middle.z());
  }

  const PosePairs& pairs_;
  const sensor::Pinhole& camera_;
};

using Sample = std::array<const PointPair*, 3>;

/// Up to four poses from three points.
std::vector<Rigid3> from_points(const Sample& sample, const sensor::Pinhole& camera) {
  std::vector<cv::Point3d> space;
  std::vector<cv::Point2d> image;
  for (const PointPair* pair : sample) {
    space.emplace_back(pair->match.x(), pair->match.y(), pair->match.z());
    image.emplace_back(pair->query.x(), pair->query.y());
  }

  // P3P needs no initial pose, and none is known for a place that may have been seen long ago.
  const cv::Matx33d k(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  cv::solveP3P(space, image, k, cv::noArray(), rotations, translations, cv::SOLVEPNP_AP3P);

  // Degenerate samples, such as points on one line, may yield solutions that are not finite.
  std::vector<Rigid3> poses;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const auto r = [&](int row) { return rotations[i].at<double>(row); };
    const auto t = [&](int row) { return translations[i].at<double>(row); };
    const Rigid3 pose(geometry::exp_so3({r(0), r(1), r(2)}), {t(0), t(1), t(2)});
    if (pose.rotation.allFinite() && pose.translation.allFinite()) poses.push_back(pose);
  }

  return poses;
}

/// One pose from two lines in space that are not parallel: the directions give the rotation, the distances
/// between the lines the translation.
std::optional<Rigid3> from_lines(const LinePair& one, const LinePair& two) {
  const Eigen::Vector3d a1 = (one.match_end - one.match_start).normalized();
  const Eigen::Vector3d a2 = (two.match_end - two.match_start).normalized();
  const Eigen::Vector3d b1 = (one.query_end - one.query_start).normalized();
  const Eigen::Vector3d b2 = (two.query_end - two.query_start).normalized();
  constexpr double kMinSine = 0.3;
  if (a1.cross(a2).norm() < kMinSine || b1.cross(b2).norm() < kMinSine) return std::nullopt;
  if (std::abs(a1.dot(a2) - b1.dot(b2)) > 0.1) return std::nullopt;

  const auto frame = [](const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    Eigen::Matrix3d m;
    m.col(0) = (u + v).normalized();
    m.col(2) = u.cross(v).normalized();
    m.col(1) = m.col(2).cross(m.col(0));
    return m;
  };
  const Eigen::Matrix3d rotation = frame(b1, b2) * frame(a1, a2).transpose();

  // Across each line, the moved line must meet the measured one: (I - d d^T)(R m + t - q) = 0.
  Eigen::Matrix3d h = Eigen::Matrix3d::Zero();

  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  for (const auto& [pair, d] : {std::pair{&one, b1}, std::pair{&two, b2}}) {
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    const Eigen::Vector3d m = 0.5 * (pair->match_start + pair->match_end);
    const Eigen::Vector3d q = 0.5 * (pair->query_start + pair->query_end);
    h += across;
    g += across * (q - rotation * m);
  }

  const Rigid3 pose(Eigen::Quaterniond(rotation), h.ldlt().solve(g));
  if (!pose.translation.allFinite()) return std::nullopt;
  return pose;
}

/// Rounds until a sample of `size` inliers was drawn with 99.9 %.
int rounds_needed(double inlier_share, int size, int at_most) {
  const double good = std::pow(inlier_share, size);
  if (good > 0.999) return 1;
  if (good < 1e-6) return at_most;
  return std::min(at_most, static_cast<int>(std::ceil(std::log(0.001) / std::log(1.0 - good))));
}

}  // namespace

std::optional<RansacPose> ransac_pose(const PosePairs& pairs, const sensor::Pinhole& camera, int max_rounds,
                                      int min_inliers, std::uint64_t seed) {
  std::vector<const LinePair*> in_space;
  for (const LinePair& pair : pairs.lines) {
    if (pair.in_space) in_space.push_back(&pair);
  }

  // Lines help where points are few; with many points, samples of lines would only take time.
  const bool by_points = pairs.points.size() >= 4;
  const bool by_lines = in_space.size() >= 3 && pairs.points.size() < kFewPoints;
  if (!by_points && !by_lines) return std::nullopt;

  const Inliers inliers(pairs, camera);
  core::SplitMix draw(seed);
  std::optional<RansacPose> best;
  std::size_t best_count = 0;
  const auto try_pose = [&](const Rigid3& pose) {
    if (!inliers.more_than(best_count, pose)) return;
    best = inliers.of(pose);
    best_count = best->points.size() + best->lines.size();
  };

  int needed = max_rounds;
  for (int round = 0; round < needed; ++round) {
    if (by_points && (!by_lines || round % 2 == 0)) {
      const std::size_t n = pairs.points.size();
      const std::array<std::size_t, 3> i{draw.below(n), draw.below(n), draw.below(n)};
      if (i[0] == i[1] || i[1] == i[2] || i[0] == i[2]) continue;

      const Sample sample{&pairs.points[i[0]], &pairs.points[i[1]], &pairs.points[i[2]]};
      for (const Rigid3& pose : from_points(sample, camera)) try_pose(pose);
    } else {
      const std::size_t i = draw.below(in_space.size());
      const std::size_t j = draw.below(in_space.size());
      if (i == j) continue;

      const auto pose = from_lines(*in_space[i], *in_space[j]);
      if (pose) try_pose(*pose);
    }

    // If lines are drawn, too, only every other round draws points, so twice as many rounds are needed.
    const double share =
        static_cast<double>(best_count) / static_cast<double>(pairs.points.size() + pairs.lines.size());
    needed = std::min(max_rounds, std::max(20, (by_lines ? 2 : 1) * rounds_needed(share, 3, max_rounds)));
  }
  if (!best || static_cast<int>(best_count) < min_inliers) return std::nullopt;

  return best;
}

}  // namespace plumbline::mapping
