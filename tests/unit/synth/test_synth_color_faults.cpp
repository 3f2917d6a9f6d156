// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <complex>
#include <opencv2/imgproc.hpp>

#include "plumbline/synth/source.hpp"

namespace plumbline::synth {
namespace {

/// A wall of posters, along which the camera turns.
const char* const kPosterWall = R"(
objects:
  - wall: {from: [-6, 2.05], to: [6, 2.05], height: 4, bottom: -1, thickness: 0.1, material: poster_wall}
  - lamp: {at: [0, 0, 2.5], power: 2}
robots:
  - {turn_rate: 2, path: [{at: [0, 0, 1.2], look: [-4, 9, 1.2]}, {at: [0.3, 0, 1.2], look: [4, 9, 1.2]}]}
)";

std::unique_ptr<SynthSource> filmed(const std::string& faults, double fps, int frames, double readout = 0.0,
                                    const std::string& events = "") {
  SynthOptions options;
  options.sensor = Sensor::kIdeal;
  options.motion = Motion::kWheeled;
  options.width = 320;
  options.height = 240;
  options.frames = frames;
  options.fps = fps;
  options.readout_s = readout;
  options.color_faults = faults;
  options.events = events;
  const core::Executor executor(1);
  auto source =
      SynthSource::create(*build_world(*parse_scene(kPosterWall, "test.yaml"), options, executor), 0);
  if (!source) throw std::runtime_error(source.error().message);
  return std::move(*source);
}

cv::Mat gray_of(const SynthSource& source, std::size_t index) {
  cv::Mat gray;
  source.read(index)->gray.convertTo(gray, CV_64F);
  return gray;
}

/// Amplitude of the ratio of two pictures' rows at so many periods a picture.
double amplitude(const cv::Mat& picture, const cv::Mat& clean, int periods) {
  std::complex<double> sum;
  for (int y = 0; y < picture.rows; ++y) {
    const double ratio = cv::mean(picture.row(y))[0] / cv::mean(clean.row(y))[0];
    sum += ratio * std::polar(1.0, -2.0 * M_PI * periods * y / picture.rows);
  }
  return 2.0 * std::abs(sum) / picture.rows;
}

// In dim light pictures are in proportion to the exposure: nothing is near white.
const char* const kDim = "lampoff@0+100";

TEST(SynthColorFaults, FlickerBecomesBandsWithARollingShutter) {
  const auto picture = [](const std::string& faults, double readout) {
    return gray_of(*filmed(faults, 30, 1, readout, kDim), 0);
  };
  const cv::Mat clean = picture("", 0.02), bands = picture("flicker=100", 0.02);
  const double half = M_PI * 100.0 * 0.004;
  EXPECT_NEAR(amplitude(bands, clean, 2), 0.25 * std::sin(half) / half, 0.02);
  EXPECT_LT(amplitude(bands, clean, 5), 0.01);
  // An exposure of a whole period sees none of it, and without a rolling shutter there are no bands.
  EXPECT_LT(amplitude(picture("flicker=100,motion_blur=10ms", 0.02), clean, 2), 0.01);
  EXPECT_LT(amplitude(picture("flicker=100", 0.0), picture("", 0.0), 2), 0.01);
}

TEST(SynthColorFaults, BlurIsTheMeanOfWhatIsSeenDuringTheExposure) {
  constexpr int kMiddle = 600;  // ms: the camera turns
  const auto sharp = filmed("", 1000, kMiddle + 20);
  cv::Mat mean = cv::Mat::zeros(240, 320, CV_64F);
  for (int i = -10; i <= 10; ++i)
    mean += gray_of(*sharp, kMiddle + i) * (i == -10 || i == 10 ? 0.5 : 1.0) / 20.0;
  const cv::Mat blurred = gray_of(*filmed("motion_blur=20ms", 1000, kMiddle + 20), kMiddle);
  const cv::Rect inside(20, 10, 280, 220);
  const double before = cv::norm(gray_of(*sharp, kMiddle)(inside), mean(inside), cv::NORM_L2),
               after = cv::norm(blurred(inside), mean(inside), cv::NORM_L2);
  EXPECT_GT(sharp->motion(sharp->info(kMiddle).stamp).turn_rate.norm(), 0.25);
  EXPECT_LT(after, 0.35 * before);
}

TEST(SynthColorFaults, ExposureHuntsAndJumps) {
  const auto level = [](const std::string& faults, std::size_t i) {
    return cv::mean(gray_of(*filmed(faults, 5, 16, 0.0, kDim), i))[0];
  };
  const double top = level("", 2);  // 0.4 s: near the first crest of 0.7 Hz
  EXPECT_NEAR(level("hunting=0.3", 2) / top, std::exp(0.3 * std::sin(2.0 * M_PI * 0.28)), 0.05);
  const double early = level("jumps=0.8", 9) / level("", 9), late = level("jumps=0.8", 10) / level("", 10);
  EXPECT_GT(std::abs(std::log(late / early)), 0.05);  // at 2 s
  EXPECT_NEAR(level("jumps=0.8", 8) / level("", 8), early, 0.05);
}

TEST(SynthColorFaults, MarksStayWhereTheyAre) {
  for (const std::string faults : {"dots", "specks"}) {
    const auto clean = filmed("", 5, 8), marked = filmed(faults, 5, 8);
    cv::Mat first, last;
    cv::absdiff(gray_of(*clean, 0), gray_of(*marked, 0), first);
    cv::absdiff(gray_of(*clean, 7), gray_of(*marked, 7), last);
    const cv::Mat a = first > 8.0, b = last > 8.0;
    EXPECT_GT(cv::countNonZero(a), 300) << faults;
    EXPECT_GT(cv::countNonZero(a & b), 0.6 * cv::countNonZero(a)) << faults;
  }
}

}  // namespace
}  // namespace plumbline::synth
