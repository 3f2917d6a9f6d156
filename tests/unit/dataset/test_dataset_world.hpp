// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Small recordings written to a temporary folder, and a log that remembers.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "plumbline/core/log.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

class MemoryLog : public core::Log {
 public:
  void write(core::LogLevel level, const std::string& message) override {
    if (level >= core::LogLevel::kWarning) warnings += message + "\n";
    if (level == core::LogLevel::kInfo) infos += message + "\n";
  }
  std::string warnings;
  std::string infos;
};

class RecordingTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("plumbline_") + test->test_suite_name() + "_" + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static cv::Mat color_image(int seed = 0, cv::Size size = {64, 48}) {
    cv::Mat image(size, CV_8UC3);
    cv::RNG rng(static_cast<std::uint64_t>(seed) + 1);
    rng.fill(image, cv::RNG::UNIFORM, 0, 256);
    return image;
  }
  static cv::Mat depth_image(int raw = 10000, cv::Size size = {64, 48}) {
    return cv::Mat(size, CV_16UC1, cv::Scalar(raw));
  }
  void write_text(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  void write_image(const std::string& name, const cv::Mat& image) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    ASSERT_TRUE(cv::imwrite((folder_ / name).string(), image)) << name;
  }
  void write_camera(const std::string& extra = "depth_scale: 5000\n") const {
    write_text("camera.yaml", "width: 64\nheight: 48\nfx: 52\nfy: 52\ncx: 31.5\ncy: 23.5\n" + extra);
  }
  /// A TUM recording of `count` pairs at 10 Hz from t = 100 s, depth 2 ms late, 2 m everywhere.
  void write_tum(int count = 6, int raw_depth = 10000) const {
    write_camera();
    std::string rgb = "# timestamp filename\n";
    std::string depth = "# timestamp filename\n";
    for (int i = 0; i < count; ++i) {
      const std::string id = std::to_string(i);
      write_image("rgb/" + id + ".png", color_image(i));
      write_image("depth/" + id + ".png", depth_image(raw_depth));
      rgb += stamp(i, 0.0) + " rgb/" + id + ".png\n";
      depth += stamp(i, 0.002) + " depth/" + id + ".png\n";
    }
    write_text("rgb.txt", rgb);
    write_text("depth.txt", depth);
  }
  static std::string stamp(int i, double offset) { return std::to_string(100.0 + 0.1 * i + offset); }

  void truncate(const std::string& name, double share) const {
    const auto size = static_cast<double>(std::filesystem::file_size(folder_ / name));
    std::filesystem::resize_file(folder_ / name, static_cast<std::uintmax_t>(size * share));
  }

  core::Result<std::unique_ptr<FrameSource>> open(const OpenOptions& options = {}) {
    log_.warnings.clear();
    return open_recording(folder_, options, log_);
  }
  std::string open_error(const OpenOptions& options = {}) {
    const auto source = open(options);
    EXPECT_FALSE(source);
    return source ? "" : source.error().message;
  }

  std::filesystem::path folder_;
  MemoryLog log_;
};

}  // namespace plumbline::dataset
