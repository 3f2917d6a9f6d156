// SPDX-License-Identifier: BSD-3-Clause
// Whether a long recording costs more the longer it gets: CSV, one line a frame, of the processor time that
// reading and features and what tracking and mapping (with bundles and loops) took, of the memory held, and
// of what the map holds.
//   long_run [--set key=value]... INPUT
// One thread, so that the times are of all that was done; processor time, so that a busy machine matters
// less.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/mapping/slam.hpp"
#include "slam_overrides.hpp"

namespace {

using namespace plumbline;

double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

double resident_mb() {
  std::ifstream statm("/proc/self/statm");
  double all = 0.0;
  double resident = 0.0;
  statm >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

core::Result<void> run(const std::string& input, const std::string& pipelines,
                       const std::vector<std::string>& overrides) {
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  const auto options = benchmarks::slam_options(overrides);
  if (!options) return tl::unexpected<core::Error>(options.error());
  dataset::OpenOptions open;
  open.cameras_folder = pipelines + "/cameras";
  const auto source = dataset::open_recording(input, open, *log);
  if (!source) return tl::unexpected<core::Error>(source.error());
  const sensor::Pinhole camera = (*source)->camera().color;
  const core::Executor executor(1);
  mapping::Slam slam(*options, camera, 0, executor, *log);
  slam.set_camera((*source)->camera());
  features::FeatureExtractor extractor({}, camera);
  std::puts("frame,features_ms,slam_ms,rss_mb,keyframes,points,lines,tracked");
  for (std::size_t i = 0; i < (*source)->size(); ++i) {
    const double begin = cpu_ms();
    const auto frame = (*source)->read(i);
    if (!frame) continue;
    const auto features = std::make_shared<const features::FrameFeatures>(extractor.extract(*frame));
    const double middle = cpu_ms();
    const mapping::FrameReport report = slam.process(*frame, features);
    const double end = cpu_ms();
    const maps::Map& map = slam.map();
    std::printf("%zu,%.3f,%.3f,%.1f,%zu,%zu,%zu,%d\n", i, middle - begin, end - middle, resident_mb(),
                map.keyframe_count(), map.point_count(), map.line_count(),
                report.state == tracking::TrackState::kTracked ? 1 : 0);
    std::fflush(stdout);
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Processor time and memory of every frame of a long recording");
  std::string input;
  std::string pipelines = PLUMBLINE_SOURCE_DIR "/pipelines";
  std::vector<std::string> overrides;
  app.add_option("INPUT", input, "A recording's folder")->required();
  app.add_option("--set", overrides, "Set an option of the track stage; may be repeated")
      ->type_name("key=value")
      ->allow_extra_args(false);
  app.add_option("--pipelines-dir", pipelines, "Folder with cameras/ and scenes/");
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  if (auto done = run(input, pipelines, overrides); !done) {
    std::fprintf(stderr, "long_run: %s\n", done.error().message.c_str());
    return static_cast<int>(done.error().kind);
  }
  return 0;
}
