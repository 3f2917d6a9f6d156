// SPDX-License-Identifier: BSD-3-Clause
// What the motion model holds of a pose, and how much it believes of a step.
#include <gtest/gtest.h>

#include "../../../src/tracking/observability.hpp"

namespace plumbline::tracking {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;

/// Standard deviations in m; those of rotations as at 2 m.
Matrix6d information_of(const Vector6d& sigma) {
  const Vector6d scale = (Vector6d() << 1.0, 1.0, 1.0, 2.0, 2.0, 2.0).finished();
  return Vector6d(scale.cwiseQuotient(sigma).cwiseAbs2()).asDiagonal();
}

/// Sideways held to `sideways` m, all else to a millimetre.
Matrix6d sideways_to(double sideways) {
  return information_of((Vector6d() << sideways, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3).finished());
}

TEST(MotionPrior, HoldsWhatIsHeldNoBetterThanItIsWorth) {
  const geometry::Rigid3 predicted(Eigen::Matrix3d::Identity(), {0.1, 0.0, 0.0});
  EXPECT_FALSE(motion_prior(sideways_to(0.004), predicted, MotionTrust::kLikely));
  EXPECT_TRUE(motion_prior(sideways_to(0.006), predicted, MotionTrust::kLikely));
  // One that was refuted, or of which nothing is known, only where there is nothing better.
  EXPECT_FALSE(motion_prior(sideways_to(0.019), predicted, MotionTrust::kUnknown));
  EXPECT_TRUE(motion_prior(sideways_to(0.021), predicted, MotionTrust::kUnknown));
}

TEST(MotionPrior, LeavesAloneWhatIsMeasured) {
  const geometry::Rigid3 predicted(Eigen::Matrix3d::Identity(), {0.1, 0.0, 0.0});
  for (const MotionTrust motion : {MotionTrust::kUnknown, MotionTrust::kLikely, MotionTrust::kSurfaceOnly}) {
    const auto prior = motion_prior(sideways_to(0.1), predicted, motion);
    ASSERT_TRUE(prior);
    EXPECT_EQ(prior->camera_from_world.translation, predicted.translation);
    EXPECT_GT(prior->information(0, 0), 2000.0);
    EXPECT_NEAR(prior->information.bottomRightCorner(5, 5).norm(), 0.0, 1e-6);
  }
}

TEST(MotionPrior, BesideSurfacesAloneItIsStiff) {
  const geometry::Rigid3 predicted;
  const auto likely = motion_prior(sideways_to(0.1), predicted, MotionTrust::kLikely);
  const auto alone = motion_prior(sideways_to(0.1), predicted, MotionTrust::kSurfaceOnly);
  const auto unknown = motion_prior(sideways_to(0.1), predicted, MotionTrust::kUnknown);
  ASSERT_TRUE(likely && alone && unknown);
  EXPECT_NEAR(1.0 / std::sqrt(alone->information(0, 0)), 0.0003, 0.00005);
  EXPECT_NEAR(1.0 / std::sqrt(likely->information(0, 0)), 0.005, 0.0005);
  EXPECT_NEAR(1.0 / std::sqrt(unknown->information(0, 0)), 0.02, 0.001);
}

TEST(WeakPart, IsThePartOfAStepThatLiesInWeakDirections) {
  const Matrix6d held_in_five = sideways_to(0.1);
  const Matrix6d part =
      projector_onto_degenerate(principal_directions(held_in_five), degenerate_below(held_in_five, false));
  const Vector6d step = (Vector6d() << 0.02, 0.03, -0.01, 0.004, -0.002, 0.001).finished();
  const Vector6d weak = part * step;
  EXPECT_NEAR(weak(0), 0.02, 1e-9);
  EXPECT_NEAR(weak.tail<5>().norm(), 0.0, 1e-9);
  EXPECT_NEAR((part * part - part).norm(), 0.0, 1e-9);  // what is left of a part is the part
  EXPECT_EQ(projector_onto_degenerate(principal_directions(sideways_to(0.001)), 2500.0), Matrix6d::Zero());
}

TEST(WeakPart, KnowsMixedDirections) {
  // Far points: moving sideways and turning the other way look the same at 4 m.
  Vector6d confused = Vector6d::Zero();
  confused(0) = 1.0;
  confused(4) = -0.25;
  Matrix6d information = information_of(Vector6d::Constant(1e-3));
  const Vector6d scale = (Vector6d() << 1.0, 1.0, 1.0, 0.5, 0.5, 0.5).finished();
  const Vector6d direction = confused.cwiseQuotient(scale).normalized();  // in the scaled space
  const Matrix6d scaled = 1e6 * (Matrix6d::Identity() - 0.9999 * direction * direction.transpose());
  information = scale.cwiseInverse().asDiagonal() * scaled * scale.cwiseInverse().asDiagonal();
  const Matrix6d part = projector_onto_degenerate(principal_directions(information), 2500.0);
  EXPECT_NEAR((part * confused - confused).norm(), 0.0, 1e-6);
  EXPECT_EQ(part.fullPivLu().rank(), 1);
}

}  // namespace
}  // namespace plumbline::tracking
