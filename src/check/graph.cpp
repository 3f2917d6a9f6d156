// SPDX-License-Identifier: BSD-3-Clause
#include "graph.hpp"

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "plumbline/core/random.hpp"
#include "plumbline/geometry/alignment.hpp"
#include "samples.hpp"

namespace plumbline::check {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

/// An alignment is worth this much at best: neighbours err alike.
constexpr double kBestShift_m = 0.003;
constexpr double kBestTurn_rad = 0.002;
/// The path itself ties anchors in a row.
constexpr double kTie_per_root_s = 0.002;
constexpr int kRounds = 4;
constexpr double kApart_s = 30.0;  ///< draws tie one path to the next as if it went on after so long
constexpr std::uint64_t kSeedOfDraws = 62;

Matrix6d diagonal(double shift, double turn) {
  Vector6d values;
  values << Eigen::Vector3d::Constant(shift), Eigen::Vector3d::Constant(turn);
  return values.asDiagonal();
}

/// Motion of a camera's frame, seen in it, for a motion (t, w) of the world about `middle`.
Matrix6d seen_in(const Rigid3& world_from_camera, const Eigen::Vector3d& middle) {
  const Eigen::Matrix3d back = world_from_camera.rotation.transpose();
  Matrix6d b = Matrix6d::Zero();
  b.topLeftCorner<3, 3>() = back;
  b.topRightCorner<3, 3>() = -back * geometry::skew(world_from_camera.translation - middle);
  b.bottomRightCorner<3, 3>() = back;
  return b;
}

/// Least squares over one motion an anchor.
class Equations {
 public:
  Equations(const std::vector<GraphAnchor>& anchors, const std::vector<PairLink>& links)
      : anchors_(anchors), links_(links) {
    for (const GraphAnchor& anchor : anchors) middle_ += anchor.world_from_camera.translation;
    middle_ /= static_cast<double>(anchors.size());

    // No correction is better than the best ones are.
    for (const PairLink& link : links) {
      const Matrix6d own = (link.correction.information + Matrix6d::Identity() * 1e-3).inverse();
      const Matrix6d best = diagonal(kBestShift_m * kBestShift_m, kBestTurn_rad * kBestTurn_rad);
      trust_.push_back((own + best + link.correction.blur.covariance()).inverse());
    }
  }

  [[nodiscard]] Eigen::VectorXd solve(const std::vector<double>& weights) {
    return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix(weights, false)).solve(right_);
  }

  /// Columns are draws from the normal distribution whose information the equations are.
  [[nodiscard]] Eigen::MatrixXd draw(const std::vector<double>& weights) {
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix(weights, true));
    const Eigen::ArrayXd deviation = solver.vectorD().array().max(1e-12).rsqrt();
    Eigen::MatrixXd draws(deviation.size(), static_cast<Eigen::Index>(geometry::kPoseSamples));
    core::SplitMix random(kSeedOfDraws);
    for (Eigen::Index s = 0; s < draws.cols(); ++s) {
      for (Eigen::Index i = 0; i < draws.rows(); ++i) draws(i, s) = deviation[i] * normal(random);
      draws.col(s) = solver.permutationPinv() * solver.matrixU().solve(draws.col(s)).eval();
    }
    return draws;
  }

  /// Motions of the anchors about the world's origin.
  [[nodiscard]] std::vector<Vector6d> motions(const Eigen::VectorXd& x) const {
    std::vector<Vector6d> all;
    for (std::size_t a = 0; a < anchors_.size(); ++a) {
      Vector6d motion = of(x, a);
      motion.head<3>() -= motion.tail<3>().cross(middle_);
      all.push_back(motion);
    }
    return all;
  }

  /// Weight of Geman and McClure.
  [[nodiscard]] double weight(std::size_t l, const Eigen::VectorXd& x) const {
    constexpr double kScale = 9.0;
    const PairLink& link = links_[l];
    const Matrix6d b = seen_in(anchors_[link.second].world_from_camera, middle_);
    const Vector6d off = b * (of(x, link.first) - of(x, link.second)) - link.correction.motion;
    const double chi = off.dot(trust_[l] * off) / 6.0;
    return 1.0 / ((1.0 + chi / kScale) * (1.0 + chi / kScale));
  }

  [[nodiscard]] Eigen::Vector3d moved(std::size_t anchor, const Eigen::VectorXd& x) const {
    const Eigen::Vector3d& p = anchors_[anchor].world_from_camera.translation;
    const Vector6d motion = of(x, anchor);
    return p + motion.head<3>() + motion.tail<3>().cross(p - middle_);
  }

 private:
  /// The equations' left side; right_ becomes the other one. `all_tied`: one path is tied to the next, too.
  Eigen::SparseMatrix<double> matrix(const std::vector<double>& weights, bool all_tied) {
    const auto size = static_cast<Eigen::Index>(6 * anchors_.size());
    entries_.clear();
    right_ = Eigen::VectorXd::Zero(size);
    for (Eigen::Index i = 0; i < size; ++i) entries_.emplace_back(i, i, i < 6 ? 1e9 : 1e-6);

    for (std::size_t a = 0; a + 1 < anchors_.size(); ++a) {
      const bool next = anchors_[a].way == anchors_[a + 1].way;
      if (!next && !all_tied) continue;
      const double seconds = next ? std::max(0.03, anchors_[a + 1].stamp - anchors_[a].stamp) : kApart_s;
      const double tie = 1.0 / (kTie_per_root_s * kTie_per_root_s * seconds);
      add(a, a + 1, Vector6d::Zero(), diagonal(tie, tie));
    }
    for (std::size_t l = 0; l < links_.size(); ++l)
      add(links_[l].first, links_[l].second, links_[l].correction.motion, weights[l] * trust_[l]);

    Eigen::SparseMatrix<double> left(size, size);
    left.setFromTriplets(entries_.begin(), entries_.end());
    return left;
  }

  static Vector6d of(const Eigen::VectorXd& x, std::size_t anchor) {
    return x.segment<6>(static_cast<Eigen::Index>(6 * anchor));
  }
  void add(std::size_t first, std::size_t second, const Vector6d& motion, const Matrix6d& trust) {
    const Matrix6d b = seen_in(anchors_[second].world_from_camera, middle_);
    const Matrix6d block = b.transpose() * trust * b;
    const Vector6d value = b.transpose() * (trust * motion);
    const auto i = static_cast<Eigen::Index>(6 * first), j = static_cast<Eigen::Index>(6 * second);
    for (Eigen::Index r = 0; r < 6; ++r) {
      for (Eigen::Index c = 0; c < 6; ++c) {
        entries_.emplace_back(i + r, i + c, block(r, c));
        entries_.emplace_back(j + r, j + c, block(r, c));
        entries_.emplace_back(i + r, j + c, -block(r, c));
        entries_.emplace_back(j + r, i + c, -block(r, c));
      }
    }
    right_.segment<6>(i) += value;
    right_.segment<6>(j) -= value;
  }

  const std::vector<GraphAnchor>& anchors_;
  const std::vector<PairLink>& links_;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  std::vector<Matrix6d> trust_;
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::VectorXd right_;
};

}  // namespace

std::vector<Vector6d> without_whole(const std::vector<GraphAnchor>& anchors, std::vector<Vector6d> motions) {
  std::vector<Eigen::Vector3d> before, after;
  for (std::size_t a = 0; a < anchors.size(); ++a) {
    before.push_back(anchors[a].world_from_camera.translation);
    after.emplace_back(before[a] + motions[a].head<3>() + motions[a].tail<3>().cross(before[a]));
  }
  const Rigid3 whole = geometry::align_points(before, after);
  const Eigen::Vector3d turn = geometry::log_so3(whole.rotation);

  for (std::size_t a = 0; a < anchors.size(); ++a) {
    motions[a].tail<3>() -= turn;
    motions[a].head<3>() = after[a] - whole * before[a] - motions[a].tail<3>().cross(before[a]);
  }
  return motions;
}

GraphReport put_together(const std::vector<GraphAnchor>& anchors, const std::vector<PairLink>& links) {
  GraphReport report;
  report.weight.assign(links.size(), 1.0);
  report.shift_m.assign(anchors.size(), 0.0);
  if (anchors.size() < 3 || links.empty()) return report;

  Equations equations(anchors, links);
  Eigen::VectorXd found;
  for (int round = 0; round < kRounds; ++round) {
    found = equations.solve(report.weight);
    for (std::size_t l = 0; l < links.size(); ++l) report.weight[l] = equations.weight(l, found);
  }

  std::vector<Eigen::Vector3d> before, after;
  for (std::size_t a = 0; a < anchors.size(); ++a) {
    before.push_back(anchors[a].world_from_camera.translation);
    after.push_back(equations.moved(a, found));
  }
  const Rigid3 fit = geometry::align_points(before, after);

  double sum = 0.0;
  for (std::size_t a = 0; a < anchors.size(); ++a) {
    report.shift_m[a] = (fit * before[a] - after[a]).norm();
    sum += report.shift_m[a] * report.shift_m[a];
  }
  report.rms_m = std::sqrt(sum / static_cast<double>(anchors.size()));

  // The path keeps its place in what was found, and in draws of what may remain.
  report.found = without_whole(anchors, equations.motions(found));
  report.draws.resize(anchors.size());
  const Eigen::MatrixXd draws = equations.draw(report.weight);
  double squares = 0.0;

  for (Eigen::Index s = 0; s < draws.cols(); ++s) {
    const std::vector<Vector6d> motions = without_whole(anchors, equations.motions(draws.col(s)));
    for (std::size_t a = 0; a < anchors.size(); ++a) {
      const Eigen::Vector3d& at = anchors[a].world_from_camera.translation;
      squares += (motions[a].head<3>() + motions[a].tail<3>().cross(at)).squaredNorm();
      report.draws[a][static_cast<std::size_t>(s)] = motions[a];
    }
  }

  report.draws_rms_m =
      std::sqrt(squares / static_cast<double>(draws.cols()) / static_cast<double>(anchors.size()));
  return report;
}

}  // namespace plumbline::check
