// SPDX-License-Identifier: BSD-3-Clause
// Opens a recording, whatever its layout, and reads it frame by frame.
//
//   read_recording INPUT PIPELINES
//
// INPUT: a TUM, 7-Scenes or Redwood folder, or a world to be filmed such as "synth:room?frames=25".
// PIPELINES: the shipped pipelines/ folder, for its cameras and scenes.
#include <cstdio>
#include <opencv2/core.hpp>

#include "plumbline/pipeline/input.hpp"

using namespace plumbline;

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: read_recording INPUT PIPELINES\n");
    return 2;
  }

  const std::filesystem::path pipelines = argv[2];
  const core::Executor executor;  // one thread per core
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  dataset::OpenOptions options;
  options.cameras_folder = pipelines / "cameras";

  // Expected failures are values: a Result holds the requested value or an Error with a message for people.
  const auto source = pipeline::open_input(argv[1], options, pipelines / "scenes", executor, *log);
  if (!source) {
    std::fprintf(stderr, "%s\n", source.error().message.c_str());
    return static_cast<int>(source.error().kind);
  }

  const sensor::Pinhole& camera = (*source)->camera().color;
  std::printf("%s: %d x %d pixels, fx %.1f\n", (*source)->name().c_str(), camera.width, camera.height,
              camera.fx);

  std::size_t readable = 0;
  for (std::size_t i = 0; i < (*source)->size(); ++i) {
    const auto frame = (*source)->read(i);  // rectified; depth in metres, 0 where there is none
    if (!frame) {                           // about this frame only
      std::fprintf(stderr, "%s\n", frame.error().message.c_str());
      continue;
    }

    ++readable;
    const cv::Mat measured = frame->depth > 0.0;
    std::printf("%10.3f s  mean depth %.2f m, %.0f %% measured\n", frame->stamp,
                cv::mean(frame->depth, measured)[0],
                100.0 * cv::countNonZero(measured) / static_cast<double>(measured.total()));
  }

  std::printf("%zu frames, %zu readable\n", (*source)->size(), readable);
}
