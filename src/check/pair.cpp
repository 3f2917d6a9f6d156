// SPDX-License-Identifier: BSD-3-Clause
#include "pair.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace plumbline::check {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

constexpr int kSampleStep = 3;
constexpr double kPriorShift_m = 0.3;
constexpr double kPriorTurn_rad = 0.15;
constexpr double kFlowSigma_px = 0.2;
constexpr double kIndependent = 800.0;  ///< rows of depth: more are neighbours whose noise is the same

Matrix6d prior() {
  Vector6d diagonal;
  diagonal << Eigen::Vector3d::Constant(1.0 / (kPriorShift_m * kPriorShift_m)),
      Eigen::Vector3d::Constant(1.0 / (kPriorTurn_rad * kPriorTurn_rad));
  return diagonal.asDiagonal();
}

/// One measurement of the motion in units of its standard deviation.
struct Equation {
  Vector6d row;
  double value = 0.0;
};

std::vector<Equation> equations(const PairRows& rows, const sensor::Pinhole& camera, const DepthNoise& noise,
                                Rows use) {
  std::vector<Equation> all;
  all.reserve(rows.depth.size() + 2 * rows.flow.size());
  if (use != Rows::kFlow) {
    // Both frames are noisy, which doubles the variance. Neighbouring rows share their noise, so that many
    // rows count only as much as kIndependent.
    const double alike =
        std::sqrt(2.0 * std::max(1.0, static_cast<double>(rows.depth.size()) / kIndependent));

    for (const DepthRow& d : rows.depth) {
      const double sigma = alike * noise(d.point.z());
      Equation e;
      e.row << d.normal / sigma, d.point.cross(d.normal) / sigma;
      e.value = d.off_m / sigma;
      all.push_back(e);
    }
  }

  if (use != Rows::kDepth) {
    for (const FlowRow& f : rows.flow) {
      const Eigen::Vector3d& p = f.point;

      // Derivatives of the two pixel coordinates by the point: each of them gives one equation.
      const std::array<Eigen::Vector3d, 2> slopes{
          Eigen::Vector3d(camera.fx / p.z(), 0.0, -camera.fx * p.x() / (p.z() * p.z())),
          Eigen::Vector3d(0.0, camera.fy / p.z(), -camera.fy * p.y() / (p.z() * p.z()))};

      for (int k = 0; k < 2; ++k) {
        const Eigen::Vector3d& slope = slopes[static_cast<std::size_t>(k)];
        Equation e;
        e.row << slope / kFlowSigma_px, p.cross(slope) / kFlowSigma_px;
        e.value = f.off_px[k] / kFlowSigma_px;
        all.push_back(e);
      }
    }
  }
  return all;
}

}  // namespace

Matrix6d Correction::covariance() const { return (information + prior()).inverse(); }

double Correction::shift_m() const {
  const double own = covariance().topLeftCorner<3, 3>().trace();
  return std::sqrt(std::max(0.0, motion.head<3>().squaredNorm() - own));
}

double Correction::unexplained_m() const {
  const double shift = shift_m();
  return std::sqrt(std::max(0.0, shift * shift - 3.0 * blur.shift_m * blur.shift_m));
}

Matrix6d Blur::covariance() const {
  Vector6d diagonal;
  diagonal << Eigen::Vector3d::Constant(shift_m * shift_m), Eigen::Vector3d::Constant(turn_rad * turn_rad);
  return diagonal.asDiagonal();
}

Blur blur_of(const FramePoses& first, const FramePoses& second, double distance_m) {
  constexpr double kTime_s = 0.010;
  const double share = kTime_s / std::sqrt(3.0);
  const double turn = share * std::hypot(first.turn.norm(), second.turn.norm());
  return {std::hypot(share * std::hypot(first.velocity.norm(), second.velocity.norm()), distance_m * turn),
          turn};
}

double PairRows::distance_m() const {
  double sum = 0.0;
  for (const DepthRow& row : depth) sum += row.point.z();
  return depth.empty() ? 0.0 : sum / static_cast<double>(depth.size());
}

FirstView::FirstView(View view) : view_(std::move(view)) {
  const cv::Size& size = view_.camera->size();
  for (int y = kSampleStep / 2; y < size.height; y += kSampleStep) {
    for (int x = kSampleStep / 2; x < size.width; x += kSampleStep) {
      if (const auto normal = view_.normal({x, y})) samples_.push_back({view_.point({x, y}), *normal});
    }
  }
}

PairRows FirstView::depth_rows(const View& second) const {
  constexpr double kSameSide = 0.7;
  constexpr std::size_t kMostRows = 1500;
  const Rigid3 second_from_first = second.poses.world_from_depth.inverse() * view_.poses.world_from_depth;

  PairRows rows;
  for (const Sample& sample : samples_) {
    const Eigen::Vector3d p = second_from_first * sample.point;
    const auto at = second.camera->grid_point(p);
    if (!at) continue;

    const auto normal = second.normal(*at);
    if (!normal) continue;
    ++rows.common;
    if (second.z(*at) > p.z() + 0.03 + 0.03 * p.z()) ++rows.through;
    if (normal->dot(second_from_first.rotation * sample.normal) < kSameSide) continue;
    const double off = normal->dot(second.point(*at) - p);
    if (std::abs(off) < 0.05 + 0.04 * p.z()) rows.depth.push_back({p, *normal, off});
  }

  constexpr std::size_t kFewest = 40;
  constexpr double kLeastShare = 0.15;
  rows.meet = rows.depth.size() >= kFewest &&
              static_cast<double>(rows.depth.size()) > kLeastShare * static_cast<double>(samples_.size());

  if (rows.common > 0) rows.found = static_cast<double>(rows.depth.size()) / static_cast<double>(rows.common);

  // Evenly spread ones are enough.
  if (rows.depth.size() > kMostRows) {
    const std::size_t all = rows.depth.size();
    for (std::size_t i = 0; i < kMostRows; ++i) rows.depth[i] = rows.depth[i * all / kMostRows];
    rows.depth.resize(kMostRows);
    rows.common = rows.common * kMostRows / all;
    rows.through = rows.through * kMostRows / all;
  }
  return rows;
}

Correction correction_of(const PairRows& rows, const sensor::Pinhole& second, const DepthNoise& noise,
                         Rows use) {
  constexpr int kRounds = 5;
  constexpr int kFirstRounds = 3;
  constexpr double kHuber = 1.5;
  constexpr double kFarthest = 60.0;
  const std::vector<Equation> all = equations(rows, second, noise, use);
  const Matrix6d weak = prior();

  Correction found;
  for (int round = 0; round < kRounds; ++round) {
    Matrix6d information = Matrix6d::Zero();
    Vector6d right = Vector6d::Zero();

    // Huber weights bound the effect of outliers; in the last rounds rows that are very far off are left out.
    for (const Equation& e : all) {
      const double off = std::abs(e.value - e.row.dot(found.motion));
      if (round >= kFirstRounds && off > kFarthest) continue;  // at first a jump takes all rows far away
      const double weight = kHuber / std::max(kHuber, off);
      information.noalias() += e.row * (weight * e.row.transpose());
      right.noalias() += weight * e.value * e.row;
    }

    // The reported information is that of the rows alone; the prior only keeps
    // unconstrained directions finite.
    found.information = information;
    found.motion = (information + weak).ldlt().solve(right);
  }
  return found;
}

}  // namespace plumbline::check
