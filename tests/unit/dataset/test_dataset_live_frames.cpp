// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <opencv2/core.hpp>
#include <thread>

#include "plumbline/dataset/live_frames.hpp"

namespace plumbline::dataset {
namespace {

sensor::Camera small_camera() {
  sensor::Camera camera;
  camera.name = "small";
  camera.color = {16, 12, 20.0, 20.0, 7.5, 5.5};
  camera.depth_scale = 1000.0;
  return camera;
}

LiveFrame frame_at(double stamp, int value) {
  LiveFrame frame;
  frame.stamp = stamp;
  frame.color = cv::Mat(12, 16, CV_8UC3, cv::Scalar(value, 2 * value, 3 * value));
  frame.depth = cv::Mat(12, 16, CV_16UC1, cv::Scalar(1000 + value));
  return frame;
}

std::string problem(LiveFrames& frames, const LiveFrame& frame) {
  const auto pushed = frames.push(frame);
  return pushed ? "" : pushed.error().message;
}

TEST(LiveFrames, AreReadAsTheyWerePushed) {
  LiveFrames frames(small_camera());
  LiveFrame first = frame_at(1.0, 10);
  first.depth_stamp = 1.01;
  ASSERT_TRUE(frames.push(first));
  first.color.setTo(0);  // it was copied
  ASSERT_TRUE(frames.push(frame_at(2.0, 20)));
  EXPECT_EQ(frames.recording()->size(), 2U);

  const auto read = frames.recording()->read(0);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->color.at<cv::Vec3b>(3, 4), cv::Vec3b(10, 20, 30));
  EXPECT_FLOAT_EQ(read->depth.at<float>(3, 4), 1.01F);
  EXPECT_DOUBLE_EQ(read->depth_stamp, 1.01);
  EXPECT_EQ(read->index, 0);
}

TEST(LiveFrames, MetresAndGreyAreTaken) {
  LiveFrames frames(small_camera());
  LiveFrame frame = frame_at(1.0, 0);
  frame.color = cv::Mat(12, 16, CV_8UC1, cv::Scalar(77));
  frame.depth = cv::Mat(12, 16, CV_32FC1, cv::Scalar(2.5));
  frame.depth.at<float>(0, 0) = std::numeric_limits<float>::quiet_NaN();
  ASSERT_EQ(problem(frames, frame), "");
  const auto read = frames.recording()->read(0);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->gray.at<std::uint8_t>(5, 5), 77);
  EXPECT_FLOAT_EQ(read->depth.at<float>(5, 5), 2.5F);
  EXPECT_FLOAT_EQ(read->depth.at<float>(0, 0), 0.0F);
}

TEST(LiveFrames, OthersAreRefusedByName) {
  LiveFrames frames(small_camera());
  ASSERT_EQ(problem(frames, frame_at(1.0, 1)), "");
  EXPECT_NE(problem(frames, frame_at(1.0, 1)).find("not after"), std::string::npos);
  EXPECT_NE(problem(frames, frame_at(std::nan(""), 1)).find("finite"), std::string::npos);

  LiveFrame frame = frame_at(2.0, 1);
  frame.color = cv::Mat(12, 17, CV_8UC3);
  EXPECT_NE(problem(frames, frame).find("colour is 17 x 12 pixels, the camera takes 16 x 12"),
            std::string::npos);
  frame = frame_at(2.0, 1);
  frame.color = cv::Mat(12, 16, CV_32FC3);
  EXPECT_NE(problem(frames, frame).find("colour has neither"), std::string::npos);
  frame = frame_at(2.0, 1);
  frame.depth = cv::Mat(12, 16, CV_8UC1);
  EXPECT_NE(problem(frames, frame).find("depth has neither"), std::string::npos);
  frame.depth = cv::Mat(12, 16, CV_32FC1, cv::Scalar(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_NE(problem(frames, frame).find("NaN in every pixel"), std::string::npos);

  frames.close();
  EXPECT_NE(problem(frames, frame_at(3.0, 1)).find("closed"), std::string::npos);
  EXPECT_EQ(frames.recording()->size(), 1U);
}

TEST(LiveFrames, KeptOnesCanBeReadAgainOthersNot) {
  for (const bool on_disk : {false, true}) {
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "live_frames";
    std::filesystem::create_directories(folder);
    LiveFrames frames(small_camera());
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(frames.push(frame_at(i, 10 * i)));
    EXPECT_EQ(frames.waiting(), 4U);
    const auto recording = frames.recording();
    if (on_disk) recording->keep_in(folder);
    for (const std::size_t kept : {1U, 3U}) recording->keep(kept);
    recording->keep(3);
    for (std::size_t done = 1; done < 4; ++done) recording->release(done);
    const LiveReport report = recording->report();
    EXPECT_EQ(report.kept, 2U);
    EXPECT_GT(report.kept_bytes, 40U);
    EXPECT_LT(report.kept_bytes, 2U * 5U * small_camera().color.width * small_camera().color.height);

    EXPECT_FALSE(frames.recording()->read(2));
    for (const std::size_t kept : {1U, 3U}) {
      const auto read = frames.recording()->read(kept);
      ASSERT_TRUE(read) << read.error().message;
      const int value = 10 * static_cast<int>(kept);
      EXPECT_EQ(read->color.at<cv::Vec3b>(2, 2)[2], 3 * value);
      EXPECT_FLOAT_EQ(read->depth.at<float>(2, 2), 1.0F + 0.001F * static_cast<float>(value));
    }
    EXPECT_EQ(frames.waiting(), 0U);
    EXPECT_TRUE(std::filesystem::is_empty(folder));  // the file has no name
  }
}

TEST(LiveFrames, AreReadAsTakenByABetterCamera) {
  LiveFrames frames(small_camera());
  ASSERT_TRUE(frames.push(frame_at(1.0, 10)));
  sensor::Camera better = small_camera();
  better.depth_scale = 500.0;
  better.depth_delay_s = 0.02;
  const auto view = frames.recording()->taken_by(better);
  frames.recording()->keep(0);
  frames.recording()->release(0);
  const auto read = view->read(0);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_FLOAT_EQ(read->depth.at<float>(1, 1), 2.02F);
  EXPECT_DOUBLE_EQ(read->depth_stamp, 1.02);
}

TEST(LiveFrames, WaitingFramesAreBoundedByBytes) {
  constexpr std::size_t kFrame = std::size_t{16} * 12 * 5;
  LiveFrames frames(small_camera(), {"fed", 3 * kFrame});
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(frames.wait_for_room(100, 0.0));
    ASSERT_EQ(problem(frames, frame_at(i, i)), "");
  }
  EXPECT_FALSE(frames.wait_for_room(100, 0.0));
  EXPECT_NE(problem(frames, frame_at(3, 3)).find("3 frames wait"), std::string::npos);

  const auto recording = frames.recording();
  EXPECT_TRUE(recording->decided(2)) << "a question";
  EXPECT_FALSE(frames.wait_for_room(100, 0.0)) << "frees nothing";
  recording->hand_out(0);
  EXPECT_TRUE(frames.wait_for_room(100, 0.0));
  EXPECT_EQ(problem(frames, frame_at(3, 3)), "");
  EXPECT_EQ(recording->size(), 4U);
}

TEST(LiveFrames, WaitingEndsWithAFrameWithTheEndOrWithAStop) {
  LiveFrames frames(small_camera());
  const auto recording = frames.recording();
  const core::StopToken stop;
  const auto wait = [&](std::size_t index) {
    while (!recording->decided(index)) recording->wait_for(index, std::chrono::milliseconds(5));
    return index < recording->size();
  };
  std::thread camera([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    ASSERT_TRUE(frames.push(frame_at(1.0, 1)));
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    frames.close();
  });
  EXPECT_TRUE(wait(0));
  EXPECT_TRUE(recording->is_last(0, stop));
  EXPECT_FALSE(wait(1));
  camera.join();

  LiveFrames endless(small_camera());
  ASSERT_TRUE(endless.push(frame_at(1.0, 1)));
  stop.request_stop();
  EXPECT_FALSE(endless.recording()->is_last(0, stop));
  EXPECT_FALSE(endless.wait_for_room(1, 0.01));
  EXPECT_TRUE(endless.recording()->read(0));
  EXPECT_FALSE(endless.wait_for_room(1, 0.0));
  endless.recording()->hand_out(0);
  EXPECT_TRUE(endless.wait_for_room(1, 0.0));
  EXPECT_FALSE(endless.recording()->given_up());
  endless.abandon();
  EXPECT_TRUE(endless.recording()->given_up());
}

}  // namespace
}  // namespace plumbline::dataset
