// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A small TUM folder with exact truth: a camera slides along a painted wall with a box before it.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>

namespace plumbline::integration {

struct WallRecording {
  int frames = 12;
  int moving = 1000000;          ///< frames before the camera stops
  double depth_scale = 5000.0;   ///< what the images are written with
  double camera_scale = 5000.0;  ///< what camera.yaml says
  double depth_offset_s = 0.0;   ///< of the depth stamps
  std::string camera_without;    ///< a key that camera.yaml lacks
};

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr double kFocal = 262.5;
constexpr double kWall_m = 2.0;
constexpr double kBox_m = 1.5;
constexpr int kStep_px = 3;  ///< the wall moves this far in the picture from frame to frame

inline cv::Mat painting(int width, int height, std::uint64_t seed) {
  cv::RNG rng(seed);
  cv::Mat image(height, width, CV_8UC3, cv::Scalar(150, 160, 170));
  for (int i = 0; i < 500; ++i) {
    const cv::Point a(rng.uniform(0, width), rng.uniform(0, height));
    const cv::Scalar color(rng.uniform(0, 255), rng.uniform(0, 255), rng.uniform(0, 255));
    cv::rectangle(image, cv::Rect(a, cv::Size(rng.uniform(4, 40), rng.uniform(4, 40))), color, cv::FILLED);
  }
  return image;
}

inline std::string frame_name(int frame) {
  std::ostringstream name;
  name << std::setw(3) << std::setfill('0') << frame << ".png";
  return name.str();
}

inline void write_camera(const std::filesystem::path& file, const WallRecording& recording) {
  std::ofstream out(file);
  const std::pair<const char*, double> numbers[] = {{"width", kWidth},
                                                    {"height", kHeight},
                                                    {"fx", kFocal},
                                                    {"fy", kFocal},
                                                    {"cx", kWidth / 2.0},
                                                    {"cy", kHeight / 2.0},
                                                    {"depth_scale", recording.camera_scale},
                                                    {"fps", 30}};
  out << "model: pinhole\ndistortion: [0, 0, 0, 0, 0]\n";
  for (const auto& [key, value] : numbers) {
    if (recording.camera_without != key) out << key << ": " << value << "\n";
  }
}

inline void write_wall(const std::filesystem::path& folder, const WallRecording& recording = {}) {
  std::filesystem::create_directories(folder / "rgb");
  std::filesystem::create_directories(folder / "depth");
  const cv::Mat wall = painting(kWidth + 1000, kHeight, 7);
  const cv::Mat box = painting(80, 80, 8);
  std::ofstream rgb(folder / "rgb.txt");
  std::ofstream depth(folder / "depth.txt");
  std::ofstream truth(folder / "groundtruth.txt");
  for (std::ofstream* list : {&rgb, &depth, &truth}) *list << std::fixed << std::setprecision(6);
  for (int f = 0; f < recording.frames; ++f) {
    const double stamp = 10.0 + f / 30.0;
    const int step = std::min(f, recording.moving);
    cv::Mat color = wall(cv::Rect(step * kStep_px, 0, kWidth, kHeight)).clone();
    cv::Mat metres(kHeight, kWidth, CV_64FC1, cv::Scalar(kWall_m));
    const cv::Rect place(120 - step * kStep_px * 4 / 3, 80, 80, 80);  // nearer, so faster
    const cv::Rect seen = place & cv::Rect(0, 0, kWidth, kHeight);
    if (!seen.empty()) {
      box(seen - place.tl()).copyTo(color(seen));
      metres(seen) = kBox_m;
    }
    cv::Mat raw;
    metres.convertTo(raw, CV_16UC1, recording.depth_scale);
    cv::imwrite((folder / "rgb" / frame_name(f)).string(), color);
    cv::imwrite((folder / "depth" / frame_name(f)).string(), raw);
    rgb << stamp << " rgb/" << frame_name(f) << "\n";
    depth << stamp + recording.depth_offset_s << " depth/" << frame_name(f) << "\n";
    truth << stamp << " " << step * kStep_px * kWall_m / kFocal << " 0 0 0 0 0 1\n";
  }
  write_camera(folder / "camera.yaml", recording);
}

}  // namespace plumbline::integration
