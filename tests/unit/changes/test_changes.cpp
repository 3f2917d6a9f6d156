// SPDX-License-Identifier: BSD-3-Clause
// Walls and boxes with known changes: distances, limits, what is seen, what moved.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "plumbline/changes/changes.hpp"

namespace plumbline::changes {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kNoise_m = 0.001;

/// A rectangle of points each centimetre, with noise along its normal.
void add_face(Surface& surface, const Vector3d& corner, const Vector3d& u, const Vector3d& v,
              std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, kNoise_m);
  const Vector3d normal = u.cross(v).normalized();
  const int columns = static_cast<int>(u.norm() / 0.01), rows = static_cast<int>(v.norm() / 0.01);
  for (int i = 0; i < columns; ++i) {
    for (int k = 0; k < rows; ++k) {
      const Vector3d at =
          corner + u * ((i + 0.5) / columns) + v * ((k + 0.5) / rows) + noise(random) * normal;
      surface.points.push_back(at.cast<float>());
      surface.normals.push_back(normal.cast<float>());
    }
  }
}

/// Front, sides and top of a box that stands at `at`, turned about the vertical.
void add_box(Surface& surface, const Vector3d& at, const Vector3d& size, double turn, std::mt19937& random) {
  const Eigen::Matrix3d r = Eigen::AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix();
  const Vector3d x = r.col(0) * size.x(), y = r.col(1) * size.y(), z = r.col(2) * size.z();
  const Vector3d corner = at - 0.5 * x - 0.5 * y;
  add_face(surface, corner, x, z, random);
  add_face(surface, corner + x, y, z, random);
  add_face(surface, corner + y + x, -x, z, random);
  add_face(surface, corner + y, -y, z, random);
  add_face(surface, corner + z, x, y, random);
}

/// A room of 4 x 3 m, its wall at y = 3 shifted.
Surface room(unsigned seed, double shift = 0.0) {
  std::mt19937 random(seed);
  Surface surface;
  add_face(surface, {0, 0, 0}, {4, 0, 0}, {0, 3, 0}, random);
  add_face(surface, {4, 3 + shift, 0}, {-4, 0, 0}, {0, 0, 2}, random);
  add_face(surface, {0, 3, 0}, {0, -3, 0}, {0, 0, 2}, random);
  add_face(surface, {4, 0, 0}, {0, 3, 0}, {0, 0, 2}, random);
  return surface;
}

std::vector<std::uint8_t> everywhere(const std::vector<Vector3f>& points) {
  return std::vector<std::uint8_t>(points.size(), 1);
}

Comparison compared(const Surface& before, const Surface& after, const LookedThrough& through = everywhere,
                    int threads = 1) {
  const core::Executor executor(threads);
  return find_changes({before, after}, through, through, Vector3d::UnitZ(), {}, executor);
}

TEST(Changes, UnchangedRoomHasNoneAndItsLimitsHold) {
  const Comparison result = compared(room(1), room(2));
  EXPECT_TRUE(result.changes.empty());
  EXPECT_GT(result.agreement, 0.99);
  EXPECT_LT(result.median_limit_m, 0.001);
  const double same = static_cast<double>(result.counts[0]), shifted = static_cast<double>(result.counts[1]);
  EXPECT_GT(same / (same + shifted), 0.93);
}

TEST(Changes, WallThatShiftedIsOneChangeWithItsWay) {
  const Comparison result = compared(room(1), room(2, -0.02));
  ASSERT_EQ(result.changes.size(), 1U);
  const Change& wall = result.changes[0];
  EXPECT_EQ(wall.kind, ChangeKind::kShifted);
  EXPECT_NEAR(wall.shift_m, -0.02, 0.0005);  // against the normal, which points out of the room here
  EXPECT_NEAR(wall.normal.y(), 1.0, 0.01);
  EXPECT_NEAR(wall.area_m2, 8.0, 1.0);
  EXPECT_LT(wall.limit_m, 0.002);
}

TEST(Changes, ThingsAppearAndVanishOnlyWhereSpaceWasSeen) {
  std::mt19937 random(3);
  Surface with_box = room(1);
  add_box(with_box, {2, 1.5, 0}, {0.4, 0.3, 0.5}, 0.0, random);
  const Comparison gone = compared(with_box, room(2));
  ASSERT_EQ(gone.changes.size(), 1U);
  EXPECT_EQ(gone.changes[0].kind, ChangeKind::kVanished);
  EXPECT_TRUE(gone.changes[0].after.isEmpty());
  EXPECT_LT((gone.changes[0].before.center() - Vector3d(2, 1.5, 0.27)).norm(), 0.05);
  EXPECT_NEAR(gone.changes[0].before.sizes().x(), 0.4, 0.03);

  const Comparison come = compared(room(2), with_box);
  ASSERT_EQ(come.changes.size(), 1U);
  EXPECT_EQ(come.changes[0].kind, ChangeKind::kAppeared);

  const Comparison unseen = compared(with_box, room(2), nullptr);
  EXPECT_TRUE(unseen.changes.empty());
  EXPECT_GT(unseen.counts[static_cast<std::size_t>(PlaceKind::kNotSeenAfter)], 500U);
  EXPECT_EQ(unseen.counts[static_cast<std::size_t>(PlaceKind::kVanished)], 0U);
}

TEST(Changes, WhatWentAndCameIsMovedWithWayAndTurn) {
  const Vector3d size(0.5, 0.3, 0.4);
  for (const double way : {0.12, 1.1}) {
    std::mt19937 random(3);
    const double turn = way > 1.0 ? 0.5 : 0.0;
    Surface before = room(1), after = room(2);
    add_box(before, {1.2, 1.2, 0}, size, 0.0, random);
    add_box(after, {1.2 + way, 1.2, 0}, size, turn, random);
    const Comparison result = compared(before, after);
    ASSERT_EQ(result.changes.size(), 1U) << way;
    const Change& change = result.changes[0];
    EXPECT_EQ(change.kind, ChangeKind::kMoved);
    const Vector3d moved = change.after_from_before * Vector3d(1.2, 1.2, 0.0);
    EXPECT_LT((moved - Vector3d(1.2 + way, 1.2, 0.0)).norm(), 0.02);
    EXPECT_NEAR(change.turn_rad, turn, 0.05);
  }
}

TEST(Changes, OneThingGoneAndAnotherComeAreNotMoved) {
  std::mt19937 random(3);
  Surface before = room(1), after = room(2);
  add_box(before, {1, 1, 0}, {0.5, 0.3, 0.4}, 0.0, random);
  add_box(after, {3, 2, 0}, {0.25, 0.25, 1.1}, 0.0, random);
  const Comparison result = compared(before, after);
  ASSERT_EQ(result.changes.size(), 2U);
  EXPECT_NE(result.changes[0].kind, ChangeKind::kMoved);
  EXPECT_NE(result.changes[1].kind, ChangeKind::kMoved);
}

TEST(Changes, LimitIsThatOfLague) {
  const CylinderPoints before{25, 0.0, 0.005}, after{100, 0.0, 0.010};
  EXPECT_NEAR(detection_limit(before, after, 0.002), 1.96 * (std::sqrt(1e-6 + 1e-6) + 0.002), 1e-12);
}

TEST(Changes, SameForAnyNumberOfThreads) {
  std::mt19937 random(3);
  Surface after = room(2, 0.01);
  add_box(after, {2, 1.5, 0}, {0.4, 0.3, 0.5}, 0.3, random);
  const Comparison one = compared(room(1), after), four = compared(room(1), after, everywhere, 4);
  ASSERT_EQ(one.places.size(), four.places.size());
  for (std::size_t i = 0; i < one.places.size(); ++i) {
    ASSERT_EQ(one.places[i].kind, four.places[i].kind);
    ASSERT_TRUE(one.places[i].distance.shift_m == four.places[i].distance.shift_m ||
                !one.places[i].distance.known());
  }
  ASSERT_EQ(one.changes.size(), four.changes.size());
}

TEST(Changes, NothingIsFoundInNothing) {
  EXPECT_TRUE(compared(Surface(), Surface()).places.empty());
  EXPECT_TRUE(compared(room(1), Surface(), nullptr).changes.empty());
}

}  // namespace
}  // namespace plumbline::changes
