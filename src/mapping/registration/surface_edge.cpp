// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/registration/surface_edge.hpp"

#include <Eigen/Eigenvalues>
#include <vector>

#include "plumbline/optimize/pose_solver.hpp"
#include "plumbline/tracking/association.hpp"
#include "plumbline/tracking/photometric_alignment.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

/// Weight of all grey values together: small, so that one pair of images decides in the bundle only if others
/// agree.
constexpr double kPhotometricWeight = 0.02;
// Information of a standard deviation of 2 cm; with less, a direction is free.
constexpr double kHeld = 2500.0;

std::vector<tracking::WorldSurface> surface_of(const maps::Keyframe& keyframe) {
  std::vector<tracking::WorldSurface> surface;  // "world" is the keyframe's camera
  surface.reserve(keyframe.surface.size());
  for (const maps::SurfaceSample& s : keyframe.surface) {
    surface.push_back({s.point.cast<double>(), s.normal.cast<double>(), static_cast<double>(s.sigma)});
  }
  return surface;
}

/// Middle of the samples that b's camera sees, in its frame.
Eigen::Vector3d middle_in_view(const std::vector<tracking::WorldSurface>& surface, const Rigid3& b_from_a,
                               const sensor::Pinhole& camera) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const tracking::WorldSurface& s : surface) {
    const Eigen::Vector3d p = b_from_a * s.point;
    if (p.z() < 0.2 || !camera.contains(camera.project(p))) continue;
    sum += p;
    ++count;
  }
  return count > 0 ? Eigen::Vector3d(sum / count) : sum;
}

/// Prior at the start, with a standard deviation of hold_m at `middle` and at a metre from it: xi = (rho,
/// phi) moves the middle by rho + phi x middle.
optimize::PosePrior weak_prior(const Rigid3& start, const Eigen::Vector3d& middle, double hold_m) {
  Matrix6d at_middle = Matrix6d::Identity();
  at_middle.topRightCorner<3, 3>() = -geometry::skew(middle);
  return {start, at_middle.transpose() * at_middle / (hold_m * hold_m)};
}

/// Removes the prior: at the solution both gradients are equal, so one more step in the directions that the
/// surfaces hold leads to the solution without it.
Rigid3 without_prior(const Rigid3& held, const optimize::PosePrior& prior, const Matrix6d& information) {
  // Gradient of the prior.
  const Vector6d pull = prior.information * geometry::log_se3(held * prior.camera_from_world.inverse());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information);
  Vector6d step = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    if (eigen.eigenvalues()(i) < kHeld) continue;
    step += eigen.eigenvectors().col(i) * (eigen.eigenvectors().col(i).dot(pull) / eigen.eigenvalues()(i));
  }
  return geometry::exp_se3(step) * held;
}

}  // namespace

std::optional<maps::SurfaceEdge> align_surface_edge(const maps::Keyframe& a, core::KeyframeId b,
                                                    const cv::Mat& depth_of_b, const Rigid3& b_from_a,
                                                    const Rigid3& depth_from_camera,
                                                    const sensor::Pinhole& camera,
                                                    const SurfaceEdgeOptions& options,
                                                    const EdgeImages& images) {
  if (a.surface.empty()) return std::nullopt;
  const std::vector<tracking::WorldSurface> surface = surface_of(a);

  // The weak prior keeps the alignment from sliding on noise along directions that the surfaces leave free.
  optimize::PoseProblem problem;
  problem.camera = camera;
  problem.prior = weak_prior(b_from_a, middle_in_view(surface, b_from_a, camera), options.hold_m);

  optimize::PoseSolverOptions solver;
  solver.max_iterations = 3;
  solver.photometric_weight = kPhotometricWeight;

  optimize::PoseSummary summary;
  Rigid3 pose = b_from_a;
  const tracking::PhotometricView view{images.of_b, &depth_of_b, depth_from_camera, camera};

  // The radius of association, in metres, is wide at first, because the start is uncertain, and then shrinks
  // to exclude wrong associations.
  for (const double distance : {0.08, 0.05, 0.03, 0.03, 0.03}) {
    tracking::SurfaceAssociationOptions association;
    association.max_distance_m = distance;
    association.max_depth_m = options.max_depth_m;
    problem.photometric.reset();

    if (images.of_a != nullptr && images.of_b != nullptr) {
      const std::size_t level = distance > 0.06 ? 1 : 0;
      problem.photometric = tracking::associate_photometric(*images.of_a, level, view, {}, pose);
    }

    problem.planes =
        tracking::associate_surface(surface, {depth_of_b, camera, pose, depth_from_camera}, association);
    summary = optimize::solve_pose(problem, pose, solver);

    // Grey values may disagree, as after a change of light; the surfaces then decide alone.
    if (problem.photometric &&
        !tracking::photometric_agrees(*problem.photometric, summary.camera_from_world)) {
      problem.photometric.reset();
      summary = optimize::solve_pose(problem, pose, solver);
    }

    pose = summary.camera_from_world;
  }

  const double overlap = static_cast<double>(summary.planes.inliers) / static_cast<double>(surface.size());
  if (overlap < options.min_overlap) return std::nullopt;
  return maps::SurfaceEdge{a.id, b, without_prior(pose, *problem.prior, summary.information),
                           summary.information};
}

}  // namespace plumbline::mapping
