// SPDX-License-Identifier: BSD-3-Clause
// What is up in a cloud, as headers of files say it.
#include <pcl/io/pcd_io.h>

#include "test_cloud_filter_run.hpp"

namespace plumbline::cloud {
namespace {

using worlds::list;
using worlds::must;
using worlds::point;
using worlds::slurp;
using worlds::temporary;

TEST(CloudFrame, WordsOfTheCommentTellWhatIsUp) {
  const CloudFrame north =
      frame_in({"made by hand", "frame: ETRS89 / UTM 32N; x east, y north, z up", "frame: y down"});
  EXPECT_EQ(north.text, "ETRS89 / UTM 32N; x east, y north, z up");
  EXPECT_EQ(north.up(), Up::kZ);
  EXPECT_EQ(north.comments(), std::vector<std::string>{"frame: ETRS89 / UTM 32N; x east, y north, z up"});

  EXPECT_EQ(frame_in({"frame: that of its first camera (z ahead, y down)"}).up(), Up::kMinusY);
  EXPECT_EQ(frame_in({"frame: somewhere"}).up(), Up::kUnknown);
  EXPECT_TRUE(frame_in({"frame: somewhere"}).known());
  for (const char* nothing : {"", "frame:", "frame:   ", "z up", "a frame: z up"}) {
    EXPECT_FALSE(frame_in({nothing}).known()) << nothing;
    EXPECT_TRUE(frame_in({nothing}).comments().empty()) << nothing;
  }
  EXPECT_TRUE(frame_with(Up::kUnknown).comments().empty());
}

TEST(CloudFrame, TextThatIsNotPlainIsNotPassedOn) {
  for (const std::string& odd :
       {std::string("frame: \x1b[31mred, z up"), "frame: z up " + std::string(300, 'x')}) {
    const CloudFrame frame = frame_in({odd});
    EXPECT_EQ(frame.up(), Up::kZ);
    EXPECT_EQ(frame.text, frame_with(Up::kZ).text);
  }
  EXPECT_EQ(frame_in({"frame: z up\r"}).text, "z up");
}

TEST(CloudFrame, FilesKeepItAndAreTheSameWithoutIt) {
  const Cloud cloud = *list({point(1, 2, 3), point(4, 5, 6)});
  for (const std::string ending : {".ply", ".pcd"}) {
    const std::string file = temporary("frame" + ending);
    for (const Up up : {Up::kZ, Up::kMinusY}) {
      ASSERT_TRUE(write_cloud(file, cloud, {}, Eigen::Vector3d::Zero(), frame_with(up).comments()));
      const auto read = read_cloud(file);
      ASSERT_TRUE(read) << ending;
      EXPECT_EQ(read->frame.up(), up) << ending;
      EXPECT_EQ(read->cloud->size(), 2U) << ending;
    }

    ASSERT_TRUE(write_cloud(file, cloud));
    EXPECT_EQ(slurp(file).find("frame"), std::string::npos) << ending;
    EXPECT_FALSE(read_cloud(file)->frame.known()) << ending;
  }
}

TEST(CloudFrame, PclReadsAPcdThatStatesIt) {
  const std::string file = temporary("frame_pcl.pcd");
  const Cloud cloud = *list({point(1, 2, 3), point(4, 5, 6)});
  ASSERT_TRUE(write_pcd(file, cloud, {}, Eigen::Vector3d::Zero(), frame_with(Up::kZ).comments()));
  EXPECT_EQ(slurp(file).rfind("# .PCD v0.7 - Point Cloud Data file format\n# frame: ", 0), 0U);
  Cloud again;
  ASSERT_EQ(pcl::io::loadPCDFile(file, again), 0);
  ASSERT_EQ(again.size(), 2U);
  EXPECT_EQ(again[1].getVector3fMap(), Eigen::Vector3f(4, 5, 6));
}

TEST(CloudFrame, FiltersPassItOnAndTransformTurnsIt) {
  const CloudPtr cloud = list({point(0, 0, 0), point(1, 1, 1)});
  const auto after = [&](const std::string& entry, CloudFrame frame) {
    FilterContext context;
    context.frame = &frame;
    must(entry, cloud, context);
    return frame;
  };

  const CloudFrame world{"EPSG:25832; x east, y north, z up"};
  EXPECT_EQ(after("{type: voxel_grid, leaf: 10 cm}", world).text, world.text);
  EXPECT_EQ(after("{type: transform, rotation: [0 deg, 0 deg, 30 deg]}", world).text,
            frame_with(Up::kZ).text);
  EXPECT_EQ(after("{type: transform, rotation: [-90 deg, 0 deg, 0 deg]}", frame_with(Up::kMinusY)).up(),
            Up::kZ);
  EXPECT_EQ(after("{type: transform, rotation: [90 deg, 0 deg, 0 deg]}", world).up(), Up::kMinusY);
  EXPECT_FALSE(after("{type: transform, rotation: [10 deg, 0 deg, 0 deg]}", world).known());
  EXPECT_FALSE(after("{type: transform, rotation: [0 deg, 0 deg, 30 deg]}", {}).known());
}

TEST(CloudFrame, CloudsWithAnotherUpAreNotMerged) {
  const std::string other = temporary("frame_other.ply");
  const CloudPtr cloud = list({point(0, 0, 0)});
  ASSERT_TRUE(write_cloud(other, *cloud, {}, Eigen::Vector3d::Zero(), frame_with(Up::kMinusY).comments()));
  CloudFrame frame = frame_with(Up::kZ);
  FilterContext context;
  context.frame = &frame;
  const auto merged = worlds::run("{type: merge, file: " + other + "}", cloud, context);
  ASSERT_FALSE(merged);
  EXPECT_NE(merged.error().message.find("has z up"), std::string::npos) << merged.error().message;
  EXPECT_NE(merged.error().message.find(other + " has y down"), std::string::npos) << merged.error().message;

  frame = {};
  EXPECT_TRUE(worlds::run("{type: merge, file: " + other + "}", cloud, context));
}

}  // namespace
}  // namespace plumbline::cloud
