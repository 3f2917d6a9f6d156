// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include "plumbline/dataset/trajectory_io.hpp"
#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class TrajectoryFile : public RecordingTest {
 protected:
  std::string error_of(const std::string& text) {
    write_text("t.txt", text);
    const auto trajectory = read_trajectory(folder_ / "t.txt");
    EXPECT_FALSE(trajectory) << text;
    return trajectory ? "" : trajectory.error().message;
  }
  /// Files that a write left half done.
  int unfinished() const {
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      count += entry.path().extension() == ".part" ? 1 : 0;
    }
    return count;
  }
};

TEST_F(TrajectoryFile, WritesWhatItReads) {
  geometry::Trajectory trajectory;
  for (int i = 0; i < 5; ++i) {
    trajectory.push_back({1305031229.528748 + i, geometry::Rigid3(geometry::exp_so3({0.1 * i, -0.3, 3.0}),
                                                                  Eigen::Vector3d(i, -0.123456789, 1e-10))});
  }
  ASSERT_TRUE(write_trajectory(folder_ / "t.txt", trajectory));
  EXPECT_EQ(unfinished(), 0);
  const auto again = read_trajectory(folder_ / "t.txt");
  ASSERT_TRUE(again) << again.error().message;
  ASSERT_EQ(again->size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR((*again)[i].stamp, trajectory[i].stamp, 1e-6);
    const geometry::Rigid3 error = (*again)[i].world_from_camera.inverse() * trajectory[i].world_from_camera;
    EXPECT_LT(geometry::log_se3(error).norm(), 1e-8);
  }
}

TEST_F(TrajectoryFile, SortsAndTakesCarriageReturns) {
  write_text("t.txt", "# stamp tx ...\r\n\r\n2 0 0 2 0 0 0 1\r\n1 0 0 1 0 0 0 2\r\n");
  const auto trajectory = read_trajectory(folder_ / "t.txt");
  ASSERT_TRUE(trajectory) << trajectory.error().message;
  ASSERT_EQ(trajectory->size(), 2U);
  EXPECT_EQ((*trajectory)[0].stamp, 1.0);
  EXPECT_EQ((*trajectory)[0].world_from_camera.rotation, Eigen::Matrix3d::Identity());
}

TEST_F(TrajectoryFile, EmptyIsATrajectory) {
  write_text("t.txt", "# nothing\n");
  const auto trajectory = read_trajectory(folder_ / "t.txt");
  ASSERT_TRUE(trajectory);
  EXPECT_TRUE(trajectory->empty());
  ASSERT_TRUE(write_trajectory(folder_ / "t.txt", {}));
  EXPECT_TRUE(read_trajectory(folder_ / "t.txt")->empty());
}

TEST_F(TrajectoryFile, ErrorsNameTheLine) {
  EXPECT_THAT(error_of("# x\n1 0 0 0 0 0 0 1\n2 0 0 0 0 0 1\n"),
              AllOf(HasSubstr("t.txt:3"), HasSubstr("7 words")));
  EXPECT_THAT(error_of("1 0 0 zero 0 0 0 1\n"),
              AllOf(HasSubstr("t.txt:1"), HasSubstr("'zero' is no number")));
  EXPECT_THAT(error_of("1 0 0 0 0 0 0 1\n2 nan 0 0 0 0 0 1\n"),
              AllOf(HasSubstr("t.txt:2"), HasSubstr("finite")));
  EXPECT_THAT(error_of("1 0 inf 0 0 0 0 1\n"), HasSubstr("finite"));
  EXPECT_THAT(error_of("\n\n1 0 0 0 0 0 0 0\n"),
              AllOf(HasSubstr("t.txt:3"), HasSubstr("quaternion is zero")));
  EXPECT_THAT(error_of("1 0 0 0x1 0 0 0 1\n"), HasSubstr("no number"));
}

TEST_F(TrajectoryFile, MissingFilesAndFolders) {
  const auto missing = read_trajectory(folder_ / "none.txt");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, core::ErrorKind::kInput);
  EXPECT_THAT(missing.error().message, HasSubstr("none.txt"));
  EXPECT_FALSE(read_trajectory(folder_));
  const auto nowhere = write_trajectory(folder_ / "no" / "such" / "t.txt", {});
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().kind, core::ErrorKind::kOutput);
  std::filesystem::create_directories(folder_ / "taken.txt" / "inside");
  const auto taken = write_trajectory(folder_ / "taken.txt", {});
  ASSERT_FALSE(taken);
  EXPECT_EQ(unfinished(), 0);
}

}  // namespace
}  // namespace plumbline::dataset
