// SPDX-License-Identifier: BSD-3-Clause
// Clouds outside of result folders say what is up in them, and are drawn so.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

class Frames : public ProgramTest {
 protected:
  /// A red pole, 2 m along z, with normals all round.
  void write_pole(const std::string& name, const std::vector<std::string>& comments) const {
    cloud::Cloud pole;
    for (int i = 0; i < 400; ++i) {
      for (int k = 0; k < 24; ++k) {
        const double angle = 2.0 * M_PI * k / 24.0;
        const Eigen::Vector3f normal(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)),
                                     0.0F);
        cloud::Point p;
        p.getVector3fMap() = 0.05F * normal + Eigen::Vector3f(0.0F, 0.0F, 0.005F * static_cast<float>(i));
        p.getNormalVector3fMap() = normal;
        p.r = 220;
        p.g = p.b = 20;
        pole.push_back(p);
      }
    }
    ASSERT_TRUE(cloud::write_cloud(path(name), pole, {}, Eigen::Vector3d::Zero(), comments));
  }
  /// Height over width of what is red in the picture of a cloud.
  [[nodiscard]] double slender(const std::string& input, const std::string& view = "front") const {
    const Outcome o = run("render " + input + " -o pole.png --size 400x400 --annotations off --view " + view);
    EXPECT_EQ(o.code, 0) << o;
    const cv::Mat picture = cv::imread(path("pole.png").string());
    cv::Mat red;
    cv::inRange(picture, cv::Scalar(0, 0, 90), cv::Scalar(90, 90, 255), red);
    const cv::Rect box = cv::boundingRect(red);
    return static_cast<double>(box.height) / std::max(1, box.width);
  }
  [[nodiscard]] std::string header(const std::string& file) const {
    const std::string bytes = slurp(path(file));
    return bytes.substr(0, std::min(bytes.find("end_header"), bytes.find("DATA ")));
  }
};

const std::vector<std::string> kUpright = cloud::frame_with(cloud::Up::kZ).comments();

TEST_F(Frames, AreReadFromHeadersAndPassedOn) {
  write("chain.yaml", "chain: half\nfilters:\n  - {type: pass_through, field: z, min: 0, max: 1.5}\n");
  write_pole("foreign.ply", {});
  EXPECT_NEAR(slender("foreign.ply"), 1.0, 0.3)
      << "what says nothing has y down: the pole is seen from its end";

  for (const char* name : {"pole.ply", "pole.pcd"}) {
    write_pole(name, kUpright);
    EXPECT_GT(slender(name), 10.0) << name;
    ASSERT_EQ(run(std::string("filter chain.yaml ") + name + " half.ply -q").code, 0) << name;
    EXPECT_GT(slender("half.ply"), 8.0) << name;
    ASSERT_EQ(run(std::string("export ") + name + " -o half.pcd --z 0,1.5 -q").code, 0) << name;
    EXPECT_GT(slender("half.pcd"), 8.0) << name;
  }

  ASSERT_EQ(run("export foreign.ply -o again.ply -q").code, 0);
  EXPECT_EQ(header("again.ply").find("frame:"), std::string::npos) << "nothing is made up";
  write_pole("camera.ply", cloud::frame_with(cloud::Up::kMinusY).comments());
  const Outcome grid = run("export camera.ply -o plan.svg");
  EXPECT_EQ(grid.code, 3) << grid;
  EXPECT_TRUE(grid.told("not upright")) << grid;
  EXPECT_EQ(run("filter chain.yaml pole.ply camera.ply both.ply").code, 3) << "another direction is up";
}

TEST_F(Frames, MeasuredErrorsLieAsTheReferenceDoes) {
  write_pole("pole.ply", kUpright);
  write_pole("foreign.ply", {});
  ASSERT_EQ(run("evaluate cloud pole.ply pole.ply --align se3 -o same").code, 0);
  EXPECT_NE(header("same/accuracy.ply").find("z up"), std::string::npos);
  EXPECT_NE(header("same/completeness.ply").find("z up"), std::string::npos);

  ASSERT_EQ(run("evaluate cloud pole.ply foreign.ply --align se3 -o other").code, 0);
  EXPECT_EQ(header("other/accuracy.ply").find("z up"), std::string::npos) << "the reference says nothing";
}

TEST_F(Frames, MapsKeepTheirBytesAndTheirFilesElsewhereStateIt) {
  write_wall(path("wall"));
  const Outcome mapped =
      run("map wall -o out -q --set fuse.voxel=3cm --set output.views= --set output.pcd=on");
  ASSERT_EQ(mapped.code, 0) << mapped;
  for (const char* file : {"out/map.ply", "out/map.pcd", "out/lines.ply"})
    EXPECT_EQ(header(file).find("frame:"), std::string::npos) << file;

  write("chain.yaml", "chain: all\nfilters:\n  - {type: voxel_grid, leaf: 5 cm}\n");
  ASSERT_EQ(run("filter chain.yaml out/map.ply filtered.ply -q").code, 0);
  ASSERT_EQ(run("export out -o cloud.ply -q").code, 0);
  ASSERT_EQ(run("export out -o cloud.pcd -q").code, 0);
  ASSERT_EQ(run("export out --lines -o lines.ply -q").code, 0);
  ASSERT_EQ(run("export out --keyframes keyframes -q").code, 0);
  ASSERT_EQ(run("evaluate cloud out out/map.ply -o errors").code, 0);

  for (const char* file : {"filtered.ply", "cloud.ply", "cloud.pcd", "lines.ply", "keyframes/000000.ply",
                           "errors/accuracy.ply", "errors/completeness.ply"}) {
    const std::string head = header(file);
    EXPECT_NE(head.find("frame: "), std::string::npos) << file << "\n" << head;
    EXPECT_NE(head.find("z up"), std::string::npos) << file << "\n" << head;
  }

  ASSERT_EQ(run("map wall -o camera -q --set fuse.voxel=3cm --set fuse.up=none --set output.views=").code, 0);
  ASSERT_EQ(run("export camera -o camera.ply -q").code, 0);
  EXPECT_NE(header("camera.ply").find("y down"), std::string::npos);
}

}  // namespace
}  // namespace plumbline::integration
