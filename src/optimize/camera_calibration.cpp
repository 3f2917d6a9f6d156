// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/optimize/camera_calibration.hpp"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "ceres_solve.hpp"

namespace plumbline::optimize {
namespace {

using CameraRow = Eigen::Matrix<double, 1, kCameraUnknowns>;
constexpr int kStep = 6;  // turn, then shift

/// A point in the camera when its row was read, and how it moves with the unknowns. The pose is that of the
/// problem, turned and moved by `step`.
struct RowPoint {
  Eigen::Vector3d p;
  Eigen::Vector3d by_readout;
  Eigen::Matrix<double, 3, kStep> by_step;
  Eigen::Matrix3d by_point;

  /// `share`: of the readout, from the middle row to this one.
  RowPoint(const CalibrationPose& pose, double share, const double* change, const double* step,
           const double* point) {
    const Eigen::Map<const Eigen::Vector3d> turn(step);
    const Eigen::Map<const Eigen::Vector3d> shift(step + 3);
    const Eigen::Map<const Eigen::Vector3d> world(point);
    const Eigen::Matrix3d rotation = geometry::exp_so3(turn);
    const Eigen::Vector3d turned = rotation * (pose.camera_from_world.rotation * world);
    const Eigen::Vector3d still = turned + pose.camera_from_world.translation + shift;

    const Eigen::Matrix3d spin = geometry::skew(pose.velocity.tail<3>());
    const double seconds = change[kReadout] * share;
    const Eigen::Matrix3d moved = Eigen::Matrix3d::Identity() + seconds * spin;
    const Eigen::Vector3d motion = pose.velocity.head<3>() + spin * still;
    p = still + seconds * motion;
    by_readout = share * motion;
    by_step.leftCols<3>() = -moved * geometry::skew(turned) * left_jacobian(turn);
    by_step.rightCols<3>() = moved;
    by_point = moved * rotation * pose.camera_from_world.rotation;
  }

 private:
  /// exp(turn + d) = exp(J d) exp(turn), for small d.
  static Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& turn) {
    const double angle2 = turn.squaredNorm();
    const Eigen::Matrix3d k = geometry::skew(turn);
    if (angle2 < 1e-8) return Eigen::Matrix3d::Identity() + 0.5 * k + k * k / 6.0;
    const double angle = std::sqrt(angle2);
    return Eigen::Matrix3d::Identity() + (1.0 - std::cos(angle)) / angle2 * k +
           (angle - std::sin(angle)) / (angle2 * angle) * k * k;
  }
};

/// Rows of derivatives with respect to the camera, the step and the point, if requested.
template <int kRows>
class Derivatives {
 public:
  explicit Derivatives(double** blocks) : to_(blocks) {}
  void put(const Eigen::Matrix<double, kRows, kCameraUnknowns>& by_camera,
           const Eigen::Matrix<double, kRows, 3>& by_p, const RowPoint& row) const {
    if (to_ == nullptr) return;

    // The readout time moves the point
    Eigen::Matrix<double, kRows, kCameraUnknowns> camera = by_camera;
    camera.col(kReadout) += by_p * row.by_readout;
    store<kCameraUnknowns>(0, camera);
    store<kStep>(1, by_p * row.by_step);
    store<3>(2, by_p * row.by_point);
  }

 private:
  double** to_;
  template <int kColumns>
  void store(int block, const Eigen::Matrix<double, kRows, kColumns>& matrix) const {
    if (to_[block] == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, kRows, kColumns, Eigen::RowMajor>> rows(to_[block]);
    rows = matrix;
  }
};

/// e = (u - K distort(pi(p))) / sigma.
class PixelCost final : public ceres::SizedCostFunction<2, kCameraUnknowns, kStep, 3> {
 public:
  PixelCost(const CalibrationObservation& seen, const CalibrationPose& pose, double share,
            const sensor::Camera& camera)
      : seen_(&seen), pose_(&pose), share_(share), camera_(&camera) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const double* change = parameters[0];
    const RowPoint row(*pose_, share_, change, parameters[1], parameters[2]);
    if (row.p.z() < 0.05) return false;
    const Eigen::Vector2d ray(row.p.x() / row.p.z(), row.p.y() / row.p.z());

    // Distortion and focal length with their changes
    sensor::Lens lens = camera_->lens();
    lens.k[0] += change[kK1];
    lens.k[1] += change[kK2];
    const Eigen::Vector2d distorted = lens.distort(ray);
    const sensor::Pinhole& c = camera_->color;
    const Eigen::Vector2d focal = Eigen::Vector2d(c.fx, c.fy) * (1.0 + change[kFocal]);
    const Eigen::Vector2d centre(c.cx + change[kCentreX], c.cy + change[kCentreY]);
    const double weight = 1.0 / seen_->pixel_sigma;

    Eigen::Map<Eigen::Vector2d>(residuals).noalias() =
        weight * (seen_->pixel - focal.cwiseProduct(distorted) - centre);

    if (jacobians == nullptr) return true;

    // Derivatives by the point
    const Eigen::Matrix2d by_ray = lens.jacobian(ray);
    const sensor::Lens::ByCoefficients by_k = lens.by_coefficients(ray);
    Eigen::Matrix<double, 2, 3> ray_by_p;
    ray_by_p << 1.0, 0.0, -ray.x(), 0.0, 1.0, -ray.y();
    const Eigen::Matrix<double, 2, 3> by_p = -weight / row.p.z() * focal.asDiagonal() * by_ray * ray_by_p;

    // Derivatives by the camera
    Eigen::Matrix<double, 2, kCameraUnknowns> by_camera = Eigen::Matrix<double, 2, kCameraUnknowns>::Zero();
    by_camera.col(kFocal) = -weight * Eigen::Vector2d(c.fx, c.fy).cwiseProduct(distorted);
    by_camera(0, kCentreX) = -weight;
    by_camera(1, kCentreY) = -weight;
    by_camera.col(kK1) = -weight * by_k.by_k1 * focal.cwiseProduct(ray);
    by_camera.col(kK2) = by_k.k2_by_k1 * by_camera.col(kK1);

    Derivatives<2>(jacobians).put(by_camera, by_p, row);
    return true;
  }

 private:
  const CalibrationObservation* seen_;
  const CalibrationPose* pose_;
  double share_;
  const sensor::Camera* camera_;
};

/// e = (z - p_z / (1 - p_z slope.(x, y)) - delay rate) / sigma: error of the measured depth of a point at p.
class DepthCost final : public ceres::SizedCostFunction<1, kCameraUnknowns, kStep, 3> {
 public:
  DepthCost(const CalibrationObservation& seen, const CalibrationPose& pose, double share)
      : seen_(&seen), pose_(&pose), share_(share) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const double* change = parameters[0];
    const RowPoint row(*pose_, share_, change, parameters[1], parameters[2]);

    // Depth as a camera with these slopes measures it
    const double z = row.p.z();
    const double grow = 1.0 - z * (change[kSlopeX] * seen_->ray.x() + change[kSlopeY] * seen_->ray.y());
    if (grow < 0.1) return false;
    const double weight = 1.0 / seen_->depth_sigma;
    residuals[0] = weight * (seen_->depth - z / grow - change[kDelay] * seen_->depth_rate);
    if (jacobians == nullptr) return true;

    CameraRow by_camera = CameraRow::Zero();
    by_camera(kSlopeX) = -weight * z * z * seen_->ray.x() / (grow * grow);
    by_camera(kSlopeY) = -weight * z * z * seen_->ray.y() / (grow * grow);
    by_camera(kDelay) = -weight * seen_->depth_rate;
    const Eigen::RowVector3d by_p(0.0, 0.0, -weight / (grow * grow));
    Derivatives<1>(jacobians).put(by_camera, by_p, row);
    return true;
  }

 private:
  const CalibrationObservation* seen_;
  const CalibrationPose* pose_;
  double share_;
};

constexpr std::size_t kSteps = kStep;

/// All unknowns in one buffer, because the order of Ceres' sums depends on addresses.
class CameraUnknowns {
 public:
  CameraUnknowns(const CalibrationProblem& problem, const CameraChange& change)
      : poses_(problem.poses.size()) {
    numbers_.assign(kCameraUnknowns + kSteps * poses_ + 3 * problem.points.size(), 0.0);
    std::copy_n(change.data(), kCameraUnknowns, numbers_.data());
    for (std::size_t i = 0; i < problem.points.size(); ++i)
      std::copy_n(problem.points[i].data(), 3, point(static_cast<int>(i)));
  }
  double* change() { return numbers_.data(); }

  /// All poses and points: turn and shift of each pose, then the coordinates of each point.
  Eigen::Map<Eigen::VectorXd> others() {
    return {numbers_.data() + kCameraUnknowns, static_cast<Eigen::Index>(numbers_.size() - kCameraUnknowns)};
  }
  double* step(int i) { return numbers_.data() + kCameraUnknowns + kSteps * static_cast<std::size_t>(i); }
  double* point(int i) {
    return numbers_.data() + kCameraUnknowns + kSteps * poses_ + 3 * static_cast<std::size_t>(i);
  }

 private:
  std::size_t poses_;
  std::vector<double> numbers_;
};

void add_observations(const CalibrationProblem& problem, CameraUnknowns& unknowns,
                      ceres::LossFunction* pixel_loss, ceres::LossFunction* depth_loss, ceres::Problem& to) {
  const double height = problem.camera.color.height;
  for (const CalibrationObservation& o : problem.observations) {
    const CalibrationPose& pose = problem.poses[static_cast<std::size_t>(o.pose)];

    // Readout time of the row, relative to the middle
    const double share = o.pixel.y() / height - 0.5;
    double* step = unknowns.step(o.pose);
    double* point = unknowns.point(o.point);
    to.AddResidualBlock(new PixelCost(o, pose, share, problem.camera), pixel_loss, unknowns.change(), step,
                        point);
    if (pose.fixed) to.SetParameterBlockConstant(step);
    if (!(o.depth > 0.0)) continue;
    to.AddResidualBlock(new DepthCost(o, pose, share), depth_loss, unknowns.change(), step, point);
  }
}

/// Moves poses and points to where they are expected for the present camera, from how they followed it when
/// it was adjusted last, unless the cost is higher there: a point that is seen along one ray only follows
/// wildly.
void follow_camera(const CalibrationProblem& problem, CameraUnknowns& unknowns,
                   ceres::Problem& ceres_problem) {
  if (problem.following.rows() == 0) return;
  double cost = 0.0, expected = 0.0;
  const bool possible = ceres_problem.Evaluate({}, &cost, nullptr, nullptr, nullptr);

  const Eigen::VectorXd start = unknowns.others();
  const Eigen::Map<const CameraChange> change(unknowns.change());
  unknowns.others() += problem.following * (change - problem.optimum);
  const bool follows = ceres_problem.Evaluate({}, &expected, nullptr, nullptr, nullptr);
  if (possible && !(follows && expected < cost)) unknowns.others() = start;
}

/// Adjusts poses and points for the present camera.
bool adjust(const CalibrationProblem& problem, CameraUnknowns& unknowns, ceres::Problem& ceres_problem) {
  auto* ordering = new ceres::ParameterBlockOrdering;  // owned by the solver's options
  for (const CalibrationObservation& o : problem.observations) {
    ordering->AddElementToGroup(unknowns.point(o.point), 0);
    ordering->AddElementToGroup(unknowns.step(o.pose), 1);
  }
  ordering->AddElementToGroup(unknowns.change(), 1);
  ceres_problem.SetParameterBlockConstant(unknowns.change());
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  solver.linear_solver_ordering.reset(ordering);
  solver.max_num_iterations = 15;
  solver.function_tolerance = 1e-4;
  solver.initial_trust_region_radius = 1e7;  // close to the minimum already: nearly Gauss-Newton
  const ceres::Solver::Summary summary = solve(std::move(solver), ceres_problem);
  ceres_problem.SetParameterBlockVariable(unknowns.change());
  return summary.IsSolutionUsable();
}

/// The camera's columns of the Jacobian, then those of poses and points that the cost depends on.
ceres::Problem::EvaluateOptions columns_of(const CalibrationProblem& problem, CameraUnknowns& unknowns,
                                           const ceres::Problem& ceres_problem) {
  ceres::Problem::EvaluateOptions order;
  order.parameter_blocks.push_back(unknowns.change());
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    double* step = unknowns.step(static_cast<int>(i));
    if (!problem.poses[i].fixed && ceres_problem.HasParameterBlock(step))
      order.parameter_blocks.push_back(step);
  }

  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    double* point = unknowns.point(static_cast<int>(i));
    if (ceres_problem.HasParameterBlock(point)) order.parameter_blocks.push_back(point);
  }
  return order;
}

/// Derivatives by the camera when poses and points follow it.
struct ByCamera {
  Eigen::MatrixXd rows;    ///< rows of the Jacobian
  Eigen::MatrixXd others;  ///< poses and points, in the order of the Jacobian's columns
};

std::optional<ByCamera> derivative_by_camera(const ceres::CRSMatrix& crs) {
  const Eigen::SparseMatrix<double> jacobian = Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
      crs.num_rows, crs.num_cols, static_cast<int>(crs.values.size()), crs.rows.data(), crs.cols.data(),
      crs.values.data());
  constexpr int kCamera = kCameraUnknowns;
  const Eigen::SparseMatrix<double> by_others = jacobian.rightCols(crs.num_cols - kCamera);
  const Eigen::MatrixXd by_camera = jacobian.leftCols(kCamera);

  // Normal equations of poses and points
  Eigen::SparseMatrix<double> normal = by_others.transpose() * by_others;
  normal.diagonal() *= 1.0 + 1e-9;  // a point may be seen along one ray only
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(normal);
  if (factor.info() != Eigen::Success) return std::nullopt;

  ByCamera result;
  result.others = -factor.solve(Eigen::MatrixXd(by_others.transpose() * by_camera));
  result.rows = by_camera + by_others * result.others;
  if (!result.rows.allFinite()) return std::nullopt;
  return result;
}

/// Gradient and information of each block of time, and of all.
void add_blocks(const CalibrationProblem& problem, const Eigen::MatrixXd& derivatives,
                const std::vector<double>& residuals, CameraEvidence& evidence) {
  std::map<int, EvidenceBlock> blocks;
  Eigen::Index row = 0;
  for (const CalibrationObservation& o : problem.observations) {
    const Eigen::Index rows = o.depth > 0.0 ? 3 : 2;
    const auto derivative = derivatives.middleRows(row, rows);
    const Eigen::Map<const Eigen::VectorXd> residual(residuals.data() + row, rows);
    EvidenceBlock& block = blocks[problem.poses[static_cast<std::size_t>(o.pose)].block];

    block.gradient += derivative.transpose() * residual;
    block.information += derivative.transpose() * derivative;
    row += rows;
  }

  for (const auto& [number, block] : blocks) {
    evidence.all.gradient += block.gradient;
    evidence.all.information += block.information;
    evidence.blocks.push_back(block);
  }
}

/// The problem keeps for its next camera how poses and points follow.
void keep_following(const ceres::Problem::EvaluateOptions& columns, const Eigen::MatrixXd& others,
                    ceres::Problem& ceres_problem, CameraUnknowns& unknowns, CalibrationProblem& problem) {
  problem.optimum = Eigen::Map<const CameraChange>(unknowns.change());
  problem.following.setZero(unknowns.others().size(), kCameraUnknowns);
  Eigen::Index row = 0;
  for (double* block : columns.parameter_blocks) {
    if (block == unknowns.change()) continue;
    const Eigen::Index size = ceres_problem.ParameterBlockSize(block);
    problem.following.middleRows(block - unknowns.others().data(), size) = others.middleRows(row, size);
    row += size;
  }
}

/// The quadratic cost around the present unknowns, with poses and points eliminated.
std::optional<CameraEvidence> eliminated(CalibrationProblem& problem, CameraUnknowns& unknowns,
                                         ceres::Problem& ceres_problem) {
  CameraEvidence evidence;
  evidence.at = Eigen::Map<const CameraChange>(unknowns.change());
  const ceres::Problem::EvaluateOptions columns = columns_of(problem, unknowns, ceres_problem);
  std::vector<double> residuals;
  ceres::CRSMatrix crs;
  if (!ceres_problem.Evaluate(columns, &evidence.cost, &residuals, nullptr, &crs)) return std::nullopt;

  const auto derivative = derivative_by_camera(crs);
  if (!derivative) return std::nullopt;
  add_blocks(problem, derivative->rows, residuals, evidence);
  keep_following(columns, derivative->others, ceres_problem, unknowns, problem);
  return evidence;
}

}  // namespace

sensor::Camera changed_camera(const sensor::Camera& given, const CameraChange& change) {
  sensor::Camera camera = given;
  camera.color.fx *= 1.0 + change[kFocal];
  camera.color.fy *= 1.0 + change[kFocal];
  camera.color.cx += change[kCentreX];
  camera.color.cy += change[kCentreY];
  camera.distortion[0] += change[kK1];
  camera.distortion[1] += change[kK2];
  camera.depth_slope[0] += change[kSlopeX];
  camera.depth_slope[1] += change[kSlopeY];
  camera.depth_delay_s += change[kDelay];

  // A readout time only if given or estimated
  if (given.readout_s || change[kReadout] != 0.0) camera.readout_s = change[kReadout];
  return camera;
}

CameraChange change_between(const sensor::Camera& given, const sensor::Camera& camera) {
  CameraChange change;
  change[kFocal] = camera.color.fx / given.color.fx - 1.0;
  change[kReadout] = camera.readout_s.value_or(0.0);
  change[kSlopeX] = camera.depth_slope[0] - given.depth_slope[0];
  change[kSlopeY] = camera.depth_slope[1] - given.depth_slope[1];
  change[kCentreX] = camera.color.cx - given.color.cx;
  change[kCentreY] = camera.color.cy - given.color.cy;
  change[kK1] = camera.distortion[0] - given.distortion[0];
  change[kK2] = camera.distortion[1] - given.distortion[1];
  change[kDelay] = camera.depth_delay_s - given.depth_delay_s;
  return change;
}

double CameraEvidence::cost_of(const CameraChange& change) const {
  const CameraChange d = change - at;
  return cost + all.gradient.dot(d) + 0.5 * d.dot(all.information * d);
}

std::optional<CameraEvidence> camera_evidence(CalibrationProblem& problem, const CameraChange& change) {
  if (problem.observations.empty()) return std::nullopt;
  CameraUnknowns unknowns(problem, change);
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;

  // Robust losses, since matches may be wrong
  ceres::HuberLoss pixel_loss(1.0);
  ceres::CauchyLoss depth_loss(1.5);  // corners at the rim of things have the depth of the background
  ceres::Problem ceres_problem(options);
  add_observations(problem, unknowns, &pixel_loss, &depth_loss, ceres_problem);
  follow_camera(problem, unknowns, ceres_problem);
  if (!adjust(problem, unknowns, ceres_problem)) return std::nullopt;

  // Poses and points are eliminated
  auto evidence = eliminated(problem, unknowns, ceres_problem);

  // The problem takes the adjusted poses and points
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    const Eigen::Map<const Eigen::Matrix<double, kStep, 1>> step(unknowns.step(static_cast<int>(i)));
    geometry::Rigid3& pose = problem.poses[i].camera_from_world;
    pose = {geometry::exp_so3(step.head<3>()) * pose.rotation, pose.translation + step.tail<3>()};
  }
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    problem.points[i] = Eigen::Map<const Eigen::Vector3d>(unknowns.point(static_cast<int>(i)));
  return evidence;
}

}  // namespace plumbline::optimize
