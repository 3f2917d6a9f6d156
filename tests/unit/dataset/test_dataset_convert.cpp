// SPDX-License-Identifier: BSD-3-Clause
// Copies of recordings with pictures that are damaged or that are not the recording's: a folder and an MCAP
// file are made of the same frames, and say the same of the others.
#include <gmock/gmock.h>

#include <cmath>

#include "plumbline/dataset/convert.hpp"
#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const char* const kSecret = "root:x:0:0: the secret\n";

class Convert : public RecordingTest {
 protected:
  void SetUp() override {
    RecordingTest::SetUp();
    base_ = folder_;
    folder_ = base_ / "recording";
    write_tum(6);
  }
  void TearDown() override {
    folder_ = base_;
    RecordingTest::TearDown();
  }
  /// Copies what is at `from` into a folder and an MCAP file; both have `frames` frames, and leave out the
  /// others with a warning that says `why`.
  void expect_copies(const fs::path& from, std::size_t frames, std::size_t left_out, const std::string& why) {
    for (const char* to : {"copy", "copy.mcap"}) {
      fs::remove_all(base_ / to);
      log_.warnings.clear();
      const auto source = open_recording(from, {}, log_);
      ASSERT_TRUE(source) << source.error().message;
      const auto summary = convert_recording(**source, base_ / to, {}, log_);
      ASSERT_TRUE(summary) << to << ": " << summary.error().message;
      EXPECT_EQ(summary->written, frames) << to;
      EXPECT_EQ(summary->unreadable, left_out) << to;
      EXPECT_THAT(log_.warnings, HasSubstr(why)) << to;
      expect_readable(to, frames);
    }
  }
  /// Every frame of a copy can be read, and nothing else is in it.
  void expect_readable(const std::string& copy, std::size_t frames) {
    const auto source = open_recording(base_ / copy, {}, log_);
    ASSERT_TRUE(source) << source.error().message;
    ASSERT_EQ((*source)->size(), frames) << copy;
    for (std::size_t i = 0; i < frames; ++i) EXPECT_TRUE((*source)->read(i)) << copy << " " << i;
    if (!fs::is_directory(base_ / copy)) return;
    for (const char* part : {"rgb", "depth"}) {
      const auto files = fs::directory_iterator(base_ / copy / part);
      EXPECT_EQ(static_cast<std::size_t>(std::distance(begin(files), end(files))), frames) << part;
    }
  }
  /// Lists another file as colour 3.
  void list_instead(const std::string& name) const {
    std::string text = "# colour\n";
    for (int i = 0; i < 6; ++i)
      text += stamp(i, 0.0) + " " + (i == 3 ? name : "rgb/" + std::to_string(i) + ".png") + "\n";
    write_text("rgb.txt", text);
  }
  void replace_by_link(const std::string& name, const fs::path& to) const {
    fs::remove(folder_ / name);
    fs::create_symlink(to, folder_ / name);
  }
  fs::path base_;
};

TEST_F(Convert, TruncatedPicturesAreLeftOut) {
  truncate("rgb/3.png", 0.5);
  truncate("depth/4.png", 0.5);
  expect_copies(folder_, 4, 2, "rgb/3.png: truncated or damaged");
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("frame 3 is left out"), HasSubstr("frame 4 is left out"),
                                   HasSubstr("depth/4.png: truncated or damaged")));
}

TEST_F(Convert, PicturesOfAnotherSizeOrKindAreLeftOut) {
  write_image("rgb/1.png", color_image(1, {32, 24}));
  write_image("depth/2.png", depth_image(10000, {32, 24}));
  write_image("depth/3.png", cv::Mat(48, 64, CV_8UC1, cv::Scalar(100)));
  expect_copies(folder_, 3, 3, "rgb/1.png: the colour image is 32x24");
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("depth/2.png: the depth image is 32x24"),
                                   HasSubstr("depth/3.png: the depth image has 1 channel of 8 bits")));
}

TEST_F(Convert, JunkWithoutAnEndingIsLeftOut) {
  write_text("rgb/x", "junk");
  list_instead("rgb/x");
  expect_copies(folder_, 5, 1, "rgb/x: truncated or damaged");
}

TEST_F(Convert, APictureWithoutAnEndingIsCopied) {
  fs::rename(folder_ / "rgb/3.png", folder_ / "rgb/x");
  list_instead("rgb/x");
  expect_copies(folder_, 6, 0, "");
}

TEST_F(Convert, LinksOutOfTheFolderAreLeftOut) {
  std::ofstream(base_ / "secret.txt") << kSecret;
  ASSERT_TRUE(cv::imwrite((base_ / "other.png").string(), color_image(9)));
  replace_by_link("rgb/2.png", base_ / "secret.txt");
  replace_by_link("rgb/3.png", "../../other.png");
  replace_by_link("depth/4.png", "/etc/passwd");
  expect_copies(folder_, 3, 3, "rgb/3.png: is behind a link that leads out of the recording's folder");
  for (const auto& entry : fs::recursive_directory_iterator(base_ / "copy")) {
    if (!entry.is_regular_file()) continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    EXPECT_THAT(bytes, AllOf(Not(HasSubstr("secret")), Not(HasSubstr("root:")))) << entry.path();
  }
}

TEST_F(Convert, LinksWithinTheFolderAndToItAreFollowed) {
  fs::create_directory(folder_ / "store");
  fs::rename(folder_ / "rgb/3.png", folder_ / "store/3.png");
  replace_by_link("rgb/3.png", "../store/3.png");
  fs::create_symlink(folder_, base_ / "link");
  expect_copies(base_ / "link", 6, 0, "");
}

TEST_F(Convert, FilesThatTheListNamesElsewhereAreCopied) {
  fs::rename(folder_ / "rgb/3.png", base_ / "elsewhere.png");
  list_instead((base_ / "elsewhere.png").string());
  expect_copies(folder_, 6, 0, "");
  list_instead("../elsewhere.png");
  expect_copies(folder_, 6, 0, "");
  std::ofstream(base_ / "secret.txt") << kSecret;
  list_instead("../secret.txt");
  expect_copies(folder_, 5, 1, "secret.txt: truncated or damaged");
}

TEST_F(Convert, NothingIsLeft) {
  fs::create_directory(base_ / "store");
  for (int i = 0; i < 6; ++i) {
    const std::string name = std::to_string(i) + ".png";
    fs::rename(folder_ / "rgb" / name, base_ / "store" / name);
    fs::create_symlink(base_ / "store" / name, folder_ / "rgb" / name);
  }
  const auto source = open();
  ASSERT_TRUE(source) << source.error().message;
  for (const char* to : {"copy", "copy.mcap"}) {
    const auto summary = convert_recording(**source, base_ / to, {}, log_);
    ASSERT_FALSE(summary);
    EXPECT_EQ(summary.error().kind, core::ErrorKind::kInput);
    EXPECT_THAT(summary.error().message, AllOf(HasSubstr("no frame can be copied"), HasSubstr("rgb/0.png")));
    EXPECT_FALSE(fs::exists(base_ / to));
  }
}

TEST_F(Convert, DepthAsNumPysArraysIsCopied) {
  fs::remove_all(folder_);
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (48, 64), }";
  header.resize(117, ' ');
  for (int i = 0; i < 3; ++i) {
    const std::string number = "00000" + std::to_string(i);
    cv::Mat metres(48, 64, CV_32FC1, cv::Scalar(1.5 + 0.25 * i));
    const std::string bytes(reinterpret_cast<const char*>(metres.data), metres.total() * sizeof(float));
    write_image("image_left/" + number + "_left.png", color_image(i));
    write_text("depth_left/" + number + "_left_depth.npy",
               std::string("\x93NUMPY\x01\x00", 8) + std::string("\x76\x00", 2) + header + "\n" + bytes);
  }
  write_camera();
  expect_copies(folder_, 3, 0, "");
}

}  // namespace
}  // namespace plumbline::dataset
