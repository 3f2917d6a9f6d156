// SPDX-License-Identifier: BSD-3-Clause
// A map of a camera whose depth is 4 % short, brought to scale: plumbline adjust.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "program.hpp"
#include "true_frame.hpp"

namespace plumbline::integration {
namespace {

constexpr double kBound = 0.003;

class Adjust : public ProgramTest {
 protected:
  static constexpr const char* kLean =
      " -q --set output.views= --set output.pcd=off --set output.lines=off --set fuse.voxel=3cm";

  void SetUp() override {
    ASSERT_EQ(
        run("synth room -o world --frames 60 --fps 10 --width 320 --height 240 --reference-spacing 10cm -q")
            .code,
        0);
    std::string camera = slurp(path("world/robot0/camera.yaml"));
    const std::size_t at = camera.find("depth_scale: 5000");
    ASSERT_NE(at, std::string::npos);
    write("world/robot0/camera.yaml", camera.replace(at, 17, "depth_scale: 5200"));
    const Outcome mapped = run("map world/robot0 -o m" + std::string(kLean));
    ASSERT_EQ(mapped.code, 0) << mapped;
    world_from_map_ = truth_of("m");
    choose();
  }

  [[nodiscard]] Eigen::Matrix4d truth_of(const std::string& result) const {
    return true_frame(path(result) / "trajectory.txt", path("world/robot0/groundtruth.txt"));
  }
  [[nodiscard]] double scale_off(const std::string& result) const {
    return std::abs(std::cbrt(truth_of(result).topLeftCorner<3, 3>().determinant()) - 1.0);
  }

  /// Eight places on surfaces, far from each other.
  void choose() {
    const auto cloud = cloud::read_cloud(path("m/map.ply"));
    ASSERT_TRUE(cloud.has_value());
    std::vector<Eigen::Vector3d> all;
    for (std::size_t i = 0; i < cloud->cloud->size(); i += 7)
      all.push_back((*cloud->cloud)[i].getVector3fMap().cast<double>());
    places_ = {all.front()};
    while (places_.size() < 8) {
      double most = 0.0;
      Eigen::Vector3d best = all.front();
      for (const Eigen::Vector3d& p : all) {
        double nearest = 1e9;
        for (const Eigen::Vector3d& q : places_) nearest = std::min(nearest, (p - q).norm());
        if (nearest > most) best = p;
        most = std::max(most, nearest);
      }
      places_.push_back(best);
    }
  }
  [[nodiscard]] Eigen::Vector3d truth(std::size_t i) const {
    return (world_from_map_ * places_[i].homogeneous()).head<3>();
  }
  [[nodiscard]] std::string text(std::size_t i) const {
    return fmt::format("{:.4f},{:.4f},{:.4f}", places_[i].x(), places_[i].y(), places_[i].z());
  }
  [[nodiscard]] std::string length(std::size_t i, std::size_t j, double wrong_m = 0.0) const {
    return fmt::format(" --length {} {} {:.4f}m", text(i), text(j), (truth(i) - truth(j)).norm() + wrong_m);
  }
  [[nodiscard]] Outcome adjust(const std::string& arguments) const {
    return run("adjust m --force --set output.views= --set output.pcd=off " + arguments);
  }

  Eigen::Matrix4d world_from_map_ = Eigen::Matrix4d::Identity();
  std::vector<Eigen::Vector3d> places_;
};

TEST_F(Adjust, LengthsBringScaleAndTheResultIsAMap) {
  ASSERT_GT(scale_off("m"), 0.03);
  const Outcome one = adjust("-o one" + length(0, 1));
  ASSERT_EQ(one.code, 0) << one;
  EXPECT_TRUE(one.told("cannot be checked")) << one;
  EXPECT_LT(scale_off("one"), kBound);

  const Outcome blunder = adjust("-o four" + length(0, 1, 0.2) + length(2, 3) + length(4, 5) + length(1, 6));
  ASSERT_EQ(blunder.code, 0) << blunder;
  EXPECT_TRUE(blunder.told("BLUNDER, off by 2")) << blunder;
  EXPECT_LT(scale_off("four"), kBound);
  const auto summary = read_json(path("four/adjust.json"));
  EXPECT_TRUE(summary["observations"][0]["left_out"]);
  EXPECT_FALSE(summary["observations"][1]["left_out"]);

  // Of two that contradict each other none is believed.
  const Outcome two = adjust("-o two" + length(0, 1, 0.2) + length(2, 3));
  EXPECT_EQ(two.code, 4) << two;
  EXPECT_TRUE(two.told("contradict each other")) << two;
  EXPECT_FALSE(fs::exists(path("two")));

  // The result is a map like any other, its camera has the scale, and mixing it is not done without a word.
  EXPECT_EQ(run("info four").code, 0);
  EXPECT_EQ(run("export four -o four.xyz").code, 0);
  const std::string camera = slurp(path("four/camera.yaml"));
  EXPECT_NE(camera.find("sigma: {depth_scale: "), std::string::npos) << camera;
  const Outcome again = run("map world/robot0 -o again --camera four/camera.yaml" + std::string(kLean));
  ASSERT_EQ(again.code, 0) << again;
  EXPECT_LT(scale_off("again"), kBound);
  const Outcome mixed = run("fuse m four -o mixed" + std::string(kLean));
  EXPECT_TRUE(mixed.told("are of different scale")) << mixed;
}

TEST_F(Adjust, PointsBringScaleAndPlaceAndTheGridIsToldApart) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const auto table = [&](std::size_t blunder) {
    std::string rows = "name,x,y,z,E,N,H\n";
    for (std::size_t i = 0; i < places_.size(); ++i) {
      Eigen::Vector3d w = turn * truth(i);
      w.head<2>() *= 0.9996;  // of UTM on its central meridian
      w += Eigen::Vector3d(500000.0 + (i == blunder ? 0.2 : 0.0), 5330000.0, 510.0);
      rows += fmt::format("P{},{},{:.4f},{:.4f},{:.4f}\n", i, text(i), w.x(), w.y(), w.z());
    }
    write("control.csv", rows);
  };

  table(3);
  const Outcome o = adjust("-o placed --points control.csv --epsg 25832");
  ASSERT_EQ(o.code, 0) << o;
  EXPECT_TRUE(o.told("point P3: BLUNDER, off by ")) << o;
  EXPECT_FALSE(o.told("P2: BLUNDER")) << o;
  EXPECT_LT(scale_off("placed"), kBound);
  const auto place = read_json(path("placed/georeference.json"));
  EXPECT_NEAR(place["scale"].get<double>(), 0.9996, 2e-6);

  const Outcome written = run("export placed -o placed.ply " + place["export"].get<std::string>());
  ASSERT_EQ(written.code, 0) << written;
  const auto cloud = cloud::read_cloud(path("placed.ply"), cloud::LargeCoordinates::kShifted);
  ASSERT_TRUE(cloud.has_value());
  EXPECT_NEAR(cloud->shift.y(), 5330000.0, 20.0);
}

TEST_F(Adjust, RefusesWhatSaysNothing) {
  EXPECT_EQ(adjust("-o none").code, 2);
  const Outcome air = adjust("-o none --length 0,0,30 0,1,30 1m");
  EXPECT_EQ(air.code, 2) << air;
  EXPECT_TRUE(air.told("no keyframe saw a surface")) << air;
  EXPECT_EQ(adjust("-o none --length 0,0,1 0,1,1 long").code, 2);
  EXPECT_EQ(adjust("-o none --points nowhere.csv").code, 3);

  // The map keeps no whole pictures.
  write("tags.yaml", "family: 36h11\n");
  const Outcome blind = adjust("-o none --tags tags.yaml");
  EXPECT_EQ(blind.code, 3) << blind;
  EXPECT_TRUE(blind.told("map again with --set store.images=whole")) << blind;
  EXPECT_EQ(run("adjust world -o none --datum 48,11,0").code, 3);
}

}  // namespace
}  // namespace plumbline::integration
