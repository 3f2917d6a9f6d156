// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "grids/grid.hpp"

namespace plumbline::exports {
namespace {

/// A room of 4 x 3 m whose floor was seen, but not under its furniture, and grid cells of 5 cm.
class OccupancyGrid : public testing::Test {
 protected:
  static constexpr float kStep_m = 0.02F;

  OccupancyGrid() {
    file_.cloud = pcl::make_shared<cloud::Cloud>();
    grid_.columns = 80;
    grid_.rows = 60;
    grid_.cells.assign(80 * 60, GridCell::kUnknown);
  }

  void add_plate(float x0, float y0, float x1, float y1, float z) {
    for (float x = x0; x < x1; x += kStep_m) {
      for (float y = y0; y < y1; y += kStep_m) add_point(x, y, z);
    }
  }
  void add_point(float x, float y, float z) {
    cloud::Point p;
    p.getVector3fMap() = Eigen::Vector3f(x, y, z);
    file_.cloud->push_back(p);
  }
  /// Two rays to each end, as from two pictures.
  void add_rays(const Eigen::Vector3d& from, const std::vector<Eigen::Vector3f>& ends) {
    views_.push_back({from, ends});
    views_.push_back({from, ends});
  }
  /// Rays along x that leave no part of the air over a strip of floor unseen.
  void look_along(float y0, float y1, float low, float high) {
    for (float y = y0; y < y1; y += kStep_m) {
      for (float z = low; z < high; z += kStep_m)
        add_rays({0.0, static_cast<double>(y), static_cast<double>(z)}, {{4.2F, y, z}});
    }
  }
  void add_camera(double x, double y, double z) {
    ExportPose pose;
    pose.world_from_camera.translation = {x, y, z};
    path_.push_back(pose);
  }
  void fill(const GridHeights& heights = {}) {
    const auto views = [&](const auto& take) -> core::Result<void> {
      for (const ViewRays& view : views_) {
        if (auto taken = take(view); !taken) return taken;
      }
      return {};
    };
    ASSERT_TRUE(set_cells(file_, path_, views, heights, grid_));
  }
  /// The cell at a place.
  [[nodiscard]] GridCell at(double x, double y) const {
    return grid_.at(static_cast<int>(x / 0.05), static_cast<int>(y / 0.05));
  }

  cloud::CloudFile file_;
  std::vector<ExportPose> path_;
  std::vector<ViewRays> views_;
  Grid grid_;
};

TEST_F(OccupancyGrid, TheInsideOfACabinetBelowTheCamerasViewIsNotFree) {
  add_plate(0.0F, 0.0F, 4.0F, 2.0F, 0.0F);
  look_along(0.0F, 2.0F, 0.1F, 1.1F);
  for (float x = 1.0F; x < 2.0F; x += kStep_m) {
    for (float z = 0.0F; z < 1.1F; z += kStep_m) add_point(x, 2.02F, z);  // its front
    std::vector<Eigen::Vector3f> over;
    for (float z = 1.15F; z < 2.4F; z += kStep_m) {
      add_point(x, 2.98F, z);  // the wall behind it
      over.emplace_back(x, 2.98F, z);
    }
    add_rays({static_cast<double>(x), 0.5, 1.4}, over);
  }
  fill();
  EXPECT_EQ(at(1.5, 2.02), GridCell::kOccupied);
  EXPECT_EQ(at(1.5, 2.5), GridCell::kUnknown) << "cameras looked over it only";
  EXPECT_EQ(at(1.5, 1.0), GridCell::kFree) << "before it";
}

TEST_F(OccupancyGrid, UnderATableIsOccupiedThoughItsFloorWasSeen) {
  add_plate(0.0F, 0.0F, 4.0F, 3.0F, 0.0F);
  add_plate(1.0F, 1.0F, 2.2F, 1.8F, 0.72F);
  look_along(0.0F, 3.0F, 0.1F, 1.1F);
  fill();
  EXPECT_EQ(at(1.5, 1.5), GridCell::kOccupied);
  EXPECT_EQ(at(0.5, 1.5), GridCell::kFree);
}

TEST_F(OccupancyGrid, UnderATableTopThatNoRayMetIsUnknown) {
  add_plate(0.0F, 0.0F, 4.0F, 3.0F, 0.0F);
  look_along(0.0F, 1.0F, 0.1F, 1.1F);
  look_along(1.0F, 3.0F, 0.1F, 0.68F);  // below it
  look_along(1.0F, 3.0F, 0.78F, 1.4F);  // and over it
  fill();
  EXPECT_EQ(at(1.5, 0.5), GridCell::kFree);
  EXPECT_EQ(at(1.5, 2.0), GridCell::kUnknown) << "its floor was seen, but not all of the air over it";

  grid_.cells.assign(grid_.cells.size(), GridCell::kUnknown);
  fill({0.0, 0.1, 0.5});
  EXPECT_EQ(at(1.5, 2.0), GridCell::kFree) << "a robot that is lower may go there";
}

TEST_F(OccupancyGrid, TheFloorAtTheEndsOfRaysIsFreeWithoutACloud) {
  look_along(0.4F, 0.6F, 0.1F, 1.1F);
  add_rays({0.5, 0.5, 1.4}, {{2.02F, 0.52F, 0.01F}, {3.02F, 0.52F, -0.5F}, {3.52F, 0.52F, 0.5F}});
  fill();
  EXPECT_EQ(at(2.02, 0.52), GridCell::kFree);
  EXPECT_EQ(at(3.02, 0.52), GridCell::kUnknown) << "deeper than the floor";
  EXPECT_EQ(at(3.52, 0.52), GridCell::kUnknown) << "one ray is no obstacle of the cloud, but no floor either";
}

TEST_F(OccupancyGrid, AColumnIsFreeIfAllOfItsHeightWasSeenThrough) {
  look_along(0.50F, 0.55F, 0.0F, 2.0F);
  look_along(1.00F, 1.05F, 0.5F, 2.0F);
  fill();
  EXPECT_EQ(at(2.0, 0.52), GridCell::kFree);
  EXPECT_EQ(at(2.0, 1.02), GridCell::kUnknown) << "its lower part was not seen";

  grid_.cells.assign(grid_.cells.size(), GridCell::kUnknown);
  fill({0.0, 0.6, 1.8});
  EXPECT_EQ(at(2.0, 1.02), GridCell::kFree) << "not an obstacle at these heights";
}

TEST_F(OccupancyGrid, WhoeverCarriedTheCameraHadRoom) {
  add_camera(1.0, 1.0, 1.4);
  add_camera(2.0, 1.0, 5.0);  // on a crane
  add_camera(3.0, 1.0, 1.2);  // held over a table
  add_plate(2.9F, 0.8F, 3.6F, 1.6F, 0.72F);
  fill();
  EXPECT_EQ(at(1.0, 1.0), GridCell::kFree);
  EXPECT_EQ(at(1.15, 1.0), GridCell::kFree);
  EXPECT_EQ(at(1.3, 1.0), GridCell::kUnknown);
  EXPECT_EQ(at(2.0, 1.0), GridCell::kUnknown);
  EXPECT_EQ(at(2.87, 1.0), GridCell::kUnknown) << "nobody stood in the table";
}

}  // namespace
}  // namespace plumbline::exports
