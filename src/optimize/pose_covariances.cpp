// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/optimize/pose_covariances.hpp"

#include <limits>

#include "bundle_round.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Matrix6d;

constexpr std::size_t kMostNumbers = 15'000'000;  // of the factor: 300 MB with the inverse
constexpr double kFree = 1e4;                     // variance of a pose that nothing holds: (100 m)^2

/// True if all poses are held. Rounding errors can make equations without a solution seem to have one.
bool are_held(const std::vector<Matrix6d>& blocks) {
  return !blocks.empty() && std::all_of(blocks.begin(), blocks.end(), [](const Matrix6d& block) {
    return block.allFinite() && block.trace() < kFree;
  });
}

/// Replaces positions and rotations by NaN that a prior holds: with twice its information they are more
/// accurate.
void remove_prior(const std::vector<Matrix6d>& with_twice, std::vector<Matrix6d>& blocks) {
  constexpr double kShare = 0.05;
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t slot = 0; slot < blocks.size(); ++slot) {
    Matrix6d& block = blocks[slot];
    const Matrix6d gained = block - with_twice[slot];
    const double position = gained.topLeftCorner<3, 3>().trace() / block.topLeftCorner<3, 3>().trace();
    const double rotation =
        gained.bottomRightCorner<3, 3>().trace() / block.bottomRightCorner<3, 3>().trace();
    for (const auto& [share, first] : {std::pair{position, 0}, std::pair{rotation, 3}}) {
      if (share < kShare) continue;
      block.middleRows<3>(first).setConstant(kUnknown);
      block.middleCols<3>(first).setConstant(kUnknown);
    }
  }
}

}  // namespace

/// Covariances of the free poses with a prior of this information, 1/m^2 and 1/rad^2, on each of them.
std::vector<Matrix6d> BundleRound::held_by_prior(double information) {
  constexpr double kLeastShare = 1e-9;
  for (Damping<6>& damping : equations_.damping) damping.diagonal.setConstant(information);
  return reduced_.inverse_blocks(equations_, kLeastShare);
}

/// Directions of landmarks that hardly anything constrains, such as the distance of a point that is seen from
/// one place, make the elimination inexact: they are left out of it. If that is not enough, a pose is free:
/// the weakest prior that makes the equations solvable is put on all.
std::vector<Matrix6d> BundleRound::repaired() {
  std::vector<Matrix6d> blocks = held_by_prior(0.0);
  if (are_held(blocks)) return blocks;

  for (const double information : {1e-2, 1.0, 1e2}) {
    blocks = held_by_prior(information);
    const std::vector<Matrix6d> with_twice = held_by_prior(2.0 * information);
    if (!are_held(blocks) || !are_held(with_twice)) continue;
    remove_prior(with_twice, blocks);
    return blocks;
  }
  return {};
}

PoseCovariances BundleRound::covariances(const BundleState& state) {
  linearise(state);
  if (!reduced_.fits(equations_, kMostNumbers)) {
    return {{},
            "the keyframes share so many landmarks that more than " +
                std::to_string(kMostNumbers / 1'000'000) + " million numbers would be needed"};
  }

  // Poses that are not constrained need a repair
  constexpr double kLeastShare = 1e-13;  // below, rounding errors are as large as what is taken out
  std::vector<Matrix6d> blocks = reduced_.inverse_blocks(equations_, kLeastShare);
  if (!are_held(blocks)) blocks = repaired();
  if (blocks.empty() && slots_.free > 0) return {{}, "the equations of the adjustment cannot be solved"};

  PoseCovariances result;
  result.of_pose.resize(state.poses.size(), Matrix6d::Zero());
  for (std::size_t slot = 0; slot < blocks.size(); ++slot)
    result.of_pose[at(slots_.pose[slot])] = blocks[slot];
  return result;
}

PoseCovariances pose_covariances(const BundleProblem& problem, const BundleOptions& options) {
  return BundleRound(problem, options).covariances(state_of(problem));
}

}  // namespace plumbline::optimize
