// SPDX-License-Identifier: BSD-3-Clause
// A live camera by the test's own clock: messages come when the test says so, with the stamps that it gives.
#include <gmock/gmock.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <stdexcept>

#include "bags/bag_parts.hpp"
#include "plumbline/dataset/live.hpp"
#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kMs = 1'000'000;  // ns
const char* const kColor = "/camera/color/image_raw";
const char* const kDepth = "/camera/depth/image_raw";
constexpr int kWidth = 64;
constexpr int kHeight = 48;
constexpr std::size_t kFrameBytes = std::size_t{kWidth} * kHeight * 5;

const BagReaders& bag_readers() {
  const auto& part = core::part<BagReaders>();
  if (!part) throw std::runtime_error(part.error().message);
  return **part;
}

/// Messages wait here from the moment at which the test sends them.
struct Wire {
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<StreamMessage> messages;
  std::size_t lost = 0;
};

class FakeCamera final : public MessageStream {
 public:
  explicit FakeCamera(std::shared_ptr<Wire> wire) : wire_(std::move(wire)) {}
  std::vector<StreamTopic> topics() override {
    return {{kColor, "sensor_msgs/Image"},
            {kDepth, "sensor_msgs/Image"},
            {"/camera/color/camera_info", "sensor_msgs/CameraInfo"},
            {"/camera/depth/camera_info", "sensor_msgs/CameraInfo"}};
  }
  core::Result<void> subscribe(const std::string& /*topic*/) override { return {}; }
  void unsubscribe(const std::string& /*topic*/) override {}
  std::optional<StreamMessage> next(std::chrono::milliseconds most) override {
    std::unique_lock lock(wire_->mutex);
    wire_->changed.wait_for(lock, most, [&] { return !wire_->messages.empty(); });
    if (wire_->messages.empty()) return std::nullopt;
    StreamMessage message = std::move(wire_->messages.front());
    wire_->messages.pop_front();
    wire_->changed.notify_all();
    return message;
  }
  [[nodiscard]] std::size_t lost() const override {
    const std::lock_guard lock(wire_->mutex);
    return wire_->lost;
  }

 private:
  std::shared_ptr<Wire> wire_;
};

class LiveCamera : public RecordingTest {
 protected:
  void send(const std::string& topic, Bytes bytes) const {
    const std::lock_guard lock(wire_->mutex);
    wire_->messages.push_back({topic, 1, std::move(bytes)});
    wire_->changed.notify_all();
  }
  /// An image of one value, by which it is recognised again; depth is 1 m and as many millimetres.
  void send_image(bool color, std::int64_t stamp_ns, int value) const {
    ImageMessage message;
    message.header = {stamp_ns, "camera"};
    message.width = kWidth;
    message.height = kHeight;
    message.encoding = color ? "mono8" : "16UC1";
    message.step = color ? kWidth : 2 * kWidth;
    const auto raw = static_cast<std::uint16_t>(color ? value : 1000 + value);
    for (int i = 0; i < kWidth * kHeight; ++i) {
      message.data.push_back(static_cast<std::uint8_t>(raw & 0xFFU));
      if (!color) message.data.push_back(static_cast<std::uint8_t>(raw >> 8U));
    }
    send(color ? kColor : kDepth, bag_readers().encoder().image(message));
  }
  void send_pair(std::int64_t stamp_ns, int value) const {
    send_image(true, stamp_ns, value);
    send_image(false, stamp_ns, value);
  }
  /// Waits until every message has been taken, and the last of them dealt with.
  void let_arrive() const {
    std::unique_lock lock(wire_->mutex);
    wire_->changed.wait(lock, [&] { return wire_->messages.empty(); });
    lock.unlock();
    send("/nothing", {});
    lock.lock();
    wire_->changed.wait(lock, [&] { return wire_->messages.empty(); });
  }

  void open_camera(const OpenOptions& given = {}) {
    for (const char* topic : {"/camera/color/camera_info", "/camera/depth/camera_info"}) {
      CameraInfoMessage info;
      info.header = {kMs, "camera"};
      info.width = kWidth;
      info.height = kHeight;
      info.distortion_model = "plumb_bob";
      info.k = {52, 0, 31.5, 0, 52, 23.5, 0, 0, 1};
      info.p = {52, 0, 31.5, 0, 0, 52, 23.5, 0, 0, 0, 1, 0};
      send(topic, bag_readers().encoder().camera_info(info));
    }
    OpenOptions options = given;
    options.live.stop = stop_;
    auto opened = open_live("ros2://0", std::make_unique<FakeCamera>(wire_), options, log_);
    ASSERT_TRUE(opened) << opened.error().message;
    source_ = std::move(*opened);
  }
  /// Ctrl-C: all that has arrived is numbered.
  void end_camera() const {
    stop_.request_stop();
    while (!source_->decided(1'000'000)) source_->wait_for(1'000'000, std::chrono::milliseconds(5));
  }
  /// Says that frames before `index` are being worked on.
  void hand_out(std::size_t index) const {
    ASSERT_TRUE(source_->decided(index));
    source_->hand_out(index);
  }
  [[nodiscard]] int value_of(std::size_t index) const {
    const auto frame = source_->read(index);
    return frame ? frame->color.at<cv::Vec3b>(5, 5)[0] : -1;
  }
  [[nodiscard]] std::vector<int> values() const {
    std::vector<int> all;
    for (std::size_t i = 0; i < source_->size(); ++i) all.push_back(value_of(i));
    return all;
  }

  std::shared_ptr<Wire> wire_ = std::make_shared<Wire>();
  core::StopToken stop_;
  std::unique_ptr<LiveFrameSource> source_;
};

TEST_F(LiveCamera, FramesAreNumberedAsTheyCome) {
  send_pair(100 * kMs, 1);
  open_camera();
  for (int i = 1; i < 5; ++i) send_pair((100 + 33 * i) * kMs, 1 + i);
  let_arrive();
  end_camera();
  EXPECT_EQ(values(), (std::vector<int>{1, 2, 3, 4, 5}));
  EXPECT_DOUBLE_EQ(source_->info(2).stamp, 0.166);
  EXPECT_FLOAT_EQ(source_->read(2)->depth.at<float>(5, 5), 1.003F);
  EXPECT_EQ(source_->read(2)->index, 2);
}

TEST_F(LiveCamera, ImagesThatComeLateFindTheirPartners) {
  send_pair(100 * kMs, 1);
  open_camera();
  send_image(true, 133 * kMs, 2);
  send_image(true, 166 * kMs, 3);
  send_image(false, 133 * kMs, 2);  // a frame later
  send_image(false, 166 * kMs, 3);
  send_image(true, 200 * kMs, 4);  // its depth never comes
  send_pair(233 * kMs, 5);
  let_arrive();
  end_camera();
  EXPECT_EQ(values(), (std::vector<int>{1, 2, 3, 5}));
  EXPECT_FLOAT_EQ(source_->read(1)->depth.at<float>(5, 5), 1.002F);
}

TEST_F(LiveCamera, DoubledAndBackwardFramesAreLeftOutAndCounted) {
  send_pair(100 * kMs, 1);
  open_camera();
  send_pair(133 * kMs, 2);
  send_pair(133 * kMs, 3);  // the stamp of the frame before
  send_pair(50 * kMs, 4);   // the camera's clock was set back
  send_pair(83 * kMs, 5);
  send_pair(166 * kMs, 6);  // and is later again
  let_arrive();
  end_camera();
  ASSERT_TRUE(source_->finish());
  EXPECT_EQ(values(), (std::vector<int>{1, 2, 6}));
  EXPECT_EQ(source_->report().taken, 3U);
  EXPECT_EQ(source_->report().backwards, 3U);
  const std::size_t first = log_.warnings.find("stamps go back");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(log_.warnings.find("stamps go back", first + 1), std::string::npos) << "told once";
}

TEST_F(LiveCamera, MemoryOfAQueueThatNobodyEmptiesIsBounded) {
  send_pair(100 * kMs, 1);
  OpenOptions options;
  options.live.most_waiting_bytes = 10 * kFrameBytes;
  open_camera(options);
  for (int i = 1; i < 200; ++i) send_pair((100 + 33 * i) * kMs, i % 100);
  let_arrive();
  EXPECT_GE(source_->size(), 8U);
  EXPECT_LE(source_->size(), 20U);
  const std::size_t before = source_->size();
  EXPECT_THAT(log_.warnings, HasSubstr("dropped"));

  // There is room again when frames are worked on, and numbers have no gaps.
  hand_out(before - 2);
  send_pair(9000 * kMs, 101);
  send_pair(9033 * kMs, 102);
  let_arrive();
  end_camera();
  ASSERT_TRUE(source_->finish());
  EXPECT_EQ(source_->size(), before + 2);
  EXPECT_EQ(value_of(before), 101);
  EXPECT_EQ(value_of(before + 1), 102);
  EXPECT_EQ(source_->report().taken + source_->report().dropped, 202U);
}

TEST_F(LiveCamera, ARecordHasTheTakenFramesInOrder) {
  OpenOptions options;
  options.live.record = folder_ / "take.mcap";
  options.live.most_waiting_bytes = 10 * kFrameBytes;
  send_pair(100 * kMs, 1);
  send_pair(133 * kMs, 2);  // before the camera is understood
  open_camera(options);
  send_image(false, 170 * kMs, 3);
  send_image(true, 166 * kMs, 3);
  send_pair(120 * kMs, 4);  // goes back
  for (int i = 3; i < 60; ++i) send_pair((100 + 33 * i) * kMs, 2 + i);
  let_arrive();
  end_camera();
  ASSERT_TRUE(source_->finish());
  EXPECT_GT(source_->report().dropped, 30U);

  const auto record = open_recording(folder_ / "take.mcap", {}, log_);
  ASSERT_TRUE(record) << record.error().message;
  ASSERT_EQ((*record)->size(), source_->size());
  for (std::size_t i = 0; i < source_->size(); ++i) {
    EXPECT_EQ((*record)->info(i).stamp, source_->info(i).stamp) << i;
    EXPECT_EQ((*record)->info(i).depth_stamp, source_->info(i).depth_stamp) << i;
    EXPECT_EQ((*record)->read(i)->color.at<cv::Vec3b>(5, 5)[0], value_of(i)) << i;
  }
  EXPECT_DOUBLE_EQ((*record)->info(2).depth_stamp, 0.170);
}

TEST_F(LiveCamera, CtrlCEndsItAndWhatHasArrivedIsStillRead) {
  OpenOptions options;
  options.live.record = folder_ / "take.mcap";
  send_pair(100 * kMs, 1);
  open_camera(options);
  for (int i = 1; i < 4; ++i) send_pair((100 + 33 * i) * kMs, 1 + i);
  let_arrive();
  EXPECT_TRUE(source_->decided(0));
  EXPECT_FALSE(source_->decided(4)) << "the fifth may still come";
  end_camera();
  EXPECT_TRUE(source_->decided(4)) << "it will not";
  send_pair(900 * kMs, 9);
  ASSERT_TRUE(source_->finish());
  EXPECT_EQ(values(), (std::vector<int>{1, 2, 3, 4}));
  EXPECT_TRUE(source_->is_last(3, {}));
  EXPECT_FALSE(source_->is_last(2, {}));
  const auto record = open_recording(folder_ / "take.mcap", {}, log_);
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_EQ((*record)->size(), 4U);
}

TEST_F(LiveCamera, WhatTheNetworkLostAndWhatHadNoPartnerIsReported) {
  send_pair(100 * kMs, 1);
  open_camera();
  {
    const std::lock_guard lock(wire_->mutex);
    wire_->lost = 7;
  }
  for (int i = 1; i < 4; ++i) send_image(true, (100 + 33 * i) * kMs, 1 + i);
  send_pair(400 * kMs, 5);
  let_arrive();
  end_camera();
  ASSERT_TRUE(source_->finish());
  EXPECT_EQ(source_->report().lost, 7U);
  EXPECT_EQ(source_->report().unpaired, 3U);
  EXPECT_EQ(values(), (std::vector<int>{1, 5}));
}

TEST_F(LiveCamera, KeptFramesAreReadAgainLongAfter) {
  send_pair(100 * kMs, 1);
  open_camera();
  for (int i = 1; i < 200; ++i) {
    send_pair((100 + 33 * i) * kMs, i);
    let_arrive();
    const auto done = static_cast<std::size_t>(i - 1);
    ASSERT_TRUE(source_->read(done));
    if (done % 50 == 0) source_->keep(done);
    hand_out(done);
    source_->release(done);
  }
  end_camera();
  EXPECT_EQ(value_of(0), 1);
  EXPECT_EQ(value_of(50), 50);
  EXPECT_EQ(value_of(51), -1) << "was not kept";
  EXPECT_EQ(source_->report().kept, 4U);
  EXPECT_GT(source_->report().kept_bytes, 0U);
}

}  // namespace
}  // namespace plumbline::dataset
