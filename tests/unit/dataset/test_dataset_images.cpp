// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cstddef>
#include <cstdio>
// clang-format off
#include <jpeglib.h>
// clang-format on
#include <fstream>
#include <iterator>
#include <limits>
#include <thread>
#include <vector>

#include "plumbline/core/part.hpp"
#include "plumbline/dataset/image_io.hpp"
#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class Images : public RecordingTest {
 protected:
  void expect_same_as_opencv(const std::string& name) {
    const auto image = read_image(folder_ / name);
    ASSERT_TRUE(image) << image.error().message;
    const cv::Mat reference = cv::imread((folder_ / name).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(image->type(), reference.type()) << name;
    ASSERT_EQ(image->size(), reference.size()) << name;
    EXPECT_EQ(cv::norm(*image, reference, cv::NORM_INF), 0.0) << name;
  }
  std::string error_of(const std::string& name) {
    const auto image = read_image(folder_ / name);
    EXPECT_FALSE(image) << name;
    return image ? "" : image.error().message;
  }
  std::string bytes(const std::string& name) {
    std::ifstream stream(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
};

/// Smooth shading with some noise: encoders choose every kind of row filter for it.
cv::Mat picture(int type, cv::Size size) {
  cv::Mat image(size, type);
  cv::RNG rng(7);
  const double top = image.depth() == CV_8U ? 200.0 : 50000.0;
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      for (int c = 0; c < image.channels(); ++c) {
        const double value =
            top * (u + v * (c + 1)) / (size.width + 3.0 * size.height) + (v % 3 == 0 ? rng() % 9 : 0);
        if (image.depth() == CV_8U) {
          image.ptr<std::uint8_t>(v)[u * image.channels() + c] = static_cast<std::uint8_t>(value);
        } else {
          image.ptr<std::uint16_t>(v)[u * image.channels() + c] = static_cast<std::uint16_t>(value);
        }
      }
    }
  }
  return image;
}

TEST_F(Images, PngAgreesWithOpenCv) {
  int made = 0;
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3}) {
    for (const cv::Size size : {cv::Size(64, 48), cv::Size(1, 1), cv::Size(7, 3), cv::Size(1, 9)}) {
      for (const int strategy : {cv::IMWRITE_PNG_STRATEGY_DEFAULT, cv::IMWRITE_PNG_STRATEGY_FILTERED}) {
        const std::string name = std::to_string(made++) + ".png";
        // with a compression level given, OpenCV leaves the row filters to libpng, which then uses all of
        // them
        ASSERT_TRUE(cv::imwrite((folder_ / name).string(), picture(type, size),
                                {cv::IMWRITE_PNG_COMPRESSION, 6, cv::IMWRITE_PNG_STRATEGY, strategy}));
        expect_same_as_opencv(name);
      }
    }
  }
}

TEST_F(Images, JpegAgreesWithOpenCv) {
  write_image("color.jpg", picture(CV_8UC3, {64, 48}));
  expect_same_as_opencv("color.jpg");
  write_image("grey.jpg", picture(CV_8UC1, {63, 47}));
  const auto grey = read_image(folder_ / "grey.jpg");
  ASSERT_TRUE(grey);
  EXPECT_EQ(grey->type(), CV_8UC3);
  EXPECT_EQ(grey->size(), cv::Size(63, 47));
}

TEST_F(Images, OtherFormatsGoToOpenCv) {
  write_image("color.bmp", picture(CV_8UC3, {64, 48}));
  expect_same_as_opencv("color.bmp");
}

TEST(EncodePng, GivesOpenCvsBytes) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1}) {
    for (const int level : {1, 9}) {
      const cv::Mat image = picture(type, {64, 48});
      std::vector<std::uint8_t> expected;
      // Level 1 is OpenCV's own quick way; told the number, it tries every filter.
      std::vector<int> how{cv::IMWRITE_PNG_COMPRESSION, level};
      if (level == 1) how.clear();
      ASSERT_TRUE(cv::imencode(".png", image, expected, how));
      const auto bytes = encode_png(image, level);
      ASSERT_TRUE(bytes) << bytes.error().message;
      EXPECT_EQ(*bytes, expected) << type << " at " << level;
    }
  }
  EXPECT_FALSE(encode_png(cv::Mat(), 1));
}

TEST(ImageFormats, PartOfAnotherProgramIsRefused) {
  const auto loaded = core::load_part("images", 1);
  ASSERT_FALSE(loaded);
  EXPECT_NE(loaded.error().message.find("plumbline_images.so"), std::string::npos) << loaded.error().message;
  EXPECT_NE(loaded.error().message.find("not built together"), std::string::npos) << loaded.error().message;
}

TEST_F(Images, OtherFormatsAreReadByManyThreadsAtOnceFromTheFirst) {
  write_image("color.bmp", picture(CV_8UC3, {64, 48}));
  std::vector<std::thread> threads;
  std::vector<int> rows(8, 0);
  for (int& r : rows) {
    threads.emplace_back([this, &r] {
      const auto image = read_image(folder_ / "color.bmp");
      r = image ? image->rows : -1;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(rows, std::vector<int>(8, 48));
}

TEST_F(Images, TruncationAnywhereIsAnError) {
  write_image("depth.png", picture(CV_16UC1, {64, 48}));
  write_image("color.jpg", picture(CV_8UC3, {64, 48}));
  for (const char* name : {"depth.png", "color.jpg"}) {
    const std::string whole = bytes(name);
    for (std::size_t size = 0; size + 2 < whole.size(); size += 13) {
      write_text(name, whole.substr(0, size));
      EXPECT_THAT(error_of(name), AllOf(HasSubstr(name), HasSubstr("truncated or damaged"))) << size;
    }
  }
}

TEST_F(Images, OneWrongByteInAPngIsAnError) {
  write_image("depth.png", picture(CV_16UC1, {64, 48}));
  const std::string whole = bytes("depth.png");
  for (std::size_t at = 0; at + 12 < whole.size(); at += 7) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x40);
    write_text("depth.png", damaged);
    EXPECT_FALSE(read_image(folder_ / "depth.png")) << "byte " << at;
  }
}

TEST_F(Images, NoiseInAJpegNeverCrashes) {
  write_image("color.jpg", picture(CV_8UC3, {64, 48}));
  const std::string whole = bytes("color.jpg");
  cv::RNG rng(3);
  int refused = 0;
  for (int i = 0; i < 200; ++i) {
    std::string damaged = whole;
    for (int k = 0; k < 8; ++k) damaged[rng() % damaged.size()] = static_cast<char>(rng());
    write_text("color.jpg", damaged);
    refused += read_image(folder_ / "color.jpg") ? 0 : 1;
  }
  EXPECT_GT(refused, 50);  // a JPEG has no checksums: some damage only changes pixels
}

TEST_F(Images, LyingHeadersAreRefused) {
  write_image("depth.png", picture(CV_16UC1, {64, 48}));
  EXPECT_THAT(error_of("nothing.png"), HasSubstr("nothing.png"));
  write_text("empty.png", "");
  EXPECT_THAT(error_of("empty.png"), HasSubstr("empty file"));
  write_text("text.png", "this is no picture");
  EXPECT_THAT(error_of("text.png"), HasSubstr("no known image format"));
  std::filesystem::create_directories(folder_ / "folder.png");
  EXPECT_THAT(error_of("folder.png"), HasSubstr("folder.png"));
}

using Frames = RecordingTest;

TEST_F(Frames, TruncatedImageInTheMiddleIsOneBadFrame) {
  write_tum(5);
  truncate("depth/2.png", 0.6);
  truncate("rgb/3.png", 0.9);
  testing::internal::CaptureStderr();
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_TRUE((*source)->read(1));
  const auto depth = (*source)->read(2);
  ASSERT_FALSE(depth);
  EXPECT_EQ(depth.error().kind, core::ErrorKind::kInput);
  EXPECT_THAT(depth.error().message, AllOf(HasSubstr("depth/2.png"), HasSubstr("truncated or damaged")));
  const auto color = (*source)->read(3);
  ASSERT_FALSE(color);
  EXPECT_THAT(color.error().message, AllOf(HasSubstr("rgb/3.png"), HasSubstr("truncated or damaged")));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST_F(Frames, SizesAndKindsAreChecked) {
  write_tum(6);
  write_image("rgb/1.png", color_image(1, {32, 24}));
  write_image("depth/2.png", depth_image(10000, {32, 24}));
  write_image("depth/3.png", cv::Mat(48, 64, CV_8UC1, cv::Scalar(100)));
  write_image("depth/4.png", cv::Mat(48, 64, CV_16UC3, cv::Scalar(100, 100, 101)));
  write_image("rgb/5.png", cv::Mat(48, 64, CV_16UC1, cv::Scalar(100)));
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  const auto message = [&](std::size_t i) {
    const auto frame = (*source)->read(i);
    EXPECT_FALSE(frame) << i;
    return frame ? "" : frame.error().message;
  };
  EXPECT_TRUE((*source)->read(0));
  EXPECT_THAT(message(1), AllOf(HasSubstr("rgb/1.png"), HasSubstr("32x24"), HasSubstr("64x48")));
  EXPECT_THAT(message(2), AllOf(HasSubstr("depth/2.png"), HasSubstr("32x24"), HasSubstr("64x48")));
  EXPECT_THAT(message(3), AllOf(HasSubstr("depth/3.png"), HasSubstr("8 bits"), HasSubstr("16-bit PNG")));
  EXPECT_THAT(message(4), AllOf(HasSubstr("depth/4.png"), HasSubstr("3 channels")));
  EXPECT_THAT(message(5), AllOf(HasSubstr("rgb/5.png"), HasSubstr("8 bits are needed")));
}

TEST_F(Frames, GreyAndTransparentColourAreTaken) {
  write_tum(2);
  write_image("rgb/0.png", cv::Mat(48, 64, CV_8UC1, cv::Scalar(77)));
  write_image("rgb/1.png", cv::Mat(48, 64, CV_8UC4, cv::Scalar(1, 2, 3, 4)));
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->read(0)->color.at<cv::Vec3b>(5, 5), cv::Vec3b(77, 77, 77));
  EXPECT_EQ((*source)->read(1)->color.at<cv::Vec3b>(5, 5), cv::Vec3b(1, 2, 3));
}

TEST_F(Frames, DepthOfItsOwnCameraIsRegistered) {
  write_tum(2);
  write_camera(
      "color_from_depth: [1,0,0,0, 0,1,0,0, 0,0,1,0.5, 0,0,0,1]\n"
      "depth: {width: 32, height: 24, fx: 26, fy: 26, cx: 15.5, cy: 11.5}\n");
  for (const char* name : {"depth/0.png", "depth/1.png"}) write_image(name, depth_image(10000, {32, 24}));
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  const auto frame = (*source)->read(0);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->depth.size(), cv::Size(64, 48));
  EXPECT_FLOAT_EQ(frame->depth.at<float>(24, 32), 2.5F);
}

/// Depth of all frames of write_tum, 2 m, stored by `store` under names with another ending.
class DepthKinds : public RecordingTest {
 protected:
  void write_depth(const cv::Mat& image, const std::string& ending) {
    write_tum(3);
    std::string list;
    for (int i = 0; i < 3; ++i) {
      const std::string id = std::to_string(i);
      list += stamp(i, 0) + " rgb/" + id + ".png " + stamp(i, 0) + " depth\\" + id + ending + "\r\n";
      write_image("depth/" + id + ending, image);
    }
    write_text("associations.txt", list);
  }
  void expect_two_metres(const std::string& word) {
    const auto source = open();
    ASSERT_TRUE(source) << source.error().message;
    const auto frame = (*source)->read(1);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_FLOAT_EQ(frame->depth.at<float>(5, 5), 2.0F);
    EXPECT_THAT(log_.infos, HasSubstr(word));
  }
};

TEST_F(DepthKinds, FloatTiffInMetres) {
  cv::Mat metres(48, 64, CV_32FC1, cv::Scalar(2.0));
  metres.at<float>(0, 0) = std::numeric_limits<float>::quiet_NaN();
  metres.at<float>(0, 1) = -1.0F;
  metres.at<float>(0, 2) = std::numeric_limits<float>::infinity();
  metres.at<float>(0, 3) = 20.0F;
  write_depth(metres, ".tiff");
  write_camera("depth_scale: 1000\n");  // of no meaning here
  expect_two_metres("metres as floats");
  const auto frame = (*open())->read(0);
  for (int u = 0; u < 4; ++u) EXPECT_EQ(frame->depth.at<float>(0, u), 0.0F) << u;
}

TEST_F(DepthKinds, FloatsThatAreNoMetres) {
  write_depth(cv::Mat(48, 64, CV_32FC1, cv::Scalar(2000.0)), ".tiff");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("2000"), HasSubstr("store metres")));
}

TEST_F(DepthKinds, PgmAndThreeEqualChannels) {
  write_depth(depth_image(10000), ".pgm");
  expect_two_metres("");
  cv::Mat three;
  cv::merge(std::vector<cv::Mat>(3, depth_image(10000)), three);
  write_depth(three, "_3.png");
  expect_two_metres("three equal channels");
  three.at<cv::Vec3w>(7, 7)[1] = 3;
  write_depth(three, "_3.png");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("3 channels of 16 bits"), HasSubstr("one channel")));
}

TEST_F(DepthKinds, OpenExrInMetres) {
  write_tum(1);
  // 2 x 1 pixels, one channel Z of floats, uncompressed: 2 m and 3 m.
  const auto word = [](std::uint32_t v) {
    std::string bytes;
    for (int i = 0; i < 4; ++i) bytes += static_cast<char>(v >> (8 * i) & 255U);
    return bytes;
  };
  const auto attribute = [&](const std::string& name, const std::string& type, const std::string& value) {
    return name + '\0' + type + '\0' + word(static_cast<std::uint32_t>(value.size())) + value;
  };
  const std::string box = word(0) + word(0) + word(1) + word(0);
  std::string exr = word(20000630) + word(2);
  exr +=
      attribute("channels", "chlist", std::string("Z\0", 2) + word(2) + word(0) + word(1) + word(1) + '\0');
  exr += attribute("compression", "compression", std::string(1, '\0'));
  exr += attribute("dataWindow", "box2i", box) + attribute("displayWindow", "box2i", box);
  exr += attribute("lineOrder", "lineOrder", std::string(1, '\0'));
  exr += attribute("pixelAspectRatio", "float", word(0x3F800000));
  exr += attribute("screenWindowCenter", "v2f", word(0) + word(0));
  exr += attribute("screenWindowWidth", "float", word(0x3F800000)) + '\0';
  exr += word(static_cast<std::uint32_t>(exr.size()) + 8) + word(0);
  exr += word(0) + word(8) + word(0x40000000) + word(0x40400000);
  write_text("a.exr", exr);
  const auto image = dataset::read_image(folder_ / "a.exr");
  ASSERT_TRUE(image) << image.error().message;
  ASSERT_EQ(image->type(), CV_32FC1);
  EXPECT_EQ(image->at<float>(0, 0), 2.0F);
  EXPECT_EQ(image->at<float>(0, 1), 3.0F);
  for (std::size_t size = 5; size < exr.size(); size += 3) {
    write_text("cut.exr", exr.substr(0, size));
    EXPECT_FALSE(dataset::read_image(folder_ / "cut.exr")) << size;
  }
}

/// A JPEG of one colour in cyan, magenta, yellow and black, as Adobe's programs write it: inverted.
std::string cmyk_jpeg(const cv::Vec4b& stored) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* memory = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &memory, &size);
  info.image_width = 64;
  info.image_height = 48;
  info.input_components = 4;
  info.in_color_space = JCS_CMYK;
  jpeg_set_defaults(&info);
  info.write_Adobe_marker = TRUE;
  jpeg_start_compress(&info, TRUE);
  cv::Mat row(1, 64, CV_8UC4, cv::Scalar(stored[0], stored[1], stored[2], stored[3]));
  JSAMPROW rows = row.ptr();
  while (info.next_scanline < info.image_height) jpeg_write_scanlines(&info, &rows, 1);
  jpeg_finish_compress(&info);
  std::string bytes(reinterpret_cast<char*>(memory), size);
  jpeg_destroy_compress(&info);
  std::free(memory);
  return bytes;
}

TEST_F(Frames, ColourInCmyk) {
  write_tum(2);
  write_text("rgb/0.png", cmyk_jpeg({200, 100, 50, 255}));  // kinds are told by content
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  const cv::Vec3b pixel = (*source)->read(0)->color.at<cv::Vec3b>(5, 5);
  EXPECT_LE(cv::norm(cv::Vec3i(pixel) - cv::Vec3i(50, 100, 200)), 6.0) << pixel;
}

TEST_F(Frames, ColourOf16Bits) {
  write_tum(2);
  write_image("rgb/0.png", cv::Mat(48, 64, CV_16UC3, cv::Scalar(257, 2570, 65535)));
  write_image("rgb/1.png", cv::Mat(48, 64, CV_8UC3, cv::Scalar(1, 2, 3)));
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->read(0)->color.at<cv::Vec3b>(5, 5), cv::Vec3b(1, 10, 255));
  EXPECT_THAT(log_.infos, HasSubstr("16 bits a channel"));
}

TEST_F(Frames, NothingUsable) {
  write_tum(4);
  for (int i = 0; i < 4; ++i) {
    write_image("depth/" + std::to_string(i) + ".png", cv::Mat(48, 64, CV_8UC1, cv::Scalar(100)));
  }
  EXPECT_THAT(open_error(),
              AllOf(HasSubstr("none of the 4 pairs"), HasSubstr("depth/0.png"), HasSubstr("16-bit")));
  for (int i = 0; i < 4; ++i) {
    write_image("depth/" + std::to_string(i) + ".png", depth_image(i % 2 == 0 ? 0 : 65535));
  }
  EXPECT_THAT(open_error(), HasSubstr("no measurement at all"));
}

TEST_F(Frames, OneGoodFrameIsEnoughToOpen) {
  write_tum(30);
  for (int i = 0; i < 30; ++i) {
    if (i != 11) truncate("depth/" + std::to_string(i) + ".png", 0.5);
  }
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_TRUE((*source)->read(11));
}

TEST_F(Frames, FocalLengthsThatNoCameraHasAreRefused) {
  write_tum(3);
  const std::string rest = "width: 64\nheight: 48\ncx: 31.5\ncy: 23.5\ndepth_scale: 5000\n";
  write_text("camera.yaml", rest + "fx: 5.2\nfy: 52\n");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("fx 5.2 and fy 52"), HasSubstr("pixels are nearly square")));
  for (const char* lengths : {"fx: 520\nfy: 520\n", "fx: 5.2\nfy: 5.2\n"}) {
    write_text("camera.yaml", rest + lengths);
    EXPECT_THAT(open_error(), HasSubstr("correct the camera file"));
  }
}

}  // namespace
}  // namespace plumbline::dataset
