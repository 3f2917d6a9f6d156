// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>
#include <random>

#include "plumbline/cloud/depth_field.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "test_cloud_worlds.hpp"

namespace plumbline::cloud {
namespace {

using worlds::camera;
using worlds::point;

/// A box of 5 x 3 x 5 m, and a camera that pans along one wall and back over half of it.
class Room {
 public:
  Room(const DepthField& error, double noise, int views) : error_(error) {
    for (int i = 0; i < views; ++i) {
      const double s = static_cast<double>(i) / (views - 1);
      const double yaw = 0.5 * std::sin(2.5 * M_PI * s);
      const Eigen::Matrix3d turn = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(0.3 * std::sin(9.0 * s), Eigen::Vector3d::UnitX()))
                                       .toRotationMatrix();
      poses.emplace_back(turn, Eigen::Vector3d(0.4 * std::sin(5.0 * s), 0.1 * s, 0.3 * std::cos(7.0 * s)));
      clouds.push_back(seen(poses.back(), noise, static_cast<unsigned>(i + 1)));
    }
  }
  [[nodiscard]] core::Result<DepthField> find(DepthFieldReport& report, int threads = 1,
                                              const DepthFieldOptions& options = {}) const {
    std::vector<std::size_t> all(poses.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    const core::Executor executor(threads);
    return find_depth_field(
        all, poses,
        [this](std::size_t i) -> core::Result<CloudPtr> { return std::make_shared<Cloud>(*clouds[i]); },
        camera(), options, executor, &report);
  }
  /// RMS of the points' distances from the walls, metres, after the correction.
  [[nodiscard]] double thickness(const DepthField& field) const {
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      Cloud cloud = *clouds[i];
      field.correct(cloud);
      for (const Point& p : cloud.points) {
        if (!std::isfinite(p.x)) continue;
        const double d = distance(poses[i] * p.getVector3fMap().cast<double>());
        sum += d * d;
        ++count;
      }
    }
    return std::sqrt(sum / static_cast<double>(count));
  }

  std::vector<geometry::Rigid3> poses;
  std::vector<CloudPtr> clouds;

 private:
  static constexpr double kHalf[3] = {2.5, 1.5, 2.5};

  static double distance(const Eigen::Vector3d& p) {
    double least = 1e9;
    for (int k = 0; k < 3; ++k) least = std::min(least, std::abs(kHalf[k] - std::abs(p[k])));
    return least;
  }
  [[nodiscard]] CloudPtr seen(const geometry::Rigid3& world_from_camera, double noise, unsigned seed) const {
    std::mt19937 random(seed);
    std::normal_distribution<double> gauss(0.0, noise);
    auto cloud = std::make_shared<Cloud>();
    for (int v = 0; v < 480; v += 4) {
      for (int u = 0; u < 640; u += 4) {
        const Eigen::Vector3d ray = camera().unproject(u, v, 1.0);
        const Eigen::Vector3d way = world_from_camera.rotation * ray;
        double z = 1e9;
        Eigen::Vector3d normal = Eigen::Vector3d::Zero();
        for (int k = 0; k < 3; ++k) {
          const double to =
              ((way[k] > 0.0 ? kHalf[k] : -kHalf[k]) - world_from_camera.translation[k]) / way[k];
          if (!(to > 0.0) || to >= z) continue;
          z = to;
          normal = Eigen::Vector3d::Zero();
          normal[k] = way[k] > 0.0 ? -1.0 : 1.0;
        }
        const double measured =
            1.0 / (1.0 / z - error_.beta(ray.x(), ray.y())) + sensor::depth_sigma(z) * gauss(random);
        const Eigen::Vector3f p = (measured * ray).cast<float>();
        const Eigen::Vector3f n = (world_from_camera.rotation.transpose() * normal).cast<float>();
        cloud->push_back(point(p.x(), p.y(), p.z(), n));
      }
    }
    return cloud;
  }

  DepthField error_;
};

/// A bowl: 1/z too large at the rim, 4 cm at 2 m in the corners, and lopsided.
DepthField bowl() {
  DepthField::Terms terms = DepthField::Terms::Zero();
  terms[0] = 0.016;
  terms[2] = 0.024;
  terms[3] = -0.01;
  return DepthField(terms);
}

TEST(DepthField, MeasuresAndCorrectionsAreOppositeAndNormalsTurnWithTheSurface) {
  // A wall at 2 m as a camera with this error sees it, with the normals of what it sees.
  const DepthField field = bowl();
  Cloud seen;
  const auto at = [&](double x, double y) -> Eigen::Vector3d {
    return Eigen::Vector3d(x, y, 1.0) / (0.5 - field.beta(x, y));
  };
  for (double y = -0.4; y <= 0.4; y += 0.1) {
    for (double x = -0.5; x <= 0.5; x += 0.1) {
      const Eigen::Vector3d along_x = at(x + 1e-4, y) - at(x - 1e-4, y);
      const Eigen::Vector3d along_y = at(x, y + 1e-4) - at(x, y - 1e-4);
      const Eigen::Vector3d p = at(x, y);
      seen.push_back(point(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()),
                           along_y.cross(along_x).normalized().cast<float>()));
    }
  }
  double bent = 0.0;
  for (const Point& p : seen.points) bent = std::max(bent, std::acos(std::min(1.0, -1.0 * p.normal_z)));
  EXPECT_GT(bent, 0.01);
  Point none = point(0.1F, 0.1F, 1.0F);
  none.x = none.y = none.z = none.normal_x = std::numeric_limits<float>::quiet_NaN();
  seen.push_back(none);
  field.correct(seen);
  EXPECT_TRUE(std::isnan(seen.back().z));
  seen.points.pop_back();
  for (const Point& p : seen.points) {
    EXPECT_NEAR(p.z, 2.0, 1e-5);
    EXPECT_NEAR(p.normal_z, -1.0, 1e-5);
  }
}

TEST(DepthField, NothingAndNonsenseAreSurvived) {
  Cloud cloud;
  cloud.push_back(point(0.0F, 0.0F, 2.0F));
  cloud.push_back(point(1.0F, 1.0F, 2.0F));
  DepthField().correct(cloud);
  EXPECT_EQ(cloud[1].z, 2.0F);
  DepthField::Terms wild = DepthField::Terms::Constant(-100.0);
  DepthField(wild).correct(cloud);
  EXPECT_EQ(cloud[0].z, 2.0F);  // the middle is right
  EXPECT_NEAR(cloud[1].z, 4.0F, 1e-4F);
}

TEST(DepthField, IsFoundFromViewsThatDisagree) {
  const Room room(bowl(), 0.5, 24);
  DepthFieldReport report;
  const auto field = room.find(report);
  ASSERT_TRUE(field) << field.error().message;
  EXPECT_TRUE(report.used);
  EXPECT_GT(report.samples, 20000U);
  EXPECT_LT(report.after, 0.8 * report.before);
  EXPECT_NEAR(report.most_at_2m, 0.04, 0.02);
  for (double x = -0.5; x <= 0.5; x += 0.25) {
    for (double y = -0.4; y <= 0.4; y += 0.2) EXPECT_NEAR(field->beta(x, y), bowl().beta(x, y), 0.0012);
  }
  const double best = Room(DepthField(), 0.5, 24).thickness(DepthField());
  EXPECT_GT(room.thickness(DepthField()), 2.0 * best);
  EXPECT_LT(room.thickness(*field), 1.1 * best);
}

TEST(DepthField, AGoodCameraIsLeftAlone) {
  DepthFieldReport report;
  const auto field = Room(DepthField(), 1.0, 24).find(report);
  ASSERT_TRUE(field);
  EXPECT_FALSE(report.used);
  EXPECT_TRUE(field->identity());
  EXPECT_GT(report.after, 0.97 * report.before);
}

TEST(DepthField, FewViewsSayNothing) {
  for (const int views : {2, 5}) {
    DepthFieldReport report;
    const auto field = Room(bowl(), 0.5, views).find(report);
    ASSERT_TRUE(field);
    EXPECT_TRUE(field->identity());
    EXPECT_FALSE(report.used);
  }
  const core::Executor executor(1);
  const auto none = find_depth_field(
      {}, {}, [](std::size_t) { return core::Result<CloudPtr>(); }, camera(), {}, executor);
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->identity());
}

TEST(DepthField, SameForAnyNumberOfThreads) {
  const Room room(bowl(), 0.5, 16);
  DepthFieldReport report;
  const auto one = room.find(report, 1);
  const auto four = room.find(report, 4);
  ASSERT_TRUE(one && four);
  EXPECT_FALSE(one->identity());
  EXPECT_EQ(one->coefficients(), four->coefficients());
}

TEST(DepthField, AnErrorOfTheReaderIsTold) {
  const core::Executor executor(2);
  const std::vector<geometry::Rigid3> poses(8);
  const auto field = find_depth_field(
      {0, 1, 2, 3, 4, 5, 6, 7}, poses,
      [](std::size_t i) -> core::Result<CloudPtr> {
        if (i == 3) return core::output_error("the disk went away");
        return std::make_shared<Cloud>();
      },
      camera(), {}, executor);
  ASSERT_FALSE(field);
  EXPECT_EQ(field.error().message, "the disk went away");
}

}  // namespace
}  // namespace plumbline::cloud
