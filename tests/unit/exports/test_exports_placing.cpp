// SPDX-License-Identifier: BSD-3-Clause
// Where a second map lies in the frame of a first one.
#include <cmath>
#include <random>

#include "exports/export_test.hpp"
#include "pages/placing.hpp"
#include "plumbline/exports/view.hpp"

namespace plumbline::exports {
namespace {

using geometry::Rigid3;

/// A walk of 10 s around a bend; `noise_m`: off the true way.
std::vector<ExportPose> walk(double noise_m, const Rigid3& moved, double first_stamp = 0.0) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, noise_m);
  std::vector<ExportPose> poses;
  for (int i = 0; i < 100; ++i) {
    const double turn = 0.02 * i;
    ExportPose pose;
    pose.stamp = first_stamp + 0.1 * i;
    pose.world_from_camera.rotation = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    pose.world_from_camera.translation = {3.0 * std::cos(turn), 3.0 * std::sin(turn), 1.5};
    pose.world_from_camera = moved * pose.world_from_camera;
    for (int k = 0; k < 3; ++k) pose.world_from_camera.translation[k] += noise(random);
    poses.push_back(pose);
  }
  return poses;
}

TEST(CommonPoses, LayTwoMapsOfOneRecordingTogether) {
  const Rigid3 moved(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()).toRotationMatrix(), {5.0, -2.0, 0.3});
  const auto common = common_poses(walk(0.0, Rigid3()), walk(0.01, moved));
  ASSERT_TRUE(common);
  EXPECT_EQ(common->count, 100U);
  EXPECT_LT((common->first_from_second * moved).translation.norm(), 0.02);
  EXPECT_NEAR(common->rms_m, 0.01 * std::sqrt(3.0), 0.004);
}

TEST(CommonPoses, OtherTimesAndOtherWaysAreNone) {
  EXPECT_FALSE(common_poses(walk(0.0, Rigid3()), walk(0.0, Rigid3(), 1000.0)));
  std::vector<ExportPose> other = walk(0.0, Rigid3());  // the same stamps by chance
  for (ExportPose& pose : other) {
    pose.world_from_camera.rotation =
        Eigen::AngleAxisd(-pose.stamp, Eigen::Vector3d::UnitX()).toRotationMatrix();
    pose.world_from_camera.translation = {0.5 * pose.stamp, 0.0, 1.0};
  }
  EXPECT_FALSE(common_poses(walk(0.0, Rigid3()), other));
  EXPECT_FALSE(common_poses({}, other));
}

class TwoClouds : public ExportTest {
 protected:
  /// Floor and two walls of a room, `moved`; with a third wall if it is another room.
  void write_room(const std::string& name, const Eigen::Vector3f& moved, bool other = false) const {
    cloud::Cloud room;
    for (float a = 0.0F; a < 2.0F; a += 0.02F) {
      for (float b = 0.0F; b < 2.0F; b += 0.02F) {
        const float wave = other ? 0.5F * std::sin(4.0F * a) * std::cos(3.0F * b) : 0.0F;
        room.push_back(point(a, b, wave));
        room.push_back(point(wave, a, b, Eigen::Vector3f::UnitX()));
        room.push_back(point(a, wave, b, Eigen::Vector3f::UnitY()));
      }
    }
    for (cloud::Point& p : room) p.getVector3fMap() += moved;
    ASSERT_TRUE(cloud::write_ply(path(name), room));
  }
  core::Result<MapView> both(const std::string& first, const std::string& second) {
    ExportRequest one = request("");
    one.input = path(first);
    ExportRequest other = one;
    other.input = path(second);
    return view_of_two(one, other, executor_, *core::null_log(), nullptr);
  }
};

TEST_F(TwoClouds, AreLaidTogetherByIcpAndThePageSaysHowWell) {
  write_room("a.ply", Eigen::Vector3f::Zero());
  write_room("b.ply", Eigen::Vector3f(0.05F, -0.04F, 0.06F));
  const auto view = both("a.ply", "b.ply");
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_NE(view->scene.placing.find("by ICP"), std::string::npos) << view->scene.placing;
  EXPECT_NE(view->scene.placing.find("% of the points of b.ply"), std::string::npos) << view->scene.placing;
  ASSERT_EQ(view->scene.clouds.size(), 2U);
  const auto& a = view->scene.clouds[0].positions;
  const auto& b = view->scene.clouds[1].positions;
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); i += 97) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(a[i][k], b[i][k], 0.002F) << i;
  }
}

TEST_F(TwoClouds, OfOtherPlacesAreRefused) {
  write_room("a.ply", Eigen::Vector3f::Zero());
  write_room("far.ply", Eigen::Vector3f(8.0F, 0.0F, 0.0F));
  write_room("other.ply", Eigen::Vector3f(1.0F, 1.0F, 1.0F), true);
  for (const char* second : {"far.ply", "other.ply"}) {
    const auto view = both("a.ply", second);
    ASSERT_FALSE(view) << second << ": " << view->scene.placing;
    EXPECT_EQ(view.error().kind, core::ErrorKind::kUntrustworthy) << second;
    EXPECT_NE(view.error().message.find("cannot be aligned"), std::string::npos) << view.error().message;
  }
}

}  // namespace
}  // namespace plumbline::exports
