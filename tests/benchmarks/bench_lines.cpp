// SPDX-License-Identifier: BSD-3-Clause
// Cost of every step of the lines of one 640 x 480 picture; the band descriptor beside OpenCV's on the same
// lines.
#include <benchmark/benchmark.h>

#include "../unit/line_world.hpp"
#include "opencv_lbd.hpp"
#include "plumbline/features/line_border.hpp"
#include "plumbline/features/line_match.hpp"

namespace {

namespace f = plumbline::features;

const cv::Mat& picture() {
  static const cv::Mat image = f::world::disturb(
      f::world::render(640, 480, 110.0, f::world::clutter(90, 640, 480, 1)), 3.0, 1.0, 0.0, 2);
  return image;
}

cv::Mat slanted_floor() {
  cv::Mat depth(480, 640, CV_32F);
  for (int y = 0; y < depth.rows; ++y) depth.row(y).setTo(1.0 + 0.003 * y);
  return depth;
}

// At least `count` segments: the detected ones, then the same again.
std::vector<f::LineSegment> segments(std::int64_t count) {
  const std::vector<f::LineSegment> found = f::LineDetector().detect(picture());
  std::vector<f::LineSegment> result;
  while (static_cast<std::int64_t>(result.size()) < count) {
    result.push_back(found[result.size() % found.size()]);
  }
  return result;
}

void detect(benchmark::State& state, f::LineMethod method) {
  f::LineDetectorOptions options;
  options.method = method;
  options.scale = state.range(0) == 2 ? f::LineScale::kHalf : f::LineScale::kFull;
  const f::LineDetector detector(options);
  std::size_t lines = 0;
  picture();
  for (auto _ : state) lines = detector.detect(picture()).size();
  state.counters["lines"] = static_cast<double>(lines);
}
BENCHMARK_CAPTURE(detect, lsd, f::LineMethod::kLsd)
    ->ArgName("scale_1/")
    ->Arg(2)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(detect, edlines, f::LineMethod::kEdlines)
    ->ArgName("scale_1/")
    ->Arg(2)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(detect, fld, f::LineMethod::kFld)
    ->ArgName("scale_1/")
    ->Arg(2)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond);

void find_border(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(f::valid_region(picture()));
}
BENCHMARK(find_border)->Unit(benchmark::kMillisecond);

void lbd_ours(benchmark::State& state) {
  const std::vector<f::LineSegment> lines = segments(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(f::describe_lines(picture(), lines));
}
BENCHMARK(lbd_ours)->Arg(150)->Arg(200)->Arg(650)->Unit(benchmark::kMillisecond);

void lbd_opencv(benchmark::State& state) {
  const std::vector<f::LineSegment> lines = segments(state.range(0));
  const auto keys = f::benchmarks::key_lines(lines, picture().size());
  const auto descriptor = cv::line_descriptor::BinaryDescriptor::createBinaryDescriptor();
  cv::Mat out;
  for (auto _ : state) {
    auto copy = keys;
    descriptor->compute(picture(), copy, out);
  }
}
BENCHMARK(lbd_opencv)->Arg(150)->Arg(200)->Arg(650)->Unit(benchmark::kMillisecond);

void match(benchmark::State& state) {
  std::vector<f::LineFeature> lines;
  const std::vector<f::LineSegment> found = segments(state.range(0));
  const std::vector<f::LineDescriptor> descriptors = f::describe_lines(picture(), found);
  for (std::size_t i = 0; i < found.size(); ++i) lines.push_back({found[i], descriptors[i], {}});
  for (auto _ : state) benchmark::DoNotOptimize(f::match_lines(lines, lines));
}
BENCHMARK(match)->Arg(150)->Arg(300)->Unit(benchmark::kMillisecond);

void fit_depth(benchmark::State& state) {
  const std::vector<f::LineSegment> lines = segments(state.range(0));
  const cv::Mat depth = slanted_floor();
  const plumbline::sensor::Pinhole camera{640, 480, 525.0, 525.0, 319.5, 239.5};
  for (auto _ : state) {
    for (const f::LineSegment& l : lines) benchmark::DoNotOptimize(f::fit_line_depth(l, depth, camera));
  }
}
BENCHMARK(fit_depth)->Arg(150)->Unit(benchmark::kMillisecond);

void extract(benchmark::State& state) {
  const cv::Mat depth = slanted_floor();
  const plumbline::sensor::Pinhole camera{640, 480, 525.0, 525.0, 319.5, 239.5};
  const f::LineExtractor extractor;
  picture();
  for (auto _ : state) benchmark::DoNotOptimize(extractor.extract(picture(), depth, camera));
}
BENCHMARK(extract)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
