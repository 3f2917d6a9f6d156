// SPDX-License-Identifier: BSD-3-Clause
// Bags: copies that say the same as the original, files that are cut or damaged, topics that cannot be told.
// Files of other programs: tests/integration/bags.
#include <gmock/gmock.h>

#include <array>
#include <cstring>
#include <fstream>
#include <iterator>

#include "bags/bag_parts.hpp"
#include "bags/images.hpp"
#include "bags/rvl.hpp"
#include "plumbline/dataset/bag.hpp"
#include "plumbline/dataset/convert.hpp"
#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class Bags : public RecordingTest {
 protected:
  [[nodiscard]] core::Result<std::unique_ptr<FrameSource>> open_path(const std::string& name,
                                                                     const OpenOptions& options = {}) {
    log_.warnings.clear();
    return open_recording(folder_ / name, options, log_);
  }
  /// A copy of the recording in the folder, or of what is at `from`.
  ConvertSummary copy(const std::string& to, const std::string& from = "") {
    const auto source = open_path(from);
    EXPECT_TRUE(source) << source.error().message;
    ConvertOptions options;
    options.replace = true;
    const auto summary = convert_recording(**source, folder_ / to, options, log_);
    EXPECT_TRUE(summary) << summary.error().message;
    return summary.value_or(ConvertSummary());
  }
  static void expect_same_image(const cv::Mat& a, const cv::Mat& b) {
    ASSERT_EQ(a.type(), b.type());
    ASSERT_EQ(a.size(), b.size());
    EXPECT_EQ(cv::norm(a, b, cv::NORM_INF), 0.0);
  }
  void expect_same_recordings(const std::string& a_name, const std::string& b_name) {
    const auto a = open_path(a_name);
    const auto b = open_path(b_name);
    ASSERT_TRUE(a) << a.error().message;
    ASSERT_TRUE(b) << b.error().message;
    ASSERT_EQ((*a)->size(), (*b)->size());
    EXPECT_EQ(sensor::to_yaml((*a)->camera()), sensor::to_yaml((*b)->camera()));
    for (std::size_t i = 0; i < (*a)->size(); ++i) {
      const auto frame_a = (*a)->read(i);
      const auto frame_b = (*b)->read(i);
      ASSERT_TRUE(frame_a && frame_b) << i;
      EXPECT_EQ(frame_a->stamp, frame_b->stamp);
      EXPECT_EQ(frame_a->depth_stamp, frame_b->depth_stamp);
      expect_same_image(frame_a->color, frame_b->color);
      expect_same_image(frame_a->depth, frame_b->depth);
    }
  }
  /// Depth that is not the same everywhere.
  void write_depths(int count) const {
    for (int i = 0; i < count; ++i) {
      cv::Mat depth(48, 64, CV_16UC1);
      cv::RNG rng(static_cast<std::uint64_t>(i) + 7);
      rng.fill(depth, cv::RNG::UNIFORM, 5000, 15000);
      depth.at<std::uint16_t>(3, 4) = 65535;
      depth.at<std::uint16_t>(5, 6) = 0;
      write_image("depth/" + std::to_string(i) + ".png", depth);
    }
  }
  /// Images too large for two in a chunk.
  void write_large(int count) const {
    write_tum(count);
    for (int i = 0; i < count; ++i) {
      write_image("rgb/" + std::to_string(i) + ".png", color_image(i, {800, 600}));
      write_image("depth/" + std::to_string(i) + ".png", depth_image(10000, {800, 600}));
    }
    write_text("camera.yaml", "width: 800\nheight: 600\nfx: 700\nfy: 700\ncx: 399.5\ncy: 299.5\n");
  }
  std::string bytes_of(const std::string& name) const {
    std::ifstream stream(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
};

TEST_F(Bags, CopiesSayTheSameAsTheOriginal) {
  for (const char* scale : {"depth_scale: 5000\n", "depth_scale: 1000\n", "depth_scale: 6553.5\n"}) {
    write_tum(5);
    write_depths(5);
    write_camera(scale);
    EXPECT_EQ(copy("a.mcap").written, 5U);
    expect_same_recordings("", "a.mcap");
    copy("b", "a.mcap");
    expect_same_recordings("", "b");
    copy("c", "");
    expect_same_recordings("", "c");
    std::filesystem::remove_all(folder_);
  }
}

TEST_F(Bags, CopiesKeepWhatTheCameraFileSays) {
  write_tum(4);
  write_depths(4);
  write_camera(
      "depth_scale: 1000\nfps: 10\ndistortion: [0.1, -0.05, 0.001, 0.002, 0.01]\nreadout: 0.02\ndepth_delay: "
      "0.004\n"
      "color_from_depth:\n  - [1, 0, 0, 0.025]\n  - [0, 1, 0, 0.001]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n"
      "depth: {width: 64, height: 48, fx: 50, fy: 50.5, cx: 31, cy: 23}\n");
  for (int i = 0; i < 4; ++i) write_image("depth/" + std::to_string(i) + ".png", depth_image(2000));
  copy("a.mcap");
  copy("b", "a.mcap");
  expect_same_recordings("", "a.mcap");
  expect_same_recordings("", "b");
}

TEST_F(Bags, ImagesAreCopiedAsTheyAreStored) {
  write_camera();
  std::string list;
  for (int i = 0; i < 3; ++i) {
    const std::string id = std::to_string(i);
    write_image("rgb/" + id + ".jpg", color_image(i));
    cv::Mat metres(48, 64, CV_32FC1, cv::Scalar(1.5 + 0.25 * i));
    write_image("depth/" + id + ".tiff", metres);
    list += stamp(i, 0.0) + " rgb/" + id + ".jpg " + stamp(i, 0.001) + " depth/" + id + ".tiff\n";
  }
  write_text("associations.txt", list);
  copy("copy");
  const std::string name = "100.000000000";
  EXPECT_EQ(bytes_of("rgb/0.jpg"), bytes_of("copy/rgb/" + name + ".jpg"));
  EXPECT_EQ(bytes_of("depth/0.tiff"), bytes_of("copy/depth/100.001000000.tiff"));
  copy("a.mcap");
  copy("b", "a.mcap");
  EXPECT_EQ(bytes_of("rgb/0.jpg"), bytes_of("b/rgb/" + name + ".jpg"));
  expect_same_recordings("", "a.mcap");
  expect_same_recordings("", "b");
}

TEST_F(Bags, NothingIsReplacedThatIsNoCopy) {
  write_tum(3);
  const auto source = open();
  ASSERT_TRUE(source);
  write_text("mine/letter.txt", "dear");
  ConvertOptions options;
  const auto refused = convert_recording(**source, folder_ / "mine", options, log_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, core::ErrorKind::kUsage);
  options.replace = true;
  EXPECT_FALSE(convert_recording(**source, folder_ / "mine", options, log_));
  EXPECT_EQ(bytes_of("mine/letter.txt"), "dear");

  // Neither a recording that no copy made, nor a live camera's.
  write_text("other/associations.txt", "1 rgb/1.png 1 depth/1.png\n");
  EXPECT_FALSE(convert_recording(**source, folder_ / "other", options, log_));
  copy("live.mcap");
  std::string live = bytes_of("live.mcap");
  live.replace(live.find("plumbline convert"), 17, "plumbline 0.2.0.0");
  write_text("live.mcap", live);
  EXPECT_FALSE(convert_recording(**source, folder_ / "live.mcap", options, log_));
}

TEST_F(Bags, WhatAppearsWhileACopyIsMadeIsKept) {
  write_tum(3);
  const auto source = open();
  ASSERT_TRUE(source);
  for (const std::string out : {"new", "new.mcap"}) {
    ConvertOptions options;
    options.replace = true;
    options.progress = [&](std::size_t) { write_text(out == "new" ? "new/letter.txt" : out, "dear"); };
    const auto refused = convert_recording(**source, folder_ / out, options, log_);
    ASSERT_FALSE(refused) << out;
    EXPECT_EQ(refused.error().kind, core::ErrorKind::kOutput) << refused.error().message;
    EXPECT_EQ(bytes_of(out == "new" ? "new/letter.txt" : out), "dear");
  }

  // The copy waits until it is moved, or dropped when asked for.
  std::filesystem::remove_all(folder_ / "new");
  const auto waits = convert_recording(**source, folder_ / "new", {}, log_);
  ASSERT_FALSE(waits);
  EXPECT_NE(waits.error().message.find("new.partial: holds a complete copy"), std::string::npos)
      << waits.error().message;
  expect_same_recordings("", "new.partial");
  ConvertOptions options;
  options.replace = true;
  EXPECT_TRUE(convert_recording(**source, folder_ / "new", options, log_));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "new.partial"));
}

TEST_F(Bags, AUsersPictureInACopyIsKept) {
  write_tum(3);
  const auto source = open();
  ASSERT_TRUE(source);
  copy("copy");
  write_text("copy/rgb/holiday.jpg", "sun");
  ConvertOptions options;
  options.replace = true;
  EXPECT_FALSE(convert_recording(**source, folder_ / "copy", options, log_));
  EXPECT_EQ(bytes_of("copy/rgb/holiday.jpg"), "sun");
  std::filesystem::remove(folder_ / "copy/rgb/holiday.jpg");
  EXPECT_TRUE(convert_recording(**source, folder_ / "copy", options, log_));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "copy.replaced"));
}

TEST_F(Bags, OfACutFileWhatIsBeforeTheBreakIsRead) {
  write_large(6);
  copy("whole.mcap");
  const std::string whole = bytes_of("whole.mcap");
  std::size_t most = 0;
  for (const double share : {0.1, 0.5, 0.9, 0.99}) {
    write_text("cut.mcap",
               whole.substr(0, static_cast<std::size_t>(static_cast<double>(whole.size()) * share)));
    const auto cut = open_path("cut.mcap", OpenOptions());
    if (!cut) {
      EXPECT_THAT(cut.error().message, HasSubstr("cut.mcap"));
      continue;
    }
    EXPECT_THAT(log_.warnings, HasSubstr("cut off or damaged at byte"));
    EXPECT_GE((*cut)->size(), most);
    most = (*cut)->size();
  }
  EXPECT_GT(most, 0U);
}

TEST_F(Bags, OfADamagedChunkOnlyItsFramesAreLost) {
  write_large(6);
  copy("whole.mcap");
  std::string bytes = bytes_of("whole.mcap");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x55);
  write_text("damaged.mcap", bytes);
  const auto source = open_path("damaged.mcap");
  ASSERT_TRUE(source) << source.error().message;
  std::size_t good = 0;
  std::string why;
  for (std::size_t i = 0; i < (*source)->size(); ++i) {
    const auto frame = (*source)->read(i);
    good += frame ? 1U : 0U;
    if (!frame) why = frame.error().message;
  }
  EXPECT_GE(good, 4U);
  EXPECT_LT(good, 6U);
  EXPECT_THAT(why + log_.warnings, AllOf(HasSubstr("damaged.mcap"), HasSubstr("chunk")));
}

TEST_F(Bags, AnUnknownCompressionIsNamed) {
  write_large(6);
  copy("whole.mcap");
  std::string bytes = bytes_of("whole.mcap");
  std::size_t renamed = 0;
  for (std::size_t at = bytes.find("zstd"); at != std::string::npos; at = bytes.find("zstd", at)) {
    bytes.replace(at, 4, "lzma");
    ++renamed;
  }
  ASSERT_GT(renamed, 0U);
  write_text("other.mcap", bytes);

  const auto source = open_path("other.mcap");
  const std::string message = source ? log_.warnings : source.error().message;
  EXPECT_THAT(message, AllOf(HasSubstr("other.mcap"), HasSubstr("compressed by 'lzma' (known: zstd, lz4)")));
}

/// A bag with a topic or two, of one image each.
class Topics : public Bags {
 protected:
  void write_bag(const std::string& name,
                 const std::vector<std::pair<std::string, std::string>>& images) const {
    const auto& part = core::part<BagReaders>();
    ASSERT_TRUE(part);
    const auto bag = (*part)->create_mcap(folder_ / name, "plumbline");
    for (const auto& [topic, encoding] : images) {
      ImageMessage message;
      message.header = {1'000'000'000, "camera"};
      message.width = 64;
      message.height = 48;
      message.encoding = encoding;
      const std::uint32_t bytes = encoding == "16UC1" ? 2 : encoding == "mono8" ? 1 : 3;
      message.step = 64 * bytes;
      message.data.assign(std::size_t{48} * message.step, 8);
      bag->write(topic, message);
      CameraInfoMessage info;
      info.header = message.header;
      info.width = 64;
      info.height = 48;
      info.k = {52, 0, 31.5, 0, 52, 23.5, 0, 0, 1};
      bag->write(topic.substr(0, topic.rfind('/')) + "/camera_info", info);
    }
    ASSERT_TRUE(bag->finish());
  }
};

TEST_F(Topics, AlignedDepthAndTheColourOfItsCameraAreFound) {
  write_bag("a.mcap", {{"/camera/color/image_raw", "rgb8"},
                       {"/camera/infra1/image_rect_raw", "mono8"},
                       {"/camera/depth/image_rect_raw", "16UC1"},
                       {"/camera/aligned_depth_to_color/image_raw", "16UC1"}});
  const auto text = bag_to_text(folder_ / "a.mcap", {});
  ASSERT_TRUE(text) << text.error().message;
  EXPECT_THAT(*text, AllOf(HasSubstr("topic: /camera/infra1/image_rect_raw sensor_msgs/Image, 1 messages"),
                           HasSubstr("colour: /camera/color/image_raw (rgb8), the only colour image"),
                           HasSubstr("depth: /camera/aligned_depth_to_color/image_raw (16UC1)"),
                           HasSubstr("camera of colour: /camera/color/camera_info, beside the image")));
}

TEST_F(Topics, WhatIsNotCertainIsRefusedWithAllThatCouldBeMeant) {
  write_bag("a.mcap", {{"/front/color/image_raw", "rgb8"},
                       {"/front/depth/image_raw", "16UC1"},
                       {"/back/depth/image_raw", "16UC1"}});
  const auto refused = open_path("a.mcap");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, core::ErrorKind::kUsage);
  EXPECT_THAT(refused.error().message,
              AllOf(HasSubstr("/front/depth/image_raw"), HasSubstr("/back/depth/image_raw"),
                    HasSubstr("--topic depth=")));
  OpenOptions named;
  named.topics.depth = "/front/depth/nothing";
  const auto wrong = open_path("a.mcap", named);
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("no such topic"));
  named.topics.depth = "/front/depth/camera_info";
  const auto type = open_path("a.mcap", named);
  ASSERT_FALSE(type);
  EXPECT_THAT(type.error().message, HasSubstr("sensor_msgs/CameraInfo"));
}

TEST_F(Topics, TopicsAreAboutBags) {
  write_tum(3);
  OpenOptions named;
  named.topics.depth = "/depth";
  EXPECT_THAT(open_error(named), HasSubstr("not a bag"));
}

TEST_F(Topics, WithoutDepthItIsSaidWhatIsThere) {
  write_bag("a.mcap", {{"/camera/color/image_raw", "rgb8"}});
  const auto refused = open_path("a.mcap");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, core::ErrorKind::kInput);
  EXPECT_THAT(refused.error().message,
              AllOf(HasSubstr("no depth image"), HasSubstr("/camera/color/image_raw")));
}

TEST(MessageImages, OfOtherByteOrderAndWithPaddedRows) {
  ImageMessage message;
  message.width = 2;
  message.height = 2;
  message.encoding = "16UC1";
  message.big_endian = true;
  message.step = 6;
  message.data = {0x01, 0x02, 0x03, 0x04, 9, 9, 0x05, 0x06, 0x07, 0x08};  // the last row without its padding
  const auto image = image_of(message);
  ASSERT_TRUE(image) << image.error();
  EXPECT_EQ(image->at<std::uint16_t>(0, 0), 0x0102);
  EXPECT_EQ(image->at<std::uint16_t>(1, 1), 0x0708);
  message.data.pop_back();
  EXPECT_FALSE(image_of(message));
}

TEST(MessageImages, UnknownEncodingsAreNamed) {
  ImageMessage message;
  message.width = message.height = 2;
  message.data.assign(64, 0);
  message.encoding = "nv24";
  EXPECT_THAT(image_of(message).error(), AllOf(HasSubstr("nv24"), HasSubstr("rgb8")));
  message.encoding = "bayer_rggb8";
  EXPECT_THAT(image_of(message).error(), HasSubstr("image_proc"));
}

/// compressedDepth of 2 x 1 pixels, 1000 and 2000, behind a head of `head` bytes that ends in a and b.
CompressedImageMessage compressed_depth(const std::string& format, std::size_t head) {
  cv::Mat values(1, 2, CV_16UC1);
  values.at<std::uint16_t>(0, 0) = 1000;
  values.at<std::uint16_t>(0, 1) = 2000;
  std::vector<std::uint8_t> png;
  cv::imencode(".png", values, png);

  CompressedImageMessage message;
  message.format = format;
  message.data.assign(head, 0x89);  // PNG's first byte, alone
  const std::array<float, 2> inverse = {3000.0F, 500.0F};
  if (head >= sizeof(inverse))
    std::memcpy(message.data.data() + head - sizeof(inverse), &inverse, sizeof(inverse));
  message.data.insert(message.data.end(), png.begin(), png.end());
  return message;
}

TEST(MessageImages, CompressedDepthBehindAnyHead) {
  for (const std::size_t head : {0U, 4U, 12U, 16U, 24U}) {
    const auto image = image_of(compressed_depth("16UC1; compressedDepth png", head));
    ASSERT_TRUE(image) << head << ": " << image.error();
    ASSERT_EQ(image->size(), cv::Size(2, 1));
    EXPECT_EQ(image->at<std::uint16_t>(0, 1), 2000) << head;
  }
  for (const std::size_t head : {12U, 16U}) {
    const auto metres = image_of(compressed_depth("32FC1; compressedDepth png", head));
    ASSERT_TRUE(metres) << head << ": " << metres.error();
    EXPECT_NEAR(metres->at<float>(0, 0), 6.0F, 1e-6) << head;
    EXPECT_NEAR(metres->at<float>(0, 1), 2.0F, 1e-6) << head;
  }
  EXPECT_THAT(image_of(compressed_depth("32FC1; compressedDepth png", 0)).error(), HasSubstr("16UC1"));
  EXPECT_FALSE(image_of(CompressedImageMessage{{}, "16UC1; compressedDepth png", Bytes(5, 1)}));
}

TEST(Rvl, TakesNoMoreThanThereIs) {
  // In nibbles from the top: 2 zeros, 3 depths, which are steps of 5, 0 and -1, coded as 10 (2 and 1, as 3
  // bits are in each), 0 and 1.
  const std::uint32_t word = 0x23A10100;
  std::vector<std::uint8_t> data(sizeof(word));
  std::memcpy(data.data(), &word, sizeof(word));
  const auto depths = decode_rvl(data.data(), data.size(), 5);
  ASSERT_TRUE(depths);
  EXPECT_THAT(*depths, testing::ElementsAre(0, 0, 5, 5, 4));
  EXPECT_FALSE(decode_rvl(data.data(), 3, 5)) << "a word is not all there";
  EXPECT_FALSE(decode_rvl(data.data(), data.size(), 4)) << "more depths than pixels";
}

}  // namespace
}  // namespace plumbline::dataset
