// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cstdlib>
#include <set>

#include "plumbline/dataset/summary.hpp"
#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

using Tum = RecordingTest;

TEST_F(Tum, ReadsPairs) {
  write_tum(6);
  write_text("groundtruth.txt", "100.0 1 2 3 0 0 0 1\n100.5 1 2 4 0 0 0 1\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->format(), "tum");
  EXPECT_EQ((*source)->name(), folder_.filename().string());
  ASSERT_EQ((*source)->size(), 6U);
  EXPECT_EQ(log_.warnings, "");
  EXPECT_NEAR((*source)->info(3).stamp, 100.3, 1e-9);
  EXPECT_NEAR((*source)->info(3).depth_stamp, 100.302, 1e-9);
  const auto frame = (*source)->read(3);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->index, 3);
  EXPECT_NEAR(frame->stamp, 100.3, 1e-9);
  EXPECT_EQ(cv::norm(frame->color, color_image(3), cv::NORM_INF), 0.0);
  EXPECT_EQ(frame->gray.type(), CV_8UC1);
  EXPECT_EQ(frame->gray.size(), frame->color.size());
  EXPECT_EQ(frame->depth.at<float>(20, 20), 2.0F);
  ASSERT_TRUE((*source)->truth());
  EXPECT_EQ((*source)->truth()->size(), 2U);
}

TEST_F(Tum, CarriageReturnsCommentsBlanksAndDisorder) {
  write_tum(4);
  write_text("rgb.txt", "\xEF\xBB\xBF# colour\r\n\r\n" + stamp(2, 0) + "\trgb/2.png\r\n   # more\r\n" +
                            stamp(0, 0) + "  rgb/0.png\r\n" + stamp(1, 0) + " rgb/1.png\r\n" + stamp(1, 0) +
                            " rgb/3.png\r\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_THAT((*source)->stored(i)->color.name, HasSubstr("rgb/" + std::to_string(i) + ".png"));
    EXPECT_TRUE((*source)->read(i));
  }
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("not in order"), HasSubstr("repeat a stamp")));
}

TEST_F(Tum, PairsByNearestStampOnceEach) {
  write_tum(4);
  // colour 0 and 1 both lie near depth 0; colour 1 is nearer. Colour 2 is 21 ms from its depth.
  write_text("rgb.txt", "100.000 rgb/0.png\n100.012 rgb/1.png\n100.221 rgb/2.png\n100.319 rgb/3.png\n");
  write_text("depth.txt", "100.010 depth/0.png\n100.200 depth/1.png\n100.300 depth/2.png\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->size(), 2U);
  EXPECT_EQ((*source)->info(0).stamp, 100.012);
  EXPECT_EQ((*source)->info(0).depth_stamp, 100.010);
  EXPECT_EQ((*source)->info(1).stamp, 100.319);
  OpenOptions wide;
  wide.max_pair_gap_s = 0.03;
  EXPECT_EQ((*open(wide))->size(), 3U);
}

TEST_F(Tum, PairsByWhenDepthWasTaken) {
  write_tum(3);
  write_text("rgb.txt", "100.000 rgb/0.png\n100.033 rgb/1.png\n100.066 rgb/2.png\n");
  write_text("depth.txt", "100.001 depth/0.png\n100.034 depth/1.png\n100.067 depth/2.png\n");
  write_camera("depth_scale: 5000\ndepth_delay: 0.03\n");
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->size(), 2U);
  EXPECT_THAT((*source)->stored(0)->color.name, HasSubstr("rgb/1.png"));
  EXPECT_THAT((*source)->stored(0)->depth.name, HasSubstr("depth/0.png"));
  EXPECT_NEAR((*source)->info(0).depth_stamp, 100.031, 1e-9);
  EXPECT_NEAR((*source)->read(0)->depth_stamp, 100.031, 1e-9);
  // Listed pairs stay what they are.
  write_text("associations.txt", "100.000 rgb/0.png 100.001 depth/0.png\n");
  EXPECT_NEAR((*open())->info(0).depth_stamp, 100.031, 1e-9);
}

TEST_F(Tum, AssociationsInEitherOrder) {
  write_tum(3);
  write_text("associations.txt",
             "100.0 depth/0.png 100.001 rgb/0.png\n100.1 depth/1.png 100.101 rgb/1.png\n");
  auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->size(), 2U);
  EXPECT_EQ((*source)->info(0).stamp, 100.001);
  EXPECT_THAT((*source)->stored(0)->color.name, HasSubstr("rgb/0.png"));
  // colour first, an image named twice, stamps in disorder
  write_text("associations.txt",
             "100.1 rgb/1.png 100.1 depth/1.png\r\n100.0 rgb/0.png 100.0 depth/0.png\n"
             "100.2 rgb/0.png 100.2 depth/2.png\n");
  source = open();
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->size(), 2U);
  EXPECT_THAT((*source)->stored(0)->color.name, HasSubstr("rgb/0.png"));
  EXPECT_TRUE((*source)->read(1));
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("second time"), HasSubstr("not in order")));
}

TEST_F(Tum, BadLinesNameFileAndLine) {
  write_tum(2);
  write_text("rgb.txt", "# x\n100.0 rgb/0.png\nsoon rgb/1.png\n");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("rgb.txt:3"), HasSubstr("'soon'")));
  write_text("rgb.txt", "nan rgb/0.png\n");
  EXPECT_THAT(open_error(), HasSubstr("rgb.txt:1"));
  write_text("rgb.txt", "100.0\n");
  EXPECT_THAT(open_error(), HasSubstr("rgb.txt:1"));
  write_text("rgb.txt", "# nothing\n");
  EXPECT_THAT(open_error(), HasSubstr("names no image"));
  write_text("associations.txt", "100.0 rgb/0.png 100.0\n");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("associations.txt:1"), HasSubstr("3 words")));
}

TEST_F(Tum, AllFilesMissing) {
  write_tum(3);
  std::filesystem::remove_all(folder_ / "rgb");
  const auto source = open();
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().kind, core::ErrorKind::kInput);
  EXPECT_THAT(source.error().message,
              AllOf(HasSubstr("rgb.txt:2"), HasSubstr("rgb/0.png"), HasSubstr("3 files")));
}

TEST_F(Tum, FramesWithoutFilesAreLeftOutAndCounted) {
  write_tum(20);
  for (int i = 0; i < 20; ++i) {
    if (i % 5 == 0) std::filesystem::remove(folder_ / ("rgb/" + std::to_string(i) + ".png"));
    if (i > 15) std::filesystem::remove(folder_ / ("depth/" + std::to_string(i) + ".png"));
  }
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->size(), 12U);
  EXPECT_EQ((*source)->missing(), 8U);
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("8 of 20 frames are missing"), HasSubstr("rgb/0.png")));
  EXPECT_THAT((*source)->stored(4)->color.name, HasSubstr("rgb/6.png"));
  for (std::size_t i = 0; i < 12; ++i) {
    const auto frame = (*source)->read(i);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->index, static_cast<std::int64_t>(i));
  }
  EXPECT_THAT(to_text(**source), AllOf(HasSubstr("missing: 8 pairs"), HasSubstr("pairs: 12\n")));
}

TEST_F(Tum, APartIsOneOfAllListedFrames) {
  write_tum(10);
  for (const int i : {0, 4, 5}) std::filesystem::remove(folder_ / ("rgb/" + std::to_string(i) + ".png"));
  OpenOptions options;
  options.from_s = 0.15;
  options.every = 2;
  const auto source = open(options);
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->size(), 3U);  // of 0.2, 0.4, 0.6 and 0.8 s after the first that is listed
  EXPECT_THAT((*source)->stored(0)->color.name, HasSubstr("rgb/2.png"));
  EXPECT_THAT((*source)->stored(1)->color.name, HasSubstr("rgb/6.png"));
  EXPECT_EQ((*source)->missing(), 1U);
  options.to_s = 0.15;
  options.from_s = 0.0;
  options.every = 5;
  EXPECT_THAT(open_error(options), HasSubstr("the files of all 1 frames"));
}

TEST_F(Tum, NoFrameHasBothItsFiles) {
  write_tum(4);
  for (const int i : {0, 1}) std::filesystem::remove(folder_ / ("rgb/" + std::to_string(i) + ".png"));
  for (const int i : {2, 3}) std::filesystem::remove(folder_ / ("depth/" + std::to_string(i) + ".png"));
  EXPECT_THAT(open_error(), AllOf(HasSubstr("none of its 4 frames"), HasSubstr("rgb/0.png")));
}

TEST_F(Tum, NothingInCommonInTime) {
  write_tum(3);
  write_text("depth.txt", "500.0 depth/0.png\n500.1 depth/1.png\n");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("in common in time"), HasSubstr("399.800 s apart"),
                                  HasSubstr("100.000 to 100.200"), HasSubstr("500.000 to 500.100")));
}

TEST_F(Tum, OneListMissing) {
  write_tum(3);
  std::filesystem::remove(folder_ / "depth.txt");
  EXPECT_THAT(open_error(), HasSubstr("depth.txt is missing"));
}

TEST_F(Tum, BrokenTruthIsOnlyAWarning) {
  write_tum(3);
  write_text("groundtruth.txt", "100.0 1 2 3 0 0 0\n");
  const auto source = open();
  ASSERT_TRUE(source);
  EXPECT_FALSE((*source)->truth());
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("groundtruth.txt:1"), HasSubstr("without truth")));
}

TEST_F(Tum, FromToEvery) {
  write_tum(10);
  OpenOptions options;
  options.from_s = 0.15;
  options.to_s = 0.75;
  options.every = 2;
  const auto source = open(options);
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->size(), 3U);  // 0.2, 0.4, 0.6
  EXPECT_NEAR((*source)->info(2).stamp, 100.6, 1e-9);
  options.from_s = 50.0;
  options.to_s = 60.0;
  EXPECT_THAT(open_error(options), AllOf(HasSubstr("nothing lies between"), HasSubstr("0.90 s long")));
  options.to_s = OpenOptions().to_s;
  EXPECT_THAT(open_error(options),
              HasSubstr("nothing lies after 50 s (--from); the recording ends at 0.90 s"));
  options.every = 0;
  EXPECT_THAT(open_error(options), HasSubstr("every: 0"));
}

TEST_F(Tum, SummaryTellsWhatIsThere) {
  write_tum(5);
  cv::Mat holes = depth_image();
  holes.rowRange(0, 24).setTo(0);
  for (int i = 0; i < 5; ++i) write_image("depth/" + std::to_string(i) + ".png", holes);
  write_text("groundtruth.txt", "100.0 1 2 3 0 0 0 1\n");
  const auto source = open();
  ASSERT_TRUE(source);
  EXPECT_THAT(
      to_text(**source),
      AllOf(HasSubstr("pairs: 5"), HasSubstr("duration: 0.40 s, 10.0 pairs a second"), HasSubstr("64x48"),
            HasSubstr("depth: median 2.00 m, 50 %"), HasSubstr("5 frames sampled"), HasSubstr("truth: yes")));
}

TEST(Spread, IsEvenAndEndsAtTheEnds) {
  EXPECT_TRUE(spread(0, 5).empty());
  EXPECT_EQ(spread(1, 5), (std::vector<std::size_t>{0}));
  EXPECT_EQ(spread(3, 5), (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_EQ(spread(101, 5), (std::vector<std::size_t>{0, 25, 50, 75, 100}));
}

TEST(RealRecordings, OpenWithAllTheirPairs) {
  const char* data = std::getenv("PLUMBLINE_DATA");
  if (data == nullptr) GTEST_SKIP() << "PLUMBLINE_DATA names no folder of recordings";
  const std::vector<std::pair<std::string, std::size_t>> expected = {
      {"tum_fr3_structure_notexture_far_a", 125},
      {"tum_fr1_rpy_a", 60},
      {"7scenes_redkitchen_a", 400},
      {"icl_nuim_of_kt0_a", 50}};
  for (const auto& [name, pairs] : expected) {
    MemoryLog log;
    const auto source = open_recording(std::filesystem::path(data) / name, {}, log);
    ASSERT_TRUE(source) << source.error().message;
    EXPECT_EQ((*source)->size(), pairs) << name;
    EXPECT_EQ(log.warnings, "") << name;
    ASSERT_TRUE((*source)->truth()) << name;
    const auto frame = (*source)->read(pairs / 2);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_THAT(to_text(**source),
                AllOf(ContainsRegex("(2[7-9]|3[0-3])[.][0-9] pairs a second"), Not(HasSubstr("unreadable")),
                      HasSubstr(name == "tum_fr1_rpy_a" ? "undistorted" : "no distortion")));
  }
}

}  // namespace
}  // namespace plumbline::dataset
