// SPDX-License-Identifier: BSD-3-Clause
// The frame of the results is upright, stands on the floor, is square to the walls, and falls back to what is
// known.
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <memory>
#include <random>

#include "../../../src/pipeline/results/up_frame.hpp"

namespace plumbline::pipeline {
namespace {

using Eigen::Vector3d;

/// The world of the test: z up, floor at 0, a table at 0.8 m, a wall at x = 3; seen in a map frame that is
/// turned.
class UpFrameTest : public testing::Test {
 protected:
  UpFrameTest() {
    map_from_world_.rotation =
        (Eigen::AngleAxisd(0.7, Vector3d::UnitX()) * Eigen::AngleAxisd(-0.4, Vector3d::UnitZ()))
            .toRotationMatrix();
    map_from_world_.translation = {1.0, -2.0, 0.5};
  }
  void add(const Vector3d& world, const Vector3d& normal) {
    cloud::Point p;
    p.getVector3fMap() = (map_from_world_ * world).cast<float>();
    p.getNormalVector3fMap() = (map_from_world_.rotation * normal).cast<float>();
    cloud_->push_back(p);
  }
  void add_square(const Vector3d& middle, double half, const Vector3d& normal, int count) {
    std::uniform_real_distribution<double> place(-half, half);
    const Vector3d u = normal.unitOrthogonal();
    const Vector3d v = normal.cross(u);
    for (int i = 0; i < count; ++i) add(middle + place(random_) * u + place(random_) * v, normal);
  }
  void add_room() {
    add_square({1, 0, 0}, 1.5, Vector3d::UnitZ(), 4000);
    add_square({1, 0, 0.8}, 0.4, Vector3d::UnitZ(), 1500);
    add_square({1, 0, 2.5}, 1.5, -Vector3d::UnitZ(), 4000);
    add_square({3, 0, 1.2}, 1.2, -Vector3d::UnitX(), 4000);
  }
  /// At (0, 0, 1.5), looks along x and `down_rad` down, held with a roll.
  [[nodiscard]] geometry::Trajectory path(double down_rad = 0.2, double roll_rad = 0.1) const {
    Eigen::Matrix3d camera;  // columns: right, down, ahead
    camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    geometry::Rigid3 world_from_camera;
    world_from_camera.rotation = camera * Eigen::AngleAxisd(-down_rad, Vector3d::UnitX()).toRotationMatrix() *
                                 Eigen::AngleAxisd(roll_rad, Vector3d::UnitZ()).toRotationMatrix();
    world_from_camera.translation = {0, 0, 1.5};
    return {{1.0, map_from_world_ * world_from_camera}};
  }
  [[nodiscard]] UpFrame find(Up wanted, const geometry::Trajectory& trajectory,
                             Yaw yaw = Yaw::kCamera) const {
    return find_up(wanted, yaw, cloud_, trajectory);
  }
  [[nodiscard]] Vector3d placed(const UpFrame& frame, const Vector3d& world) const {
    return frame.output_from_map * (map_from_world_ * world);
  }

  geometry::Rigid3 map_from_world_;
  cloud::CloudPtr cloud_ = std::make_shared<cloud::Cloud>();
  std::mt19937 random_{4};
};

TEST_F(UpFrameTest, TheFloorIsAtZeroAndUpIsUp) {
  add_room();
  const UpFrame frame = find(Up::kFloor, path());
  EXPECT_EQ(frame.up, "floor");
  for (const Vector3d& p : {Vector3d(0, 0, 0), Vector3d(2, 1, 0.8), Vector3d(3, -1, 2.5)}) {
    EXPECT_NEAR(placed(frame, p).z(), p.z(), 0.02);  // the height's bins
  }
  // The origin is below the first camera, x is where it looks.
  EXPECT_NEAR(placed(frame, {0, 0, 0}).head<2>().norm(), 0.0, 1e-3);
  const Vector3d ahead = placed(frame, {1, 0, 0});
  EXPECT_GT(ahead.x(), 0.97);
}

TEST_F(UpFrameTest, TheFloorIsNotTheTable) {
  add_square({1, 0, 0}, 0.8, Vector3d::UnitZ(), 1200);
  add_square({1, 0, 0.8}, 1.2, Vector3d::UnitZ(), 4000);  // more of it is seen
  add_square({3, 0, 1.2}, 1.2, -Vector3d::UnitX(), 4000);
  const UpFrame frame = find(Up::kFloor, path());
  EXPECT_EQ(frame.up, "floor");
  EXPECT_NEAR(placed(frame, {1, 0, 0}).z(), 0.0, 0.02);
}

TEST_F(UpFrameTest, CameraAndNoneAreWhatTheyAreCalled) {
  add_room();
  const geometry::Trajectory level = path(0.0, 0.0);
  const UpFrame camera = find(Up::kCamera, level);
  EXPECT_EQ(camera.up, "camera");
  EXPECT_NEAR(placed(camera, {0, 0, 1.5}).norm(), 0.0, 1e-9);
  EXPECT_NEAR(placed(camera, {2, 0, 2.5}).z(), 1.0, 1e-9);
  EXPECT_NEAR(placed(camera, {2, 0, 1.5}).x(), 2.0, 1e-9);
  const UpFrame none = find(Up::kNone, level);
  EXPECT_EQ(none.up, "none");
  EXPECT_TRUE(none.output_from_map.rotation.isIdentity(0.0));
}

TEST_F(UpFrameTest, WithoutAFloorTheCameraTells) {
  add_square({3, 0, 1.2}, 1.2, -Vector3d::UnitX(), 4000);  // a wall alone
  EXPECT_EQ(find(Up::kFloor, path()).up, "camera");
  cloud_ = std::make_shared<cloud::Cloud>();
  EXPECT_EQ(find(Up::kFloor, path()).up, "camera");
  cloud_ = nullptr;
  EXPECT_EQ(find(Up::kFloor, path()).up, "camera");
  EXPECT_EQ(find(Up::kFloor, {}).up, "none");
}

// Walls turned by 25 degrees against where the camera looks, and a cupboard that stands askew.
TEST_F(UpFrameTest, SquareToTheWalls) {
  add_square({1, 0, 0}, 1.5, Vector3d::UnitZ(), 4000);
  const auto facing = [](double degrees) {
    const double angle = degrees * M_PI / 180.0;
    return Vector3d(-std::cos(angle), -std::sin(angle), 0.0);
  };
  add_square({3, 0, 1.2}, 1.2, facing(25.0), 4000);
  add_square({1, 3, 1.2}, 1.2, facing(115.0), 3000);
  add_square({2, 1, 0.5}, 0.5, facing(60.0), 3000);
  const UpFrame walls = find(Up::kFloor, path(), Yaw::kWalls);
  EXPECT_EQ(walls.yaw, "walls");
  const Vector3d ahead = walls.output_from_map.rotation * map_from_world_.rotation * -facing(25.0);
  EXPECT_NEAR(ahead.x(), 1.0, 1e-4);
  EXPECT_EQ(find(Up::kFloor, path()).yaw, "camera");
  EXPECT_EQ(find(Up::kNone, path(), Yaw::kWalls).yaw, "none");
}

TEST_F(UpFrameTest, WithoutWallsXIsWhereTheCameraLooks) {
  add_square({1, 0, 0}, 1.5, Vector3d::UnitZ(), 4000);
  for (int i = 0; i < 180; ++i) {
    const double angle = 2.0 * M_PI * i / 180.0;  // a column
    const Vector3d normal(std::cos(angle), std::sin(angle), 0.0);
    add_square(Vector3d(2, 0, 1) + 0.3 * normal, 0.01, normal, 20);
  }
  const UpFrame frame = find(Up::kFloor, path(), Yaw::kWalls);
  EXPECT_EQ(frame.yaw, "camera");
  EXPECT_GT(placed(frame, {1, 0, 0}).x(), 0.97);
}

TEST_F(UpFrameTest, LooksDown) {
  add_room();
  const UpFrame frame = find(Up::kFloor, path(0.7, 0.0));
  EXPECT_EQ(frame.up, "floor");
  EXPECT_NEAR(std::abs(frame.output_from_map.rotation.determinant() - 1.0), 0.0, 1e-9);
  EXPECT_NEAR(placed(frame, {1, 0, 0}).z(), 0.0, 0.02);
}

TEST_F(UpFrameTest, PointsThatAreNoneDoNoHarm) {
  add_room();
  cloud::Point nan;
  nan.x = nan.y = nan.z = nan.normal_x = std::numeric_limits<float>::quiet_NaN();
  for (int i = 0; i < 100; ++i) cloud_->push_back(nan);
  const UpFrame frame = find(Up::kFloor, path());
  EXPECT_EQ(frame.up, "floor");
  EXPECT_NEAR(placed(frame, {1, 0, 0}).z(), 0.0, 0.02);
}

}  // namespace
}  // namespace plumbline::pipeline
