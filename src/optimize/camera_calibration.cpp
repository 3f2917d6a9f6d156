// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/optimize/camera_calibration.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <utility>

#include "ceres_solve.hpp"

namespace plumbline::optimize {
namespace {

/// Radial-tangential distortion of (x, y), OpenCV's.
template <typename T>
void distort(const T& x, const T& y, const T& k1, const T& k2, const sensor::Distortion& k, T& xd, T& yd) {
  const T r2 = x * x + y * y;
  const T radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k[4]));
  xd = x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x);
  yd = y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y;
}

/// A point in the camera when a row was read; the pose is that of the problem, turned and moved by `step`.
class RowPoint {
 public:
  RowPoint(const CalibrationPose& pose, double share) : pose_(pose), share_(share) {}

  template <typename T>
  void operator()(const T* change, const T* step, const T* point, T* p) const {
    const Eigen::Matrix3d& r = pose_.camera_from_world.rotation;
    T turned[3];
    for (int i = 0; i < 3; ++i) turned[i] = r(i, 0) * point[0] + r(i, 1) * point[1] + r(i, 2) * point[2];
    T still[3];
    ceres::AngleAxisRotatePoint(step, turned, still);
    for (int i = 0; i < 3; ++i) still[i] += pose_.camera_from_world.translation(i) + step[3 + i];
    const T s = (change[kReadout] - pose_.undone_s) * share_;
    const geometry::Vector6d& v = pose_.velocity;
    p[0] = still[0] + s * (v(0) + v(4) * still[2] - v(5) * still[1]);
    p[1] = still[1] + s * (v(1) + v(5) * still[0] - v(3) * still[2]);
    p[2] = still[2] + s * (v(2) + v(3) * still[1] - v(4) * still[0]);
  }

 private:
  CalibrationPose pose_;
  double share_;  ///< of the readout, from the middle row to this one
};

/// e = (u - K distort(pi(p))) / sigma.
class PixelCost {
 public:
  PixelCost(const CalibrationObservation& seen, const RowPoint& in_camera, const sensor::Camera& camera)
      : seen_(seen), in_camera_(in_camera), camera_(&camera) {}

  template <typename T>
  bool operator()(const T* change, const T* step, const T* point, T* residual) const {
    T p[3];
    in_camera_(change, step, point, p);
    if (p[2] < 0.05) return false;
    T x;
    T y;
    const sensor::Distortion& k = camera_->distortion;
    distort<T>(p[0] / p[2], p[1] / p[2], k[0] + change[kK1], k[1] + change[kK2], k, x, y);
    const sensor::Pinhole& c = camera_->color;
    const T longer = 1.0 + change[kFocal];
    residual[0] = (seen_.pixel.x() - (c.fx * longer * x + c.cx + change[kCentreX])) / seen_.pixel_sigma;
    residual[1] = (seen_.pixel.y() - (c.fy * longer * y + c.cy + change[kCentreY])) / seen_.pixel_sigma;
    return true;
  }

 private:
  CalibrationObservation seen_;
  RowPoint in_camera_;
  const sensor::Camera* camera_;
};

/// e = (z - p_z / (1 - p_z slope.(x, y)) - delay rate) / sigma: what the depth camera says of a point that
/// lies at p.
class DepthCost {
 public:
  DepthCost(const CalibrationObservation& seen, const RowPoint& in_camera)
      : seen_(seen), in_camera_(in_camera) {}

  template <typename T>
  bool operator()(const T* change, const T* step, const T* point, T* residual) const {
    T p[3];
    in_camera_(change, step, point, p);
    const T grow = 1.0 - p[2] * (change[kSlopeX] * seen_.ray.x() + change[kSlopeY] * seen_.ray.y());
    if (grow < 0.1) return false;
    residual[0] = (seen_.depth - p[2] / grow - change[kDelay] * seen_.depth_rate) / seen_.depth_sigma;
    return true;
  }

 private:
  CalibrationObservation seen_;
  RowPoint in_camera_;
};

constexpr std::size_t kStep = 6;  // turn, then shift

/// All unknowns in one buffer, for the order of Ceres' sums hangs on addresses.
class CameraUnknowns {
 public:
  CameraUnknowns(const CalibrationProblem& problem, const CameraChange& change)
      : poses_(problem.poses.size()) {
    numbers_.assign(kCameraUnknowns + kStep * poses_ + 3 * problem.points.size(), 0.0);
    std::copy_n(change.data(), kCameraUnknowns, numbers_.data());
    for (std::size_t i = 0; i < problem.points.size(); ++i)
      std::copy_n(problem.points[i].data(), 3, point(static_cast<int>(i)));
  }
  double* change() { return numbers_.data(); }
  double* step(int i) { return numbers_.data() + kCameraUnknowns + kStep * static_cast<std::size_t>(i); }
  double* point(int i) {
    return numbers_.data() + kCameraUnknowns + kStep * poses_ + 3 * static_cast<std::size_t>(i);
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
    const RowPoint in_camera(pose, o.pixel.y() / height - 0.5);
    double* step = unknowns.step(o.pose);
    double* point = unknowns.point(o.point);
    auto* pixel = new ceres::AutoDiffCostFunction<PixelCost, 2, kCameraUnknowns, kStep, 3>(
        new PixelCost(o, in_camera, problem.camera));
    to.AddResidualBlock(pixel, pixel_loss, unknowns.change(), step, point);
    if (pose.fixed) to.SetParameterBlockConstant(step);
    if (!(o.depth > 0.0)) continue;
    auto* depth =
        new ceres::AutoDiffCostFunction<DepthCost, 1, kCameraUnknowns, kStep, 3>(new DepthCost(o, in_camera));
    to.AddResidualBlock(depth, depth_loss, unknowns.change(), step, point);
  }
}

/// Poses and points to the camera as it is.
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
  solver.max_num_iterations = 50;
  solver.function_tolerance = 1e-5;
  const ceres::Solver::Summary summary = solve(std::move(solver), ceres_problem);
  ceres_problem.SetParameterBlockVariable(unknowns.change());
  return summary.IsSolutionUsable();
}

/// The cost around where the unknowns are, poses and points eliminated.
std::optional<CameraEvidence> eliminated(const CalibrationProblem& problem, CameraUnknowns& unknowns,
                                         ceres::Problem& ceres_problem) {
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
  CameraEvidence evidence;
  evidence.at = Eigen::Map<const CameraChange>(unknowns.change());
  std::vector<double> gradient;
  ceres::CRSMatrix crs;
  if (!ceres_problem.Evaluate(order, &evidence.cost, nullptr, &gradient, &crs)) return std::nullopt;
  const Eigen::SparseMatrix<double> jacobian = Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
      crs.num_rows, crs.num_cols, static_cast<int>(crs.values.size()), crs.rows.data(), crs.cols.data(),
      crs.values.data());
  constexpr int kCamera = kCameraUnknowns;
  const int others = crs.num_cols - kCamera;
  const Eigen::SparseMatrix<double> by_others = jacobian.rightCols(others);
  const Eigen::MatrixXd by_camera = jacobian.leftCols(kCamera);
  Eigen::SparseMatrix<double> normal = by_others.transpose() * by_others;
  normal.diagonal() *= 1.0 + 1e-9;  // a point may be seen along one ray only
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(normal);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Eigen::MatrixXd coupling = by_others.transpose() * by_camera;
  const Eigen::MatrixXd answered = factor.solve(coupling);
  const Eigen::Map<const Eigen::VectorXd> all(gradient.data(), crs.num_cols);
  evidence.information = by_camera.transpose() * by_camera - coupling.transpose() * answered;
  evidence.gradient = all.head<kCamera>() - answered.transpose() * all.tail(others);
  if (!evidence.information.allFinite() || !evidence.gradient.allFinite()) return std::nullopt;
  return evidence;
}

}  // namespace

Eigen::Vector2d distorted_pixel(const sensor::Camera& camera, const Eigen::Vector2d& undistorted) {
  const sensor::Pinhole& c = camera.color;
  double x = 0.0;
  double y = 0.0;
  distort<double>((undistorted.x() - c.cx) / c.fx, (undistorted.y() - c.cy) / c.fy, camera.distortion[0],
                  camera.distortion[1], camera.distortion, x, y);
  return {c.fx * x + c.cx, c.fy * y + c.cy};
}

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
  if (given.readout_s || change[kReadout] != 0.0) camera.readout_s = change[kReadout];
  return camera;
}

double CameraEvidence::cost_of(const CameraChange& change) const {
  const CameraChange d = change - at;
  return cost + gradient.dot(d) + 0.5 * d.dot(information * d);
}

std::optional<CameraEvidence> camera_evidence(const CalibrationProblem& problem, const CameraChange& change) {
  if (problem.observations.empty()) return std::nullopt;
  CameraUnknowns unknowns(problem, change);
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::HuberLoss pixel_loss(1.0);
  ceres::CauchyLoss depth_loss(1.5);  // corners at the rim of things have the depth of what is behind
  ceres::Problem ceres_problem(options);
  add_observations(problem, unknowns, &pixel_loss, &depth_loss, ceres_problem);
  if (!adjust(problem, unknowns, ceres_problem)) return std::nullopt;
  return eliminated(problem, unknowns, ceres_problem);
}

CameraChange most_likely(const std::vector<CameraEvidence>& evidence, const FreeUnknowns& free,
                         const CameraPrior& prior) {
  Eigen::Matrix<double, kCameraUnknowns, kCameraUnknowns> information =
      prior.sigma.array().square().inverse().matrix().asDiagonal();
  CameraChange gradient = CameraChange::Zero();  // at the prior's mean
  for (const CameraEvidence& e : evidence) {
    information += e.information;
    gradient += e.gradient + e.information * (prior.mean - e.at);
  }
  for (int i = 0; i < static_cast<int>(kCameraUnknowns); ++i) {
    if (free[static_cast<std::size_t>(i)]) continue;
    information.row(i).setZero();
    information.col(i).setZero();
    information(i, i) = 1.0;
    gradient(i) = 0.0;
  }
  return prior.mean - information.ldlt().solve(gradient);
}

}  // namespace plumbline::optimize
