// SPDX-License-Identifier: BSD-3-Clause
// The camera of a bag or of a live camera: regions of interest, binning, cameras without calibration.
#include <gmock/gmock.h>

#include <deque>
#include <stdexcept>
#include <thread>

#include "bags/bag_parts.hpp"
#include "plumbline/dataset/live.hpp"
#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const char* const kColorTopic = "/camera/color/image_raw";
const char* const kDepthTopic = "/camera/aligned_depth_to_color/image_raw";

const BagReaders& readers() {
  const auto& part = core::part<BagReaders>();
  if (!part) throw std::runtime_error(part.error().message);
  return **part;
}

/// A camera of 320 x 240 pixels whose principal point is not in the middle.
CameraInfoMessage full_info() {
  CameraInfoMessage info;
  info.header = {1'000'000'000, "camera"};
  info.width = 320;
  info.height = 240;
  info.distortion_model = "plumb_bob";
  info.k = {130, 0, 150, 0, 131, 110, 0, 0, 1};
  info.p = {120, 0, 140, 0, 0, 121, 100, 0, 0, 0, 1, 0};
  return info;
}

/// An image of one value, 2 m as depth.
ImageMessage image_message(cv::Size size, const std::string& encoding) {
  const bool depth = encoding == "16UC1";
  ImageMessage message;
  message.header = {1'000'000'000, "camera"};
  message.width = static_cast<std::uint32_t>(size.width);
  message.height = static_cast<std::uint32_t>(size.height);
  message.encoding = encoding;
  message.step = message.width * (depth ? 2 : 3);
  for (std::uint32_t i = 0; i < message.step * message.height; ++i)
    message.data.push_back(depth ? static_cast<std::uint8_t>(i % 2 == 0 ? 0xD0 : 0x07) : 90);
  return message;
}

std::string info_topic(const std::string& image) {
  return image.substr(0, image.rfind('/')) + "/camera_info";
}

class BagCamera : public RecordingTest {
 protected:
  /// A bag of one frame of images of this size, in which both topics have the CameraInfo.
  void write_bag(const CameraInfoMessage& info, cv::Size images,
                 const std::string& color = kColorTopic) const {
    const auto bag = readers().create_mcap(folder_ / "a.mcap", "plumbline");
    bag->write(color, image_message(images, "rgb8"));
    bag->write(kDepthTopic, image_message(images, "16UC1"));
    bag->write(info_topic(color), info);
    bag->write(info_topic(kDepthTopic), info);
    ASSERT_TRUE(bag->finish());
  }
  [[nodiscard]] core::Result<std::unique_ptr<FrameSource>> open_bag() {
    log_.warnings.clear();
    return open_recording(folder_ / "a.mcap", {}, log_);
  }
  void expect_camera(const sensor::Pinhole& right) {
    const auto source = open_bag();
    ASSERT_TRUE(source) << source.error().message;
    expect_same((*source)->camera().color, right);
    const auto frame = (*source)->read(0);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->color.size(), cv::Size(right.width, right.height));
  }
  static void expect_same(const sensor::Pinhole& is, const sensor::Pinhole& right) {
    EXPECT_EQ(is.width, right.width);
    EXPECT_EQ(is.height, right.height);
    EXPECT_NEAR(is.fx, right.fx, 1e-12);
    EXPECT_NEAR(is.fy, right.fy, 1e-12);
    EXPECT_NEAR(is.cx, right.cx, 1e-12);
    EXPECT_NEAR(is.cy, right.cy, 1e-12);
  }
};

TEST_F(BagCamera, WithoutARegionIsTheFullPicture) {
  write_bag(full_info(), {320, 240});
  expect_camera({320, 240, 130, 131, 150, 110});
  EXPECT_EQ(log_.warnings, "");
}

TEST_F(BagCamera, RegionMovesThePrincipalPoint) {
  CameraInfoMessage info = full_info();
  info.roi = {80, 60, 120, 160, false};
  write_bag(info, {160, 120});
  expect_camera({160, 120, 130, 131, 70, 50});
  EXPECT_EQ(log_.warnings, "");
}

TEST_F(BagCamera, BinningScalesAboutThePixelsEdge) {
  CameraInfoMessage info = full_info();
  info.binning_x = 2;
  info.binning_y = 2;
  write_bag(info, {160, 120});
  expect_camera({160, 120, 65, 65.5, 74.75, 54.75});
}

TEST_F(BagCamera, RegionIsCutOutBeforeItsPixelsAreBinned) {
  CameraInfoMessage info = full_info();
  info.roi = {80, 60, 120, 160, false};
  info.binning_x = 2;
  info.binning_y = 4;
  write_bag(info, {80, 30});
  expect_camera({80, 30, 65, 32.75, (70 + 0.5) / 2 - 0.5, (50 + 0.5) / 4 - 0.5});
}

TEST_F(BagCamera, RegionAppliesToTheRectifiedCameraToo) {
  CameraInfoMessage info = full_info();
  info.roi = {80, 60, 120, 160, true};
  write_bag(info, {160, 120}, "/camera/color/image_rect_color");
  expect_camera({160, 120, 120, 121, 60, 40});
}

TEST_F(BagCamera, ImagesOfTheFullSizeAreTheFullPicture) {
  CameraInfoMessage info = full_info();
  info.roi = {80, 60, 120, 160, false};
  write_bag(info, {320, 240});
  expect_camera({320, 240, 130, 131, 150, 110});
  EXPECT_THAT(log_.warnings, HasSubstr("/camera/color/camera_info: says that only a part"));
}

TEST_F(BagCamera, RegionOutsideThePictureIsRefused) {
  CameraInfoMessage info = full_info();
  info.roi = {200, 60, 120, 160, false};
  write_bag(info, {160, 120});
  const auto refused = open_bag();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, core::ErrorKind::kInput);
  EXPECT_THAT(refused.error().message,
              AllOf(HasSubstr("/camera/color/camera_info has a region of interest of 160 x 120"),
                    HasSubstr("does not fit in its 320 x 240"), HasSubstr("--camera")));
}

TEST_F(BagCamera, UncalibratedAndMissingAreToldApart) {
  CameraInfoMessage info = full_info();
  info.k = {};
  info.p = {};
  write_bag(info, {640, 480});
  const auto guessed = open_bag();
  ASSERT_TRUE(guessed) << guessed.error().message;
  EXPECT_TRUE((*guessed)->camera().guess);
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("/camera/color/camera_info: is there, but its K is zero"),
                                   HasSubstr("never calibrated"), Not(HasSubstr("has no CameraInfo"))));

  const auto bag = readers().create_mcap(folder_ / "a.mcap", "plumbline");
  bag->write(kColorTopic, image_message({640, 480}, "rgb8"));
  bag->write(kDepthTopic, image_message({640, 480}, "16UC1"));
  ASSERT_TRUE(bag->finish());
  ASSERT_TRUE(open_bag());
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("has no CameraInfo for /camera/color/image_raw"),
                                   Not(HasSubstr("never calibrated")), Not(HasSubstr("camera.yaml"))));
}

TEST(CameraInfo, OfRos1HasItsRegion) {
  const std::uint32_t fields[] = {0, 0, 0, 0};  // the header: number, seconds, nanoseconds, no frame
  Bytes bytes;
  const auto add = [&bytes](const auto& value) {
    const auto* begin = reinterpret_cast<const std::uint8_t*>(&value);
    bytes.insert(bytes.end(), begin, begin + sizeof(value));
  };
  add(fields);
  for (const std::uint32_t number : {240U, 320U, 0U, 0U}) add(number);  // size, no model, no coefficients
  for (int i = 0; i < 9 + 9 + 12; ++i) add(1.0 * i);
  for (const std::uint32_t number : {2U, 3U, 80U, 60U, 120U, 160U}) add(number);
  add(std::uint8_t{1});

  const auto info = readers().ros1().camera_info(bytes);
  ASSERT_TRUE(info) << info.error();
  EXPECT_EQ(info->binning_x, 2U);
  EXPECT_EQ(info->binning_y, 3U);
  EXPECT_EQ(info->roi.x_offset, 80U);
  EXPECT_EQ(info->roi.y_offset, 60U);
  EXPECT_EQ(info->roi.height, 120U);
  EXPECT_EQ(info->roi.width, 160U);
  EXPECT_TRUE(info->roi.do_rectify);
}

/// A network on which messages have come in this order.
class Scripted final : public MessageStream {
 public:
  void add(const std::string& topic, const std::string& type, Bytes bytes) {
    topics_.push_back({topic, type});
    messages_.push_back({topic, 1, std::move(bytes)});
  }
  std::vector<StreamTopic> topics() override { return topics_; }
  core::Result<void> subscribe(const std::string& /*topic*/) override { return {}; }
  void unsubscribe(const std::string& /*topic*/) override {}
  std::optional<StreamMessage> next(std::chrono::milliseconds most) override {
    if (messages_.empty()) {
      std::this_thread::sleep_for(most);
      return std::nullopt;
    }
    StreamMessage message = std::move(messages_.front());
    messages_.pop_front();
    return message;
  }
  [[nodiscard]] std::size_t lost() const override { return 0; }

 private:
  std::vector<StreamTopic> topics_;
  std::deque<StreamMessage> messages_;
};

TEST_F(BagCamera, RegionOfALiveCameraIsReadAlike) {
  CameraInfoMessage info = full_info();
  info.roi = {80, 60, 120, 160, false};
  const MessageEncoder& encoder = readers().encoder();
  auto stream = std::make_unique<Scripted>();
  for (const char* topic : {kColorTopic, kDepthTopic})
    stream->add(info_topic(topic), "sensor_msgs/CameraInfo", encoder.camera_info(info));
  stream->add(kColorTopic, "sensor_msgs/Image", encoder.image(image_message({160, 120}, "rgb8")));
  stream->add(kDepthTopic, "sensor_msgs/Image", encoder.image(image_message({160, 120}, "16UC1")));

  const auto source = open_live("ros2://0", std::move(stream), {}, log_);
  ASSERT_TRUE(source) << source.error().message;
  expect_same((*source)->camera().color, {160, 120, 130, 131, 70, 50});
}

}  // namespace
}  // namespace plumbline::dataset
