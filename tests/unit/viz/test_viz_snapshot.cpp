// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "plumbline/viz/snapshot.hpp"

namespace plumbline::viz {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZRGBNormal>;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

pcl::PointXYZRGBNormal point(const Eigen::Vector3d& p, const Eigen::Vector3d& n, const Rgb& color) {
  pcl::PointXYZRGBNormal out;
  out.getVector3fMap() = p.cast<float>();
  out.getNormalVector3fMap() = n.cast<float>();
  out.r = color.r;
  out.g = color.g;
  out.b = color.b;
  return out;
}

/// A closed room 4 x 3 m, 2.4 m high, in the frame of a camera (y down) tilted about x by `tilt_rad`. Seen
/// from above with the camera's forward direction up: left wall red, right wall green, far wall blue, near
/// wall yellow, floor grey; the ceiling is magenta and must not be seen.
Scene make_room(double tilt_rad = 0.0) {
  const Eigen::Matrix3d tilt = Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitX()).toRotationMatrix();
  auto cloud = std::make_shared<Cloud>();
  const auto plane = [&](const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
                         const Eigen::Vector3d& normal, const Rgb& color) {
    constexpr double kStep = 0.04;
    for (double a = 0.0; a <= u.norm(); a += kStep) {
      for (double b = 0.0; b <= v.norm(); b += kStep) {
        cloud->push_back(
            point(tilt * (corner + a * u.normalized() + b * v.normalized()), tilt * normal, color));
      }
    }
  };
  const Eigen::Vector3d x = 4.0 * Eigen::Vector3d::UnitX(), y = 2.4 * Eigen::Vector3d::UnitY(),
                        z = 3.0 * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d corner(-2.0, -1.2, -1.5);
  plane(corner + y, x, z, {0, -1, 0}, {128, 128, 128});
  plane(corner, x, z, {0, 1, 0}, {255, 0, 255});
  plane(corner, y, z, {1, 0, 0}, {220, 30, 30});
  plane(corner + x, y, z, {-1, 0, 0}, {30, 200, 30});
  plane(corner + z, x, y, {0, 0, -1}, {30, 30, 220});
  plane(corner, x, y, {0, 0, 1}, {220, 220, 30});
  Scene scene;
  scene.cloud = cloud;
  scene.title = "Room";
  CameraPath path;
  path.name = "camera";
  for (int i = 0; i < 20; ++i) {
    path.trajectory.push_back({0.1 * i, {tilt, tilt * Eigen::Vector3d(-0.5 + 0.05 * i, 0.0, 0.0)}});
  }
  path.color = {0, 0, 0};
  scene.paths.push_back(path);
  return scene;
}

class Snapshots : public ::testing::Test {
 protected:
  void SetUp() override {
    unsetenv("DISPLAY");
    folder_ = std::filesystem::path(::testing::TempDir()) /
              (std::string("plumbline_snapshot_") +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  cv::Mat render(const Scene& scene, const SnapshotOptions& options, const std::string& name = "a.png") {
    const auto done = render_snapshot(scene, options, folder_ / name);
    EXPECT_TRUE(done.has_value()) << (done ? "" : done.error().message);
    return cv::imread((folder_ / name).string());
  }
  std::string bytes(const std::string& name) {
    std::ifstream in(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static SnapshotOptions small(View view) {
    SnapshotOptions options;
    options.view = view;
    options.width_px = 400;
    options.height_px = 300;
    options.annotations = false;
    return options;
  }
  std::filesystem::path folder_;
};

enum class Hue { kRed, kGreen, kBlue, kYellow, kMagenta, kGrey, kBackground };

bool is(const cv::Vec3b& bgr, Hue hue) {
  const int b = bgr[0], g = bgr[1], r = bgr[2];
  switch (hue) {
    case Hue::kRed:
      return r > 100 && g < 70 && b < 70;
    case Hue::kGreen:
      return g > 90 && r < 70 && b < 70;
    case Hue::kBlue:
      return b > 100 && r < 70 && g < 70;
    case Hue::kYellow:
      return r > 100 && g > 100 && b < 70;
    case Hue::kMagenta:
      return r > 120 && b > 120 && g < 70;
    case Hue::kGrey:
      return std::abs(r - g) < 8 && std::abs(g - b) < 8 && r > 60 && r < 160;
    case Hue::kBackground:
      return r > 240 && g > 240 && b > 240;
  }
  return false;
}

struct Found {
  int count = 0;
  double x = 0.0, y = 0.0;  // mean place, as part of the picture from the upper left corner
};

Found find(const cv::Mat& picture, Hue hue) {
  Found found;
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) {
      if (!is(picture.at<cv::Vec3b>(v, u), hue)) continue;
      ++found.count;
      found.x += (u + 0.5) / picture.cols;
      found.y += (v + 0.5) / picture.rows;
    }
  }
  found.x /= std::max(1, found.count);
  found.y /= std::max(1, found.count);
  return found;
}

/// Pixels on the outermost `border` of the picture that are not background.
int drawn_on_border(const cv::Mat& picture, int border) {
  int drawn = 0;
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) {
      const bool inside =
          u >= border && v >= border && u < picture.cols - border && v < picture.rows - border;
      if (!inside && !is(picture.at<cv::Vec3b>(v, u), Hue::kBackground)) ++drawn;
    }
  }
  return drawn;
}

TEST_F(Snapshots, SparseSurfacesFarAwayAreInThePictureToo) {
  // Near the camera a thousand times as many points per square metre as on the floor behind.
  Scene scene;
  auto cloud = std::make_shared<Cloud>();
  const auto ground = [&](double x0, double x1, double step, const Rgb& color) {
    for (double x = x0; x < x1; x += step) {
      for (double z = -0.5; z < 0.5; z += step) {
        cloud->push_back(point({x, 0.0, z}, Eigen::Vector3d(0, -1, 0), color));
      }
    }
  };
  ground(0.0, 1.0, 0.003, {128, 128, 128});
  ground(1.0, 5.0, 0.1, {220, 30, 30});
  scene.cloud = cloud;
  const cv::Mat picture = render(scene, small(View::kTop));
  EXPECT_GT(find(picture, Hue::kRed).count, 100);
  EXPECT_EQ(drawn_on_border(picture, 8), 0);
}

TEST_F(Snapshots, NoDustStaysOfACeilingThatIsLeftOut) {
  Scene scene = make_room();
  auto cloud = std::make_shared<Cloud>(*scene.cloud);
  for (std::size_t i = 0; i < cloud->size();
       i += 7) {  // every seventh normal is noise, here: the other way round
    auto& p = (*cloud)[i];
    if (p.r > 200 && p.b > 200) p.getNormalVector3fMap() *= -1.0F;
  }
  scene.cloud = cloud;
  const cv::Mat picture = render(scene, small(View::kTop));
  const cv::Rect inside(picture.cols / 4, picture.rows / 5, picture.cols / 2,
                        picture.rows * 3 / 5);  // no walls
  EXPECT_EQ(find(picture(inside), Hue::kMagenta).count, 0);
}

TEST_F(Snapshots, IsoViewLooksWhereTheCamerasLooked) {
  // Walls at 45 degrees: their direction next to the heading is a matter of chance, the side shown is not.
  for (const double turn : {-0.6, 0.6}) {
    Scene scene = make_room();
    const Eigen::Matrix3d heading = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY()).toRotationMatrix();
    for (auto& pose : scene.paths[0].trajectory) pose.world_from_camera.rotation = heading;
    const cv::Mat picture = render(scene, small(View::kIso), "iso.png");
    // Turned to the right (clockwise from above) the cameras saw the right wall; to the left, the left one.
    EXPECT_EQ(find(picture, Hue::kGreen).count > 100, turn > 0.0) << turn;
    EXPECT_EQ(find(picture, Hue::kRed).count > 100, turn < 0.0) << turn;
  }
}

TEST_F(Snapshots, TopViewIsAPlanWithoutCeiling) {
  for (const double tilt : {0.0, 0.5}) {  // a camera that looked 29 degrees up or down at the start
    const cv::Mat picture = render(make_room(tilt), small(View::kTop));
    ASSERT_EQ(picture.cols, 400);
    ASSERT_EQ(picture.rows, 300);
    EXPECT_TRUE(is(picture.at<cv::Vec3b>(2, 2), Hue::kBackground));
    EXPECT_TRUE(is(picture.at<cv::Vec3b>(297, 397), Hue::kBackground));
    EXPECT_GT(find(picture, Hue::kGrey).count, 400 * 300 / 3);
    EXPECT_EQ(find(picture, Hue::kMagenta).count, 0);
    for (const Hue wall : {Hue::kRed, Hue::kGreen, Hue::kBlue, Hue::kYellow}) {
      EXPECT_GT(find(picture, wall).count, 100) << "tilt " << tilt << " wall " << static_cast<int>(wall);
    }
    EXPECT_LT(find(picture, Hue::kRed).x, 0.2);
    EXPECT_GT(find(picture, Hue::kGreen).x, 0.8);
    EXPECT_LT(find(picture, Hue::kBlue).y, 0.2);
    EXPECT_GT(find(picture, Hue::kYellow).y, 0.8);
  }
}

TEST_F(Snapshots, TopViewOfAnUprightMapHasXToTheRight) {
  // As floor plans and grids; wherever the first camera looked.
  Scene scene;
  auto cloud = std::make_shared<Cloud>();
  for (double x = 0.0; x < 2.0; x += 0.02) {
    for (double y = 0.0; y < 1.0; y += 0.02) {
      const Rgb color = x > 1.8 ? Rgb{220, 30, 30} : y > 0.8 ? Rgb{30, 30, 220} : Rgb{128, 128, 128};
      cloud->push_back(point({x, y, 0.0}, Eigen::Vector3d::UnitZ(), color));
    }
  }
  scene.cloud = cloud;

  SnapshotOptions options = small(View::kTop);
  options.up = Eigen::Vector3d::UnitZ();
  for (const double yaw : {0.0, 1.6, 3.0}) {
    Eigen::Matrix3d camera;  // x right, y down, z ahead
    camera.col(2) = Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.0);
    camera.col(1) = -Eigen::Vector3d::UnitZ();
    camera.col(0) = camera.col(1).cross(camera.col(2));
    scene.paths.assign(1, {});
    scene.paths[0].trajectory.push_back({0.0, {camera, Eigen::Vector3d(1.0, 0.5, 1.5)}});

    const cv::Mat picture = render(scene, options);
    EXPECT_GT(find(picture, Hue::kRed).x, 0.8) << yaw;
    EXPECT_LT(find(picture, Hue::kBlue).y, 0.4) << yaw;
  }
}

TEST_F(Snapshots, NothingLiesBehindTheColorBar) {
  Scene scene = make_room();
  for (std::size_t i = 0; i < scene.cloud->size(); ++i) scene.scalars.push_back(0.0F);
  for (const View view : {View::kTop, View::kIso, View::kFront}) {
    SnapshotOptions options = small(view);
    options.width_px = 300;  // the room fills the width
    options.color = ColorMode::kError;
    options.scalar_range = {1.0, 2.0};
    options.annotations = true;
    const cv::Mat with_bar = render(scene, options, "bar.png");
    const cv::Mat bar_place = with_bar(cv::Rect(300 - 36, 170, 36, 50));  // below the bar, above the axes
    for (int y = 0; y < bar_place.rows; ++y) {
      for (int x = 0; x < bar_place.cols; ++x)
        ASSERT_TRUE(is(bar_place.at<cv::Vec3b>(y, x), Hue::kBackground)) << view_name(view) << x << "," << y;
    }
  }
}

TEST_F(Snapshots, CeilingHidesThePlanWhenCullingIsOff) {
  SnapshotOptions options = small(View::kTop);
  options.cull_back_faces = false;
  EXPECT_GT(find(render(make_room(), options), Hue::kMagenta).count, 400 * 300 / 3);
}

TEST_F(Snapshots, SideViewsShowTheOppositeWall) {
  const Scene room = make_room();
  EXPECT_GT(find(render(room, small(View::kFront)), Hue::kBlue).count, 10000);
  EXPECT_GT(find(render(room, small(View::kBack)), Hue::kYellow).count, 10000);
  EXPECT_GT(find(render(room, small(View::kLeft)), Hue::kGreen).count, 10000);
  EXPECT_GT(find(render(room, small(View::kRight)), Hue::kRed).count, 10000);
  EXPECT_GT(find(render(room, small(View::kBottom)), Hue::kMagenta).count, 10000);
}

TEST_F(Snapshots, IsoOpensTheRoomTowardsTheViewer) {
  const cv::Mat picture = render(make_room(), small(View::kIso));
  EXPECT_GT(find(picture, Hue::kGrey).count, 2000);
  EXPECT_GT(find(picture, Hue::kBlue).count, 2000);
  EXPECT_GT(find(picture, Hue::kRed).count, 2000);
  EXPECT_EQ(find(picture, Hue::kMagenta).count, 0);
  EXPECT_GT(find(picture, Hue::kBackground).count, 400 * 300 / 5);
}

TEST_F(Snapshots, ExplicitViewpointLooksWhereItIsTold) {
  SnapshotOptions options = small(View::kExplicit);
  options.viewpoint.eye = {0.0, 0.0, 0.0};
  options.viewpoint.target = {-1.0, 0.0, 0.0};
  const cv::Mat picture = render(make_room(), options);
  EXPECT_GT(find(picture, Hue::kRed).count, 400 * 300 / 2);
}

TEST_F(Snapshots, SurfacesCloseWithoutHolesAtAnySize) {
  for (const int width : {200, 1000}) {
    SnapshotOptions options = small(View::kTop);
    options.width_px = width;
    options.height_px = width * 3 / 4;
    options.shading = false;
    Scene room = make_room();
    room.paths.front().trajectory.resize(1);
    const cv::Mat picture = render(room, options);
    const cv::Mat floor = picture(cv::Rect(width / 5, width / 8, width / 6, width / 6));
    EXPECT_GT(find(floor, Hue::kGrey).count, 0.99 * floor.rows * floor.cols) << width;
  }
}

TEST_F(Snapshots, SameSceneSameBytes) {
  SnapshotOptions options = small(View::kIso);
  options.annotations = true;
  const Scene room = make_room();
  render(room, options, "a.png");
  render(room, options, "b.png");
  EXPECT_GT(bytes("a.png").size(), 2000U);
  EXPECT_EQ(bytes("a.png"), bytes("b.png"));
}

TEST_F(Snapshots, EmptySceneSaysSo) {
  SnapshotOptions options = small(View::kIso);
  options.annotations = true;
  Scene nothing;
  const cv::Mat without_cloud = render(nothing, options);
  nothing.cloud = std::make_shared<Cloud>();
  const cv::Mat picture = render(nothing, options);
  EXPECT_EQ(cv::norm(without_cloud, picture, cv::NORM_INF), 0.0);
  const int background = find(picture, Hue::kBackground).count;
  EXPECT_GT(background, 400 * 300 * 9 / 10);
  EXPECT_LT(background, 400 * 300);  // the words
}

TEST_F(Snapshots, NonFinitePointsAndPosesAreLeftOut) {
  Scene room = make_room();
  auto cloud = std::make_shared<Cloud>(*room.cloud);
  for (int i = 0; i < 500; ++i) {
    pcl::PointXYZRGBNormal bad = cloud->points[static_cast<std::size_t>(i)];
    if (i % 2 == 0) bad.x = kNan;
    if (i % 2 == 1) bad.z = std::numeric_limits<float>::infinity();
    cloud->push_back(bad);
  }
  const cv::Mat clean = render(room, small(View::kTop));
  room.cloud = cloud;
  geometry::StampedPose lost;
  lost.stamp = 9.0;
  lost.world_from_camera.translation.setConstant(std::nan(""));
  room.paths.front().trajectory.push_back(lost);
  room.segments.push_back({{0, 0, 0}, {std::nan(""), 0, 0}});
  const cv::Mat picture = render(room, small(View::kTop));
  EXPECT_LT(cv::norm(clean, picture, cv::NORM_L1) / (400.0 * 300.0 * 3.0), 1.0);
}

TEST_F(Snapshots, OnePointAndAllNanAreFine) {
  Scene scene;
  auto one = std::make_shared<Cloud>();
  one->push_back(point({0.3, 0.2, 1.0}, {0, 0, -1}, {220, 30, 30}));
  scene.cloud = one;
  const Found dot = find(render(scene, small(View::kIso)), Hue::kRed);
  EXPECT_GT(dot.count, 0);
  EXPECT_NEAR(dot.x, 0.5, 0.02);
  EXPECT_NEAR(dot.y, 0.5, 0.02);
  auto nan = std::make_shared<Cloud>();
  nan->push_back(point({std::nan(""), 0, 0}, {0, 0, -1}, {0, 0, 0}));
  scene.cloud = nan;
  EXPECT_GT(find(render(scene, small(View::kTop)), Hue::kBackground).count, 400 * 300 * 9 / 10);
}

TEST_F(Snapshots, FarOutliersDoNotShrinkTheRoom) {
  Scene room = make_room();
  auto cloud = std::make_shared<Cloud>(*room.cloud);
  for (int i = 0; i < 40; ++i) cloud->push_back(point({50.0 + i, 3.0, 80.0}, {0, -1, 0}, {0, 0, 0}));
  room.cloud = cloud;
  EXPECT_GT(find(render(room, small(View::kTop)), Hue::kGrey).count, 400 * 300 / 3);
}

TEST_F(Snapshots, ColorModesShowTheirValues) {
  Scene room = make_room();
  for (const auto& p : *room.cloud) room.scalars.push_back(p.x < 0.0F ? 0.0F : 1.0F);
  room.paths.clear();
  SnapshotOptions options = small(View::kTop);
  options.shading = false;
  options.color = ColorMode::kRobot;
  cv::Mat picture = render(room, options);
  const auto at = [&picture](int u, int v) {
    const auto bgr = picture.at<cv::Vec3b>(v, u);
    return Rgb{bgr[2], bgr[1], bgr[0]};
  };
  EXPECT_EQ(at(120, 150), category_color(0));
  EXPECT_EQ(at(280, 150), category_color(1));
  options.color = ColorMode::kError;
  options.scalar_range = {{0.0, 1.0}};
  picture = render(room, options);
  EXPECT_EQ(at(120, 150), sequential_color(0.0));
  EXPECT_EQ(at(280, 150), sequential_color(1.0));
  options.scalar_range.reset();
  options.color = ColorMode::kHeight;
  picture = render(room, options);
  EXPECT_EQ(at(120, 150), sequential_color(0.0));
  options.color = ColorMode::kNormal;
  picture = render(room, options);
  EXPECT_GT(at(120, 150).b, 200);  // the floor's normal is up
}

TEST_F(Snapshots, SegmentsLieOverTheirSurface) {
  Scene room = make_room();
  room.segments.push_back({{-1.5, 1.2, 1.0}, {1.5, 1.2, 1.0}});
  room.segment_color = {255, 0, 255};
  const Found line = find(render(room, small(View::kTop)), Hue::kMagenta);
  EXPECT_GT(line.count, 150);
  EXPECT_NEAR(line.x, 0.5, 0.02);
}

TEST_F(Snapshots, UpIsFoundFromTheFloor) {
  const double tilt = 0.6;
  const Scene room = make_room(tilt);
  const Eigen::Vector3d up = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()) * Eigen::Vector3d(0, -1, 0);
  EXPECT_LT((estimate_up(room) - up).norm(), 0.02);
  Scene without_normals = room;
  auto cloud = std::make_shared<Cloud>(*room.cloud);
  for (auto& p : *cloud) p.normal_x = p.normal_y = p.normal_z = 0.0F;
  without_normals.cloud = cloud;
  EXPECT_LT((estimate_up(without_normals) - up).norm(), 1e-6);  // the cameras' own up
  EXPECT_EQ(estimate_up(Scene{}), Eigen::Vector3d(0, -1, 0));
}

TEST_F(Snapshots, WrongRequestsAreUsageErrors) {
  const Scene room = make_room();
  const auto kind = [&](const SnapshotOptions& options) {
    const auto done = render_snapshot(room, options, folder_ / "a.png");
    EXPECT_FALSE(done.has_value());
    return done ? core::ErrorKind::kInternal : done.error().kind;
  };
  SnapshotOptions options = small(View::kTop);
  options.width_px = 0;
  EXPECT_EQ(kind(options), core::ErrorKind::kUsage);
  options = small(View::kTop);
  options.color = ColorMode::kError;  // no scalars
  EXPECT_EQ(kind(options), core::ErrorKind::kUsage);
  options = small(View::kExplicit);
  options.viewpoint.target = options.viewpoint.eye;
  EXPECT_EQ(kind(options), core::ErrorKind::kUsage);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.png"));
}

TEST_F(Snapshots, SeveralAreTheSameAsOneByOne) {
  const Scene room = make_room();
  std::vector<Snapshot> wanted;
  for (const View view : {View::kIso, View::kTop, View::kFront}) {
    wanted.push_back({small(view), folder_ / (view_name(view) + ".png")});
    wanted.back().options.annotations = true;
  }
  wanted.back().options.width_px = 500;  // another window
  for (const int threads : {1, 2}) {
    ASSERT_TRUE(render_snapshots(room, wanted, core::Executor(threads)));
    for (const Snapshot& one : wanted) {
      render(room, one.options);
      EXPECT_EQ(bytes(one.file.filename().string()), bytes("a.png")) << one.file;
    }
  }
}

TEST_F(Snapshots, UnwritablePathIsAnOutputErrorThatNamesTheFile) {
  const auto file = folder_ / "missing" / "a.png";
  const auto done = render_snapshot(make_room(), small(View::kTop), file);
  ASSERT_FALSE(done.has_value());
  EXPECT_EQ(done.error().kind, core::ErrorKind::kOutput);
  EXPECT_NE(done.error().message.find(file.string()), std::string::npos);
}

TEST(SnapshotOptions, EveryChoiceHasItsName) {
  SnapshotOptions options;
  core::OptionTable table;
  options.declare(table);
  for (const auto& spec : table.specs()) {
    if (spec.key == "view") {
      EXPECT_EQ(spec.choices.size(), 8U);
    } else if (spec.key == "color") {
      EXPECT_EQ(spec.choices.size(), 7U);
    }
  }
  EXPECT_EQ(table.value("view"), "iso");
  EXPECT_EQ(view_name(View::kTop), "top");
  EXPECT_EQ(color_mode_name(ColorMode::kConfidence), "confidence");
}

}  // namespace
}  // namespace plumbline::viz
