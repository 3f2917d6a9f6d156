// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include "plumbline/dataset/trajectory_io.hpp"
#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::AllOf;
using testing::ElementsAre;
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
              AllOf(HasSubstr("t.txt:1"), HasSubstr("'zero' is not a number")));
  EXPECT_THAT(error_of("1 0 inf 0 0 0 0 1\n"), AllOf(HasSubstr("t.txt:1"), HasSubstr("no row is finite")));
  EXPECT_THAT(error_of("\n\n1 0 0 0 0 0 0 0\n"),
              AllOf(HasSubstr("t.txt:3"), HasSubstr("quaternion is zero")));
  EXPECT_THAT(error_of("1 0 0 0x1 0 0 0 1\n"), HasSubstr("not a number"));
}

TEST_F(TrajectoryFile, RowsWithNanAreLeftOutAndCounted) {
  write_text("t.txt",
             "1 0 0 0 0 0 0 1\n2 nan 0 0 0 0 0 1\n3 0 0 0 0 0 -inf 1\nnan 0 0 0 0 0 0 1\n4 0 0 0 0 0 0 1\n");
  const auto reading = read_trajectory_file(folder_ / "t.txt");
  ASSERT_TRUE(reading) << reading.error().message;
  EXPECT_EQ(reading->poses.size(), 2U);
  EXPECT_EQ(reading->rows.size(), 5U);
  EXPECT_THAT(reading->notes, ElementsAre(HasSubstr("3 of 5 rows")));
  std::vector<std::string> notes;
  EXPECT_EQ(read_trajectory(folder_ / "t.txt", &notes)->size(), 2U);
  EXPECT_THAT(notes, ElementsAre(AllOf(HasSubstr("t.txt"), HasSubstr("3 of 5 rows"))));
}

TEST_F(TrajectoryFile, DecimalCommasAreRefused) {
  EXPECT_THAT(
      error_of("# x\n1300000000,066667 0,000473 -0,008971 -2,500000 0,001014 0,000506 0,000269 0,999999\n"),
      AllOf(HasSubstr("t.txt:2"), HasSubstr("decimal comma")));
  EXPECT_THAT(error_of("1300000000,066667;0,000473;-0,008971;-2,5;0,001014;0,000506;0,000269;0,999999\n"),
              HasSubstr("decimal comma"));
  EXPECT_THAT(
      error_of("1300000000,066667,0,000473,-0,008971,-2,500000,0,001014,0,000506,0,000269,0,999999\n"),
      HasSubstr("decimal comma"));
  write_text("t.txt", "1.5, 1, 2, 3, 0, 0, 0, 1\n2.5,1,2,3,0,0,0,1\n");  // commas that separate
  EXPECT_EQ(read_trajectory(folder_ / "t.txt")->size(), 2U);
}

TEST_F(TrajectoryFile, EurocHasNanosecondsAndWFirst) {
  const char* const rows =
      "1300000000066667008,1,2,3,0.5,0.1,0.2,0.3\r\n1300000000100000000,1,2,3,0.5,0.1,0.2,0.3\r\n";
  const Eigen::Quaterniond truth = Eigen::Quaterniond(0.5, 0.1, 0.2, 0.3).normalized();
  for (const char* header :
       {"#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z "
        "[]\r\n",
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\r\n",
        ""}) {
    write_text("t.csv", std::string(header) + rows);
    const auto reading = read_trajectory_file(folder_ / "t.csv");
    ASSERT_TRUE(reading) << reading.error().message;
    EXPECT_EQ(reading->format, "EuRoC");
    ASSERT_EQ(reading->poses.size(), 2U);
    EXPECT_NEAR(reading->poses[0].stamp, 1300000000.066667, 1e-6);
    EXPECT_LT(reading->poses[0].world_from_camera.quaternion().angularDistance(truth), 1e-9);
    EXPECT_EQ(reading->poses[0].world_from_camera.translation, Eigen::Vector3d(1, 2, 3));
  }
}

TEST_F(TrajectoryFile, HeadersTellTheColumns) {
  write_text("t.csv",
             "timestamp, frame, x, y, z, qx, qy, qz, qw\n100.000000, 000000, 1, 2, 3, 0.1, 0.2, 0.3, 0.5\n");
  const Eigen::Quaterniond truth = Eigen::Quaterniond(0.5, 0.1, 0.2, 0.3).normalized();
  const auto stray = read_trajectory_file(folder_ / "t.csv");
  ASSERT_TRUE(stray) << stray.error().message;
  ASSERT_EQ(stray->poses.size(), 1U);
  EXPECT_EQ(stray->poses[0].stamp, 100.0);
  EXPECT_LT(stray->poses[0].world_from_camera.quaternion().angularDistance(truth), 1e-9);
  write_text("t.txt", "# timestamp tx ty tz qw qx qy qz\n1 1 2 3 0.5 0.1 0.2 0.3\n");
  const auto tum = read_trajectory_file(folder_ / "t.txt");
  ASSERT_TRUE(tum) << tum.error().message;
  EXPECT_EQ(tum->format, "TUM");
  EXPECT_LT(tum->poses[0].world_from_camera.quaternion().angularDistance(truth), 1e-9);
  write_text("t.txt", "1403636579763555584.0 1 2 3 0.1 0.2 0.3 0.5\n");  // ORB-SLAM's, for EuRoC
  EXPECT_NEAR((*read_trajectory(folder_ / "t.txt"))[0].stamp, 1403636579.763556, 1e-6);
}

TEST_F(TrajectoryFile, KittiHasNoStamps) {
  write_text("kitti.txt",
             "1 0 0 5 0 1 0 6 0 0 1 7\nnan nan nan nan nan nan nan nan nan nan nan nan\n"
             "0 -1 0 5 1 0 0 6 0 0 1 8\n");
  auto kitti = read_trajectory_file(folder_ / "kitti.txt");
  ASSERT_TRUE(kitti) << kitti.error().message;
  EXPECT_FALSE(kitti->stamped);
  ASSERT_EQ(kitti->poses.size(), 2U);
  EXPECT_EQ(kitti->poses[1].stamp, 2.0);
  EXPECT_EQ(kitti->poses[1].world_from_camera.translation, Eigen::Vector3d(5, 6, 8));
  const auto alone = read_trajectory(folder_ / "kitti.txt");
  ASSERT_FALSE(alone);
  EXPECT_THAT(alone.error().message, HasSubstr("without stamps"));

  write_text("t.txt", "10 5 6 7 0 0 0 1\n11 5 6 7 0 0 0 1\n12 5 6 8 0 0 0 1\n");
  auto stamped = read_trajectory_file(folder_ / "t.txt");
  ASSERT_TRUE(stamped);
  ASSERT_TRUE(pair_by_number(*kitti, *stamped));
  EXPECT_EQ(kitti->poses[1].stamp, 12.0);
  EXPECT_THAT(kitti->notes.back(), AllOf(HasSubstr("paired by number"), HasSubstr("3 poses")));
  stamped->rows.pop_back();
  kitti = read_trajectory_file(folder_ / "kitti.txt");
  const auto apart = pair_by_number(*stamped, *kitti);
  ASSERT_FALSE(apart);
  EXPECT_THAT(apart.error().message, AllOf(HasSubstr("2 poses"), HasSubstr("3 in the truth")));

  auto one = read_trajectory_file(folder_ / "kitti.txt");
  auto other = read_trajectory_file(folder_ / "kitti.txt");
  ASSERT_TRUE(pair_by_number(*one, *other));
  EXPECT_DOUBLE_EQ(one->poses[1].stamp, 0.2);
  EXPECT_DOUBLE_EQ(other->poses[1].stamp, 0.2);
}

TEST_F(TrajectoryFile, ReplicaHasWholeMatrices) {
  write_text("traj.txt", "1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1\n1 0 0 5 0 1 0 6 0 0 1 8 0 0 0 1\n");
  const auto reading = read_trajectory_file(folder_ / "traj.txt");
  ASSERT_TRUE(reading) << reading.error().message;
  EXPECT_FALSE(reading->stamped);
  EXPECT_EQ(reading->poses[1].world_from_camera.translation.z(), 8.0);
  EXPECT_THAT(error_of("1 0 0 5 0 1 0 6 0 0 1 7\n2 0 0 5 0 1 0 6 0 0 1 7\n"),
              AllOf(HasSubstr("t.txt:2"), HasSubstr("not a rotation")));
}

TEST_F(TrajectoryFile, SharedStampsAreCounted) {
  write_text("t.txt", "1 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n");
  const auto reading = read_trajectory_file(folder_ / "t.txt");
  ASSERT_TRUE(reading);
  EXPECT_EQ(reading->poses.size(), 4U);
  EXPECT_THAT(reading->notes, ElementsAre(HasSubstr("3 poses share one stamp")));
}

TEST_F(TrajectoryFile, TellsPathsFromClouds) {
  const auto holds = [&](const char* text) {
    write_text("x.txt", text);
    return holds_poses(folder_ / "x.txt");
  };
  EXPECT_TRUE(holds("1 0 0 0 0 0 0 1\n"));
  EXPECT_TRUE(holds("1 0 0 5 0 1 0 6 0 0 1 7\n"));
  EXPECT_TRUE(holds("#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z\n1,0,0,0,1,0,0,0\n"));
  EXPECT_FALSE(holds("1 2 3\n"));
  EXPECT_FALSE(holds("x y z red green blue nx ny\n1 2 3 255 255 0 0 1\n"));
  EXPECT_FALSE(holds("# nothing\n"));
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
